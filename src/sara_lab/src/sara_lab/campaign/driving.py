"""Parts of the campaign that judge how the chair is driven: squares, doors, travel, journeys, calm. Limits are those
that SARA's default planners are held to.
"""

import math
from dataclasses import replace

import numpy as np

from sara_lab.campaign.part import Part, lines_of, spread
from sara_lab.experiments.gains import gain_of
from sara_lab.journeys import doors as crossings
from sara_lab.journeys import journeys as trips
from sara_lab.journeys import travel as travels
from sara_lab.journeys.squares import MISSIONS, POSES, square
from sara_lab.journeys.travel_cases import MAPS, PAIRS
from sara_lab.judge.drives import track_of
from sara_lab.judge.judge import cross_track

CORNERS = {'true': (0.04, 1.0), 'fused': (0.10, 2.0)}  # m, deg: p95 of the squares' corners
ACROSS = {'true': 0.03, 'fused': 0.05}  # m: p95 of cross-track on straight legs
BEYOND_DEG = 3.0  # any turn, beyond the shortest (true pose)
REACHED = {
    'true': 0.98,
    'fused': 0.95,
    'boxes': 0.90,
}  # share of journeys; fused: of those whose way is no longer than SHORT_M
SHORT_M = 10.0
REVERSALS_PER_M, LAST_METRE_S, ACCELERATION = (
    1.0,
    15.0,
    0.315,
)  # p95; any: the metre of way, on squares the final turn too; any (m/s2 r.m.s.)
THINNED = 5  # one distance from the leg of so many is kept, at 50 Hz
CALM_SEEDS = 5  # squares each way that the planners are compared on


def squares(seeds, folder):
    """The thesis's square both ways, driven by the planner alone and by the whole stack."""

    def case(direction, pose, seed):
        drive, found = square(direction, pose, seed, gain_of(seed, folder) if pose == 'fused' else None)
        return {
            'direction': direction,
            'pose': pose,
            'seed': seed,
            'judgement': found.to_json(),
            'across_m': np.round(cross_track(track_of(drive))[::THINNED], 4).tolist(),
            'faults': [
                f'corner {number} not reached: {corner.text}'
                for number, corner in enumerate(drive.corners, 1)
                if not corner.reached
            ]
            + ([f'{drive.contacts} contacts'] if drive.contacts else []),
        }

    return Part(
        {
            f'squares_{direction}_{pose}_{seed}': lambda direction=direction, pose=pose, seed=seed: case(
                direction, pose, seed
            )
            for pose in POSES
            for direction in MISSIONS
            for seed in range(seeds)
        },
        _squares_summary,
        _squares_verdict,
    )


def _squares_summary(results):
    figures = {}
    for pose in POSES:
        of = [result['judgement'] for result in results if result['pose'] == pose]
        corners = [corner for found in of for corner in found['corners']]
        figures.update(
            {
                f'{pose}_{name}': value
                for name, value in {
                    'corner_position_m': spread([corner['position'] for corner in corners]),
                    'corner_yaw_deg': spread([abs(corner['yaw']) for corner in corners]),
                    'cross_track_m': spread(
                        [off for result in results if result['pose'] == pose for off in result['across_m']]
                    ),
                    'cross_track_p95_of_a_drive_m': spread([found['cross_track_p95'] for found in of]),
                    'turn_beyond_deg': spread([found['beyond_shortest_deg'] for found in of]),
                    **calm_figures(of),
                    'contacts': sum(found['contacts'] for found in of),
                }.items()
            }
        )
    return lines_of(figures), figures


def _squares_verdict(figures):
    found = []
    for pose in POSES:
        for name, limit in (
            ('corner_position_m', CORNERS[pose][0]),
            ('corner_yaw_deg', CORNERS[pose][1]),
            ('cross_track_m', ACROSS[pose]),
        ):
            if not figures[f'{pose}_{name}']['p95'] <= limit:
                found.append(f'{pose} pose: {name} p95 {figures[f"{pose}_{name}"]["p95"]:.3f}, at most {limit:g}')
        found += calm_faults(figures, f'{pose}_', turning=True)
    if not figures['true_turn_beyond_deg']['worst'] <= BEYOND_DEG:
        found.append(
            f'true pose: a turn went {figures["true_turn_beyond_deg"]["worst"]:.2f} deg beyond the shortest, '
            f'at most {BEYOND_DEG:g}'
        )
    return found


