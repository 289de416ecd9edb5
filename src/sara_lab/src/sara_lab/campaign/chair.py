"""Parts of the campaign that judge the chair, its sensors and what stops it: square, hazards, obstacle, odometry,
sensors.
"""

import math
from pathlib import Path

import numpy as np

from sara_bringup.missions.mission import load_mission
from sara_bringup.missions.report import verdict
from sara_bringup.paths import config_file
from sara_lab.campaign import hazards, odometry_trial
from sara_lab.campaign.part import Part, lines_of, spread
from sara_lab.experiments import sensor_report
from sara_lab.experiments.gains import gain_of
from sara_lab.experiments.missions import EXPERIMENTS, run


def square(seeds: int, folder: Path) -> Part:
    """The thesis's square, on chairs whose gyro's gain has been found by full turns, as E6 does."""
    goals = len(load_mission(config_file(EXPERIMENTS['square'])).goals)

    def case(seed):
        gain = gain_of(seed, folder)
        drive, _ = run('square', seed, gain=gain)
        return {**drive.to_json(), 'gain': gain, 'faults': verdict(drive, goals)}

    return Part({f'square_{seed}': lambda seed=seed: case(seed) for seed in range(seeds)}, _square_summary)


def _square_summary(results):
    corners = [corner for result in results for corner in result['corners']]
    position = [math.dist(corner['true'][:2], corner['asked'][:2]) for corner in corners]
    yaw = [abs(math.remainder(corner['true'][2] - corner['asked'][2], 360.0)) for corner in corners]
    fused, wheels = [
        [math.dist(result['corners'][-1][source][:2], result['corners'][-1]['true'][:2]) for result in results]
        for source in ('estimated', 'odometry')
    ]
    figures = {
        'corner_position_m': spread(position),
        'corner_yaw_deg': spread(yaw),
        'fused_yaw_deg': spread([result['yaw_error_max_deg'] for result in results]),
        'odometry_heading_error': spread([result['odometry_heading_error'] for result in results]),
        'final_fused_position_error_m': spread(fused),
        'final_odometry_position_error_m': spread(wheels),
        'fused_times_better_median': float(np.median(wheels) / np.median(fused)),
        'contacts': sum(result['contacts'] for result in results),
    }
    return lines_of(figures), figures


def hazard_times(seeds: int, _folder: Path) -> Part:
    """Every hazard, on the way to a goal and at 0.8 m/s."""

    def case(name, seed, cruise):
        outcome = hazards.happen(name, seed, cruise)
        return {**vars(outcome), 'allowed': outcome.allowed, 'faults': outcome.faults}

    return Part(
        {
            f'hazard_{name}{"_cruise" * cruise}_{seed}': lambda name=name, seed=seed, cruise=cruise: case(
                name, seed, cruise
            )
            for name in hazards.HAZARDS
            for cruise in (False, True)
            for seed in range(seeds)
        },
        _hazard_summary,
    )


def _hazard_summary(results):
    lines = [f'{"hazard":24} {"cases":>5} {"worst s":>8} {"of allowed":>11} {"worst way m":>12} {"moved after m":>14}']
    figures = {}
    for name in hazards.HAZARDS:
        of = [result for result in results if result['hazard'] == name]
        worst = max(of, key=lambda result: result['stopped_after'] / result['allowed'])
        figures[name] = {
            'cases': len(of),
            'worst_s': max(result['stopped_after'] for result in of),
            'worst_share_of_allowed': worst['stopped_after'] / worst['allowed'],
            'worst_way_m': max(result['way'] for result in of),
            'moved_after_m': max(result['drifted'] for result in of),
        }
        lines.append(
            (
                '{:24} {cases:5} {worst_s:8.2f} {worst_share_of_allowed:10.0%} {worst_way_m:13.2f} '
                '{moved_after_m:14.3f}'
            ).format(name, **figures[name])
        )
    return lines, figures


def obstacle(seeds: int, _folder: Path) -> Part:
    """What the map does not know appears 1.5 m ahead at 0.8 m/s."""

    def case(seed):
        speed, stopped, gap, contacts = hazards.obstacle_ahead(seed)
        faults = ([f'{contacts} contacts'] if contacts else []) + (
            [] if stopped < hazards.WATCHED_S else ['did not stop']
        )
        return {'seed': seed, 'speed': speed, 'stopped_after': stopped, 'gap': gap, 'faults': faults}

    return Part({f'obstacle_{seed}': lambda seed=seed: case(seed) for seed in range(seeds)}, _obstacle_summary)


def _obstacle_summary(results):
    figures = {
        'gap_m': spread([result['gap'] for result in results]),
        'smallest_gap_m': min(result['gap'] for result in results),
        'stopped_after_s': spread([result['stopped_after'] for result in results]),
    }
    return lines_of(figures), figures


def odometry(seeds: int, _folder: Path) -> Part:
    """calibrate_odometry on chairs with a wrong track and unequal wheels."""
    return Part(
        {f'odometry_{seed}': lambda seed=seed: odometry_trial.trial(seed) for seed in range(seeds)}, _odometry_summary
    )


def _odometry_summary(results):
    before, after = [[max(result[key]) for result in results] for key in ('before', 'after')]
    figures = {
        **{
            f'{name}_error_percent': spread([100 * abs(result[name]) for result in results])
            for name in ('separation', 'left', 'right')
        },
        'return_error_before_m': spread(before),
        'return_error_after_m': spread(after),
        'times_better_median': float(np.median(before) / np.median(after)),
    }
    return lines_of(figures), figures


def sensors(seeds: int, _folder: Path) -> Part:
    """E1, E2, E3 and E6, chair by chair; what is judged over all chairs, `experiment sensors` judges."""

    def case(seed):
        chairs = sensor_report.run([seed])
        return {**sensor_report.to_json(chairs)[0], 'faults': sensor_report.chair_faults(chairs[0])}

    return Part({f'sensors_{seed}': lambda seed=seed: case(seed) for seed in range(seeds)}, _sensors_summary)


def _sensors_summary(results):
    after = [
        max(abs(mean - ideal) for mean, ideal in zip(result['accel_after']['mean'], (0.0, 0.0, sensor_report.GRAVITY)))
        for result in results
    ]
    figures = {
        'accelerometer_after_m_s2': spread(after),
        'gyro_after_node_deg_s': spread([max(map(abs, result['gyro_after']['mean'])) for result in results]),
        'left_on_pc_deg_s_mean': float(
            np.mean([abs(rate) for result in results for rate in result['yaw_rate_error_pc']])
        ),
        'full_turn_after_gain_deg': spread(
            [abs(measured - true) for result in results for true, measured in result['check']]
        ),
    }
    return lines_of(figures), figures
