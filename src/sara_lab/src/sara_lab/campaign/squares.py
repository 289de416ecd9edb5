"""The campaign's part `squares`: the thesis's square both ways, judged by limits that SARA's default planners are held
to.
"""

from pathlib import Path

import numpy as np

from sara_lab.campaign.comfort import calm_faults, calm_figures
from sara_lab.campaign.part import Part, lines_of, spread
from sara_lab.experiments.gains import gain_of
from sara_lab.journeys.squares import MISSIONS, POSES, square
from sara_lab.judge.drives import track_of
from sara_lab.judge.judge import cross_track

CORNERS = {'true': (0.04, 1.0), 'fused': (0.10, 2.0)}  # m, deg: p95 of the squares' corners
ACROSS = {'true': 0.03, 'fused': 0.05}  # m: p95 of cross-track on straight legs
BEYOND_DEG = 3.0  # any turn, beyond the shortest (true pose)
THINNED = 5  # one distance from the leg of so many is kept, at 50 Hz


def squares(seeds: int, folder: Path) -> Part:
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
        found += calm_faults(figures, f'{pose}_', with_final_turn=True)
    if not figures['true_turn_beyond_deg']['worst'] <= BEYOND_DEG:
        found.append(
            f'true pose: a turn went {figures["true_turn_beyond_deg"]["worst"]:.2f} deg beyond the shortest, '
            f'at most {BEYOND_DEG:g}'
        )
    return found