def calm_figures(judgements):
    """How calm drives were, of their judgements as plain data."""
    return {
        'reversals_per_m': spread([found['reversals_per_m'] or 0.0 for found in judgements]),
        'last_metre_s': spread([seconds for found in judgements for seconds in found['last_way']] or [math.nan]),
        'last_metre_and_turn_s': spread(
            [seconds for found in judgements for seconds in found['last_metre']] or [math.nan]
        ),
        'acceleration_rms': spread([found['acceleration_rms'] or 0.0 for found in judgements]),
    }


def calm_faults(figures, prefix, turning=False):
    """Sentences about what of that is not calm; `turning`: the final turn is part of the last metre."""
    limits = (
        ('reversals_per_m', 'p95', REVERSALS_PER_M),
        ('last_metre_and_turn_s' if turning else 'last_metre_s', 'worst', LAST_METRE_S),
        ('acceleration_rms', 'worst', ACCELERATION),
    )
    return [
        f'{prefix}{name} {which} {figures[prefix + name][which]:.3f}, at most {limit:g}'
        for name, which, limit in limits
        if figures[prefix + name][which] > limit
    ]


def doors(_seeds, _folder):
    """A door of 0.80 m from 20 angles, whatever the number of chairs."""
    return Part(
        {
            f'doors_{number}': lambda number=number: crossings.cross(number).to_json()
            for number in range(crossings.APPROACHES)
        },
        _doors_summary,
    )


def _doors_summary(results):
    figures = {
        'crossed': sum(result['reached'] for result in results),
        'approaches': len(results),
        'contacts': sum(len(result['contacts']) for result in results),
        'gap_min_m': min(result['judgement']['gap_min'] for result in results),
        'seconds': spread([result['judgement']['seconds'] for result in results]),
    }
    return lines_of(figures), figures


def travel(_seeds, folder):
    """Fifty pairs of any poses on each of three maps, whatever the number of chairs: true pose, fused, with unknown
    boxes, with people, with people who are expected.
    """

    def case(name, mode, number):
        return travels.drive(name, mode, number, gain_of(number, folder) if mode == 'fused' else None).to_json()

    return Part(
        {
            f'travel_{name}_{mode}_{number}': lambda name=name, mode=mode, number=number: case(name, mode, number)
            for mode in travels.MODES
            for name in MAPS
            for number in range(PAIRS)
        },
        _travel_summary,
        _travel_verdict,
    )


def _travel_summary(results):
    lines = [
        (
            f'{"mode":8} {"map":8} {"reached":>9} {"to 10 m":>9} {"contacts":>8} {"to blame":>8} {"gap min m":>9} '
            f'{"driven/way":>10} {"m/s":>5} {"discomfort s/m":>14}'
        )
    ]
    figures = {}
    for mode in travels.MODES:
        for name in (*MAPS, 'all'):
            of = [result for result in results if result['mode'] == mode and name in (result['map'], 'all')]
            there = [result['judgement'] for result in of if result['reached']]
            short = [result for result in of if result['way'] <= SHORT_M]
            row = {
                'cases': len(of),
                'reached': sum(result['reached'] for result in of),
                'short': len(short),
                'short_reached': sum(result['reached'] for result in short),
                'contacts': sum(len(result['contacts']) for result in of),
                'to_blame': sum(not contact['blameless'] for result in of for contact in result['contacts']),
                'gap_min_m': min((found['gap_min'] for found in there), default=math.nan),
                'detour': _mean([found['detour'] for found in there]),
                'speed': _mean([found['length'] / found['seconds'] for found in there]),
                'discomfort_per_m': _mean([found['discomfort'] / found['length'] for found in there]),
            }
            if name == 'all':
                row.update(calm_figures(there))
            figures[f'{mode}_{name}'] = row
            lines.append(
                '{:8} {:8} {reached:4}/{cases:<4} {short_reached:4}/{short:<4} {contacts:8} {to_blame:8} '
                '{gap_min_m:9.3f} {detour:10.2f} {speed:5.2f} '
                '{discomfort_per_m:14.2f}'.format(mode, name, **row)
            )
        lines += [
            f'{mode}: ' + line
            for line in lines_of(
                {
                    key: figures[f'{mode}_all'][key]
                    for key in ('reversals_per_m', 'last_metre_s', 'last_metre_and_turn_s', 'acceleration_rms')
                }
            )
        ]
    lines += [
        f'not reached: {result["map"]} {result["mode"]} {result["number"]} ({result["way"]:.1f} m): {result["text"]}'
        for result in results
        if not result['reached']
    ]
    return lines, figures


