"""The campaign's part `calm`: SARA's default planners beside the classic ones on the same drives."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from sara_lab.campaign.part import Part, mean
from sara_lab.journeys import journeys as trips
from sara_lab.journeys.squares import MISSIONS, square

CALM_SEEDS = 5  # squares each way that the planners are compared on
PLANNERS = {
    planner: replace(trips.PLANNERS[planner], sonars=False)
    for planner in ('default', 'TrajectoryPlannerROS', 'DWAPlannerROS')
}


def calm(_seeds: int, _folder: Path) -> Part:
    """The default planners beside the classic ones on the same drives: squares each way, and the journeys. True pose;
    range layers and distance zones off for all, as the classic ones need it.
    """
    cases = {
        f'calm_{direction}_{planner}_{seed}': partial(_around, planner, direction, seed)
        for planner in PLANNERS
        for direction in MISSIONS
        for seed in range(CALM_SEEDS)
    }
    cases |= {
        f'calm_{name}_{planner}_{number}': partial(_journey, planner, name, number)
        for planner in PLANNERS
        for name in trips.MAPS
        for number in range(trips.PAIRS)
    }
    return Part(cases, _calm_summary, _calm_verdict)


def _around(planner, direction, seed):
    """A square."""
    how = PLANNERS[planner]
    drive, found = square(direction, 'true', seed, navigation=how.navigation, prepare=how.prepare)
    return {
        'planner': planner,
        'map': f'square_{direction}',
        'number': seed,
        'reached': all(corner.reached for corner in drive.corners),
        'judgement': found.to_json(),
        'faults': [f'{drive.contacts} contacts'] if drive.contacts else [],
    }


def _journey(planner, name, number):
    """A journey on a map."""
    outcome = trips.drive(name, PLANNERS[planner], number)
    return {
        'planner': planner,
        'map': name,
        'number': number,
        'reached': outcome.reached,
        'judgement': outcome.to_json()['judgement'],
        'faults': [f'{outcome.contacts} contacts'] if outcome.contacts else [],
    }


def _calm_summary(results):
    by = {
        planner: {(result['map'], result['number']): result for result in results if result['planner'] == planner}
        for planner in PLANNERS
    }
    same = [drive for drive in by['default'] if all(by[planner][drive]['reached'] for planner in PLANNERS)]
    figures = {'drives': len(by['default']), 'reached_by_all': len(same)}
    lines = [
        f'{len(same)} of {len(by["default"])} drives were driven to their end by all; these are compared',
        (
            f'{"planner":22} {"discomfort s/m":>14} {"s/m":>6} {"jerk along":>10} {"across":>7} '
            f'{"reversals/m":>11} {"last metre s":>12} {"acceleration":>12} {"beyond deg":>10}'
        ),
    ]
    for planner in PLANNERS:
        of = [by[planner][drive]['judgement'] for drive in same]
        way = sum(found['length'] for found in of)
        row = {
            'discomfort_per_m': sum(found['discomfort'] for found in of) / way,
            'seconds_per_m': sum(found['seconds'] for found in of) / way,
            'discomfort': sum(found['discomfort'] for found in of),
            'jerk_tangential_rms': mean([found['jerk_tangential_rms'] for found in of]),
            'jerk_normal_rms': mean([found['jerk_normal_rms'] for found in of]),
            'reversals_per_m_p95': float(np.percentile([found['reversals_per_m'] for found in of], 95)),
            'last_metre_s_worst': max(seconds for found in of for seconds in found['last_metre']),
            'acceleration_rms_worst': max(found['acceleration_rms'] for found in of),
            'turn_beyond_deg_worst': max(found['beyond_shortest_deg'] or 0.0 for found in of),
        }
        figures[planner] = row
        lines.append(
            '{:22} {discomfort_per_m:14.3f} {seconds_per_m:6.2f} {jerk_tangential_rms:10.3f} '
            '{jerk_normal_rms:7.3f} {reversals_per_m_p95:11.2f} {last_metre_s_worst:12.1f} '
            '{acceleration_rms_worst:12.3f} {turn_beyond_deg_worst:10.1f}'.format(planner, **row)
        )
    return lines, figures


def _calm_verdict(figures):
    ours = figures['default']['discomfort']
    return [
        f"discomfort {ours:.1f} s on the same drives, {planner}'s is {figures[planner]['discomfort']:.1f}"
        for planner in [name for name in PLANNERS if name != 'default']
        if not ours < figures[planner]['discomfort']
    ]
