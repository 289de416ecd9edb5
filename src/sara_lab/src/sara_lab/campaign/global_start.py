"""The campaign's part `global_start`: chairs that start anywhere on a map, and find their place by the ultrasonic
sensors alone.
"""

import math
from pathlib import Path
from typing import Any

from sara_lab.campaign.part import Figures, Part, spread
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.global_start import OTHER_PLACE, Start, start
from sara_lab.studies.wandering import kept

WITHIN = 0.20, math.radians(5.0)
"""m, rad: a pose that is known, at the end of the drive."""
HONEST = 0.95
"""Share of the starts after which the pose is known, or said not to be."""
WRONG = 0.001
"""Share of the starts after which a wrong pose counts as known."""


def global_start(seeds: int, folder: Path) -> Part:
    """On each map as many chairs as chairs and a third more: 201 in all with 50. Drives are kept in the folder: what
    changes the localization alone needs no new ones.
    """
    chairs = -(-4 * seeds // 3)
    return Part(
        {
            f'global_start_{name}_{number}': lambda name=name, number=number: judged(
                name, start(kept(name, number, folder / 'wander'), name)
            )
            for number in range(chairs)
            for name in MAPS
        },
        _summary,
        _verdict,
    )


def judged(name: str, came: Start) -> dict[str, Any]:
    """The Start as plain data, `known`: whether the pose is at the end, `wrong`: whether it was taken for known and was
    that of another place, or is not within WITHIN at the end.
    """
    inside = came.off <= WITHIN[0] and came.turned <= WITHIN[1]
    elsewhere = came.at_most is not None and (came.at_most[0] > OTHER_PLACE[0] or came.at_most[1] > OTHER_PLACE[1])
    wrong = came.found is not None and (elsewhere or not (inside or came.told))
    off = f'{came.off:.2f} m and {math.degrees(came.turned):.1f} deg'
    return {
        'map': name,
        **came._asdict(),
        'off': came.off if came.found is not None else None,
        'turned': came.turned if came.found is not None else None,
        'known': inside and not wrong,
        'wrong': wrong,
        'faults': [f'sure after {came.found:.1f} m and wrong: {off} off at the end'] if wrong else [],
    }


def _summary(results):
    figures, lines = {}, []
    for name in (*MAPS, 'all'):
        of = [result for result in results if name in (result['map'], 'all')]
        figures[name] = row = _row(of)
        line = f'{name:7} known {row["known"]}, not sure {row["not_sure"]}, wrong {row["wrong"]} of {row["cases"]}'
        if row['known']:
            line += (
                '; known after {found_m[median]:.1f} m (median), {found_m[p95]:.1f} (p95); off at the end '
                '{off_m[median]:.3f} m, {off_m[p95]:.3f}, {turned_deg[p95]:.1f} deg'
            ).format(**row)
        lines.append(line)
    return lines, figures


def _row(of) -> Figures:
    known = [result for result in of if result['known']]
    row: Figures = {
        'cases': len(of),
        'known': len(known),
        'not_sure': sum(not result['known'] and not result['wrong'] for result in of),
        'wrong': sum(result['wrong'] for result in of),
        'way_m': spread([result['way'] for result in of]),
    }
    if known:
        row['found_m'] = spread([result['found'] for result in known])
        row['off_m'] = spread([result['off'] for result in known])
        row['turned_deg'] = spread([math.degrees(result['turned']) for result in known])
    return row


def _verdict(figures):
    row, found = figures['all'], []
    honest = row['known'] + row['not_sure']
    if honest < HONEST * row['cases']:
        found.append(f'known or not sure: {honest} of {row["cases"]}, {HONEST:.0%} are asked for')
    if row['wrong'] > WRONG * row['cases']:
        found.append(f'sure and wrong: {row["wrong"]} of {row["cases"]}, {WRONG:.1%} is allowed')
    return found