def _travel_verdict(figures):
    found = []
    for mode, share in REACHED.items():
        row = figures[f'{mode}_all']
        reached, cases, which = (
            (row['short_reached'], row['short'], f' of ways up to {SHORT_M:g} m')
            if mode == 'fused'
            else (row['reached'], row['cases'], '')
        )
        if reached < share * cases:
            found.append(f'{mode}: {reached} of {cases} reached{which}, {share:.0%} are asked for')
    return found + [f'true: {sentence}' for sentence in calm_faults(figures['true_all'], '')]


def _mean(values):
    return float(np.mean(values)) if values else math.nan


def journeys(_seeds, _folder):
    """Each local planner from ten starts to ten goals on each map, whatever the number of chairs."""
    return Part(
        {
            f'journey_{name}_{planner}_{number}': lambda name=name, planner=planner, number=number: trips.drive(
                name, planner, number
            ).to_json()
            for name in trips.MAPS
            for planner in trips.PLANNERS
            for number in range(trips.PAIRS)
        },
        _journeys_summary,
    )


def _journeys_summary(results):
    lines = [
        (
            f'{"map":8} {"planner":22} {"reached":>7} {"contacts":>8} {"worst m off":>11} {"deg":>5} {"m/s":>5} '
            f'{"longer by":>9} {"turned rad/m":>12}'
        )
    ]
    figures = {}
    for name in trips.MAPS:
        for planner in trips.PLANNERS:
            of = [result for result in results if (result['map'], result['planner']) == (name, planner)]
            there = [result for result in of if result['reached']] or of
            row = {
                'cases': len(of),
                'reached': sum(result['reached'] for result in of),
                'contacts': sum(result['contacts'] for result in of),
                'worst_position_m': max(result['position_error'] for result in there),
                'worst_yaw_deg': max(abs(math.degrees(result['yaw_error'])) for result in there),
                'mean_speed': float(np.mean([result['driven'] / max(result['seconds'], 1.0) for result in there])),
                'longer_than_planned': float(np.mean([result['driven'] / result['way'] for result in there])) - 1.0,
                'turned_per_m': float(np.mean([result['turned'] / result['way'] for result in there])),
            }
            figures[f'{name}_{planner}'] = row
            lines.append(
                '{:8} {:22} {reached:4}/{cases:<2} {contacts:8} {worst_position_m:11.3f} {worst_yaw_deg:5.1f} '
                '{mean_speed:5.2f} {longer_than_planned:9.1%} '
                '{turned_per_m:12.2f}'.format(name, planner, **row)
            )
    return lines, figures


def calm(_seeds, _folder):
    """The default planners beside the classic ones on the same drives: squares each way, and the journeys. True pose;
    range layers and distance zones off for all, as the classic ones need it.
    """

    def around(planner, direction, seed):
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

    def journey(planner, name, number):
        outcome = trips.drive(name, PLANNERS[planner], number)
        return {
            'planner': planner,
            'map': name,
            'number': number,
            'reached': outcome.reached,
            'judgement': outcome.to_json()['judgement'],
            'faults': [f'{outcome.contacts} contacts'] if outcome.contacts else [],
        }

    return Part(
        {
            **{
                f'calm_{direction}_{planner}_{seed}': lambda planner=planner, direction=direction, seed=seed: around(
                    planner, direction, seed
                )
                for planner in PLANNERS
                for direction in MISSIONS
                for seed in range(CALM_SEEDS)
            },
            **{
                f'calm_{name}_{planner}_{number}': lambda planner=planner, name=name, number=number: journey(
                    planner, name, number
                )
                for planner in PLANNERS
                for name in trips.MAPS
                for number in range(trips.PAIRS)
            },
        },
        _calm_summary,
        _calm_verdict,
    )


PLANNERS = {
    planner: replace(trips.PLANNERS[planner], sonars=False)
    for planner in ('default', 'TrajectoryPlannerROS', 'DWAPlannerROS')
}
"""Whom `calm` compares."""


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
            'jerk_tangential_rms': _mean([found['jerk_tangential_rms'] for found in of]),
            'jerk_normal_rms': _mean([found['jerk_normal_rms'] for found in of]),
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
