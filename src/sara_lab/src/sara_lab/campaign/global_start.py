"""The campaign's part `global_start`: chairs that start anywhere on a map, and find their place by the ultrasonic
sensors alone; and whether they are tracked from then on as well as if their start had been told.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from sara_lab.campaign.part import Figures, Part, spread
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.global_start import OTHER_PLACE, Start, Told, start, told
from sara_lab.studies.wandering import Recording, kept

WITHIN = 0.20, math.radians(5.0)
"""m, rad: a pose that is known, at the end of the drive."""
HONEST = 0.95
"""Share of the starts after which the pose is known, or said not to be."""
WRONG = 0.001
"""Share of the starts after which a wrong pose counts as known."""
LATER = 5.0, 10.0, 15.0, 20.0
"""m of a drive after which a localization that knows nothing of what was before starts, too."""
FURTHER = 2.0
"""m from where on such a one knows its place to where it ends."""
NO_WORSE = 0.01
"""m by which the median and the 90th percentile of the error at the end may be greater than with a start that is told:
a fifth of a map's cell.
"""
BESIDE = 'anywhere', 'told', 'reckoned'
"""Whose errors are compared: of a start anywhere, of one that is told, and of the dead reckoning from there; on the
drives of a map on which a start anywhere was known at the end; where there is none the last two, on all.
"""


def global_start(seeds: int, folder: Path) -> Part:
    """On each map as many chairs as chairs and a third more: 201 in all with 50; four later starts on each drive, and
    one that is told. Drives are kept in the folder, for all of these.
    """
    chairs, drives = -(-4 * seeds // 3), folder / 'wander'
    each = [(name, number) for number in range(chairs) for name in MAPS]
    cases = {
        f'global_start_{name}_{number}': lambda name=name, number=number: judged(
            name, start(kept(name, number, drives), name)
        )
        for name, number in each
    }
    cases |= {
        f'global_start_later_{name}_{number}': lambda name=name, number=number: later(name, kept(name, number, drives))
        for name, number in each
    }
    cases |= {
        f'global_start_told_{name}_{number}': lambda name=name, number=number: tracked(
            name, told(kept(name, number, drives), name)
        )
        for name, number in each
    }
    return Part(cases, _summary, _verdict)


def tracked(name: str, came: Told) -> dict[str, Any]:
    """The Told as plain data, with its map."""
    return {'map': name, **came._asdict(), 'faults': []}


def later(name: str, recording: Recording) -> dict[str, Any]:
    """{map; starts: what `judged` says of each later start on a drive, as far as it goes; faults: of all}."""
    starts = [
        judged(name, start(recording, name, since, FURTHER)) for since in LATER if since + FURTHER <= recording.way
    ]
    return {'map': name, 'starts': starts, 'faults': [fault for one in starts for fault in one['faults']]}


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
    firsts, tolds = [r for r in results if 'known' in r], [r for r in results if 'reckoned_off' in r]
    groups = {name: [result for result in firsts if name in (result['map'], 'all')] for name in (*MAPS, 'all')}
    laters = [one for result in results if 'starts' in result for one in result['starts']]
    groups |= {'later': laters} if laters else {}
    for name, of in groups.items():
        figures[name] = row = _row(of)
        line = f'{name:7} known {row["known"]}, not sure {row["not_sure"]}, wrong {row["wrong"]} of {row["cases"]}'
        if row['known']:
            line += (
                '; known after {found_m[median]:.1f} m (median), {found_m[p95]:.1f} (p95); off at the end '
                '{off_m[median]:.3f} m, {off_m[p95]:.3f}, {turned_deg[p95]:.1f} deg'
            ).format(**row)
        lines.append(line)
    for name in MAPS if tolds else ():
        figures[f'tracked_{name}'] = row = _beside([p for p in zip(firsts, tolds, strict=True) if p[0]['map'] == name])
        lines.append(
            f'{name:7} {row["drives"]} drives, m off at the end, median and 90th percentile: '
            + '; '.join(f'{what} {row[what][0]:.3f}, {row[what][1]:.3f}' for what in BESIDE if what in row)
        )
    return lines, figures


def _beside(pairs):
    """pairs: what a start anywhere and a start that is told on the same drive led to."""
    known = [pair for pair in pairs if pair[0]['known']]
    errors = [(first['off'], told['off'], told['reckoned_off']) for first, told in known or pairs]
    columns = list(zip(BESIDE, zip(*errors)))[0 if known else 1 :]
    return {'drives': len(errors), **{what: np.percentile(column, (50, 90)).tolist() for what, column in columns}}


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
    groups = [figures[name] for name in ('all', 'later') if name in figures]
    wrong, cases = (sum(group[key] for group in groups) for key in ('wrong', 'cases'))
    if wrong > WRONG * cases:
        found.append(f'sure and wrong: {wrong} of {cases}, {WRONG:.1%} is allowed')
    for name in MAPS:
        row = figures.get(f'tracked_{name}', {})
        if any(off > told + NO_WORSE for off, told in zip(row.get(BESIDE[0], ()), row.get(BESIDE[1], ()))):
            found.append(
                '{}: {:.3f} and {:.3f} m off, {:.3f} and {:.3f} where the start is told'.format(
                    name, *row[BESIDE[0]], *row[BESIDE[1]]
                )
            )
    return found
