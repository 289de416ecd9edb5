"""The campaign's parts `assisted`, `assisted_doors`, `assisted_wall` and `assisted_dock`: simulated riders on three
circuits, alone, with the safety gate, and with shared control; through a door of 0.80 m; along a wall; and up to a
table or a bed.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sara_lab.campaign.part import Figures, Part
from sara_lab.rides import dock_rides, wall_rides
from sara_lab.rides.circuits import circuits as all_circuits
from sara_lab.rides.door_rides import APPROACHES, passed, through
from sara_lab.rides.ride import LIMIT_S, WAYS, ride
from sara_sim.riders.riders import RIDERS

EXPERT = 'expert'
TOO_EASY = ('blind', 'one_sided')  # riders who collide where nothing helps, or the circuit is too easy
QUICKER, COMPLETED, CALMER = 0.8, 0.98, 0.5  # impaired riders: of the time, at least, of the reversals, beside the gate
EXPERT_TIME, EXPERT_CHANGED = 1.05, 0.05  # of free; share of the wish
DOOR_RIDERS, DOOR_WAYS, DOOR_PASSED = ('tremor', 'late', 'four_directions'), ('gate', 'assisted'), 0.95
WALL_M = 0.25, 0.35  # m from the wall, that 90 % of the way are to lie between
DOCK_M = 0.05, 0.15  # m before a table or a bed, that the rests are to lie between
DOCK_ASIDE_M = 0.15  # m; who stands no farther from before its middle came to it
LINE = (
    '{:8} {:16} {:9} {completed:4}/{rides:<4} {collided:8} {contacts:8} {seconds:7.1f} {reversals_per_m:11.2f} '
    '{reversals_per_min:13.1f} {changed:8.3f} {stops:6.1f} {gap_min_m:6.3f}'
)
HEAD = (
    f'{"circuit":8} {"rider":16} {"way":9} {"completed":>9} {"collided":>8} {"contacts":>8} {"time s":>7} '
    f'{"reversals/m":>11} {"reversals/min":>13} {"changed":>8} {"stops":>6} {"gap m":>6}'
)


def assisted(
    seeds: int, _folder: Path, riders: Sequence[str] = tuple(RIDERS), circuits: Sequence[str] | None = None
) -> Part:
    """Riders (of RIDERS) on circuits (all where none are given), in all WAYS."""

    def case(circuit, rider, way, seed):
        found = ride(circuit, rider, way, seed).to_json()
        touches = way == 'assisted' or rider == EXPERT
        return {**found, 'faults': [f'{len(found["contacts"])} contacts'] if touches and found['contacts'] else []}

    return Part(
        {
            f'assisted_{circuit}_{rider}_{way}_{seed}': lambda names=(circuit, rider, way, seed): case(*names)
            for circuit in circuits or all_circuits()
            for rider in riders
            for way in WAYS
            for seed in range(seeds)
        },
        _summary,
        _verdict,
    )


def _summary(results):
    lines, figures = [HEAD], {}
    for result in results:
        group = figures.setdefault(f'{result["circuit"]}_{result["rider"]}', {})
        group.setdefault(result['way'], []).append(result)
    for group in figures.values():
        for way, of in group.items():
            group[way] = _row(of)
            lines.append(LINE.format(*(of[0][key] for key in ('circuit', 'rider', 'way')), **group[way]))
    return lines, figures


def _row(of):
    """Figures of rides of one rider on one circuit in one way; who does not complete takes LIMIT_S."""
    seconds = [found['seconds'] if found['completed'] else LIMIT_S for found in of]
    medians = {key: float(np.median([found[key] for found in of])) for key in ('reversals_per_m', 'reversals_per_min')}
    return {
        'rides': len(of),
        'completed': sum(found['completed'] for found in of),
        'collided': sum(bool(found['contacts']) for found in of),
        'contacts': sum(len(found['contacts']) for found in of),
        'seconds': float(np.median(seconds)),
        **medians,
        'changed': float(np.mean([found['changed'] for found in of])),
        'stops': float(np.mean([found['stops'] for found in of])),
        'gap_min_m': min(found['gap'] for found in of),
    }


def _verdict(figures: Figures) -> list[str]:
    found = []
    for group, ways in figures.items():
        rider = group.split('_', 1)[1]
        found += [f'{group}: {text}' for text in (_expert_faults(ways) if rider == EXPERT else _impaired_faults(ways))]
        if rider in TOO_EASY and not ways['free']['collided']:
            found.append(f'{group}: nobody collides without help: the circuit is too easy')
    return found


def _expert_faults(ways):
    """What help costs somebody who needs none."""
    helped, ratio = ways['assisted'], ways['assisted']['seconds'] / ways['free']['seconds']
    found = [] if ratio <= EXPERT_TIME else [f'{ratio:.2f} of the time without help, at most {EXPERT_TIME:g}']
    if helped['changed'] > EXPERT_CHANGED:
        found.append(f'{helped["changed"]:.1%} of the wish is changed, at most {EXPERT_CHANGED:.0%}')
    return found


def _impaired_faults(ways):
    """What help does not do for somebody who needs it."""
    helped, gate = ways['assisted'], ways['gate']
    found = []
    if helped['seconds'] > QUICKER * gate['seconds']:
        found.append(f'{helped["seconds"]:.0f} s, with the gate alone {gate["seconds"]:.0f}: at most {QUICKER:g} of it')
    if helped['completed'] < COMPLETED * helped['rides']:
        found.append(f'{helped["completed"]} of {helped["rides"]} completed, at least {COMPLETED:.0%}')
    if helped['reversals_per_min'] > CALMER * gate['reversals_per_min']:
        found.append(
            f'{helped["reversals_per_min"]:.1f} reversals/min, with the gate alone {gate["reversals_per_min"]:.1f}: '
            f'at most {CALMER:g} of it'
        )
    return found


def assisted_doors(_seeds: int, _folder: Path) -> Part:
    """Through a door of 0.80 m from 20 angles, whatever the number of chairs: with the gate, and with shared
    control.
    """

    def case(rider, way, number):
        made = through(number, rider, way)
        faults = [f'{len(made.contacts)} contacts'] if way == 'assisted' and made.contacts else []
        return {**made.to_json(), 'without_stopping': passed(made), 'faults': faults}

    return Part(
        {
            f'assisted_doors_{rider}_{way}_{number}': lambda names=(rider, way, number): case(*names)
            for rider in DOOR_RIDERS
            for way in DOOR_WAYS
            for number in range(APPROACHES)
        },
        _doors_summary,
        _doors_verdict,
    )


def _doors_summary(results):
    lines, figures = [f'{"rider":16} {"way":9} {"passed":>7} {"without a stop":>14} {"contacts":>8} {"time s":>7}'], {}
    for rider in DOOR_RIDERS:
        for way in DOOR_WAYS:
            of = [found for found in results if (found['rider'], found['way']) == (rider, way)]
            row = {
                'approaches': len(of),
                'passed': sum(found['completed'] for found in of),
                'without_stopping': sum(found['without_stopping'] for found in of),
                'contacts': sum(len(found['contacts']) for found in of),
                'seconds': float(np.median([found['seconds'] if found['completed'] else LIMIT_S for found in of])),
            }
            figures[f'{rider}_{way}'] = row
            lines.append(
                '{:16} {:9} {passed:7} {without_stopping:14} {contacts:8} {seconds:7.1f}'.format(rider, way, **row)
            )
    return lines, figures


def _doors_verdict(figures):
    return [
        f'{group}: {row["without_stopping"]} of {row["approaches"]} passed without stopping, at least {DOOR_PASSED:.0%}'
        for group, row in figures.items()
        if group.endswith('_assisted') and row['without_stopping'] < DOOR_PASSED * row['approaches']
    ]


def assisted_wall(_seeds: int, _folder: Path) -> Part:
    """Along a wall that the rider steers into, whatever the number of chairs."""

    def case(number):
        made = wall_rides.along(number)
        faults = [f'{made.contacts} contacts'] if made.contacts else []
        faults += [] if len(made.gap) else ['stood still before the wall']
        return {'gap': made.gap.tolist(), 'faults': faults}

    return Part(
        {f'assisted_wall_{number}': lambda n=number: case(n) for number in range(wall_rides.RIDES)},
        _wall_summary,
        _wall_verdict,
    )


def _wall_summary(results):
    p5, middle, p95 = np.percentile(np.concatenate([found['gap'] for found in results]), (5, 50, 95))
    figures = {'rides': len(results), 'gap_p5_m': float(p5), 'gap_p50_m': float(middle), 'gap_p95_m': float(p95)}
    return [f'along a wall at {p5:.2f} (p5), {middle:.2f} (median), {p95:.2f} m (p95)'], figures


def _wall_verdict(figures):
    return _outside(figures['gap_p5_m'], figures['gap_p95_m'], WALL_M)


def _outside(low, high, allowed):
    """What is wrong with gaps from low to high (m)."""
    return [] if allowed[0] <= low and high <= allowed[1] else [f'at {low:.2f} to {high:.2f} m, allowed {allowed}']


def assisted_dock(_seeds: int, _folder: Path) -> Part:
    """Up to a table or a bed, and out again, whatever the number of chairs."""

    def case(number):
        made = dock_rides.dock(number)
        faults = [f'{made.contacts} contacts'] if made.contacts else []
        faults += [] if made.aside <= DOCK_ASIDE_M else [f'was led {made.aside:.2f} m aside']
        faults += [] if made.out else ['did not come out again']
        return {'gap': made.gap, 'docked': made.aside <= DOCK_ASIDE_M, 'faults': faults}

    return Part(
        {f'assisted_dock_{number}': lambda n=number: case(n) for number in range(dock_rides.RIDES)},
        _dock_summary,
        _dock_verdict,
    )


def _dock_summary(results):
    docked = [found['gap'] for found in results if found['docked']]
    least, middle, most = np.percentile(docked, (0, 50, 100)) if docked else (np.nan,) * 3
    figures = {'rides': len(results), 'docked': len(docked)}
    figures |= {'gap_min_m': float(least), 'gap_p50_m': float(middle), 'gap_max_m': float(most)}
    line = f'{len(docked)} of {len(results)} came to a table or a bed, to {least:.2f} to {most:.2f} m'
    return [f'{line}, median {middle:.2f} m'], figures


def _dock_verdict(figures):
    return _outside(figures['gap_min_m'], figures['gap_max_m'], DOCK_M)
