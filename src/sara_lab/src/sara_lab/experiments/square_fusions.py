"""E9: the thesis's square with sensor fusion: what is reported of it (4.3.3, figures 4.24 to 4.39)."""

import numpy as np

from sara_lab.experiments.agreement import of_drive
from sara_lab.experiments.core import Experiment, Report, Results, mean, results_of, spread, table
from sara_lab.experiments.courses import DEFAULT, LONG, OURS, VX, XY, XY_VX
from sara_lab.experiments.ranking import ranking
from sara_lab.experiments.square import FUSIONS, STEERED, cases_9
from sara_lab.experiments.square_figures import figures
from sara_lab.experiments.square_findings import COMPARED, Spreads, findings

SETTING = """
The square of E8 and the thesis's second course, with the wheel inputs that the thesis fuses with the IMU's yaw and turn
rate: vx; x and y; x, y and vx (`ekf_thesis_vx.yaml`, `ekf_thesis_xy.yaml`, `ekf_thesis.yaml`; thesis 4.3.3). It raises
its planner's `sim_time` twice and gives no values: here 1.0, 1.5 and 2.5 s. "Ours" is SARA's planner; `default` is its
fusion with the chair's own k, `true pose` is fake_localization. Corners are judged by the true pose; the thesis had
only the filter's estimate ("as seen").
"""

HEAD = (
    'planner: fusion',
    'corner off, true, m',
    'as seen, m',
    'off the legs as seen, p95, m',
    'turned the long way',
    'last leg: turned too far, deg',
    'time, s',
)


def _short(planner):
    return planner.replace('thesis, sim_time ', '')


def _line(name, of):
    return (
        name,
        mean(of['corner_m'], 2),
        mean(of['seen_m'], 2),
        mean(of['straight_m'], 3),
        f'{of["long_way"]:.0%}',
        mean(of['last_leg'], 0),
        mean(of['seconds'], 0),
    )


def fusions(results: Results) -> Report:
    """E9's Report."""
    of = Spreads.of(results)
    square = of.square
    faults = (
        [f'ours, {DEFAULT}: {100 * (1 - square[OURS][DEFAULT]["reached"]):.0f} % of the corners were not reached']
        if square[OURS][DEFAULT]['reached'] < 1.0
        else []
    )
    data = {'set_ups': {' / '.join(key): dict(one.items()) for key, one in of.found.items()}}
    return Report(
        findings(of),
        (),
        figures(results, of),
        (('The square by all set-ups', _all(of)), *_explained(results, of)),
        data,
        tuple(faults),
        f"True corners off, thesis's planner (2.5 s): vx {square[LONG][VX]['corner_m']['mean']:.2f} m, x, y, vx "
        f'{square[LONG][XY_VX]["corner_m"]["mean"]:.2f} m, x, y {square[LONG][XY]["corner_m"]["mean"]:.1f} m; ours '
        f'{square[OURS][DEFAULT]["corner_m"]["mean"]:.3f} m. '
        'vx loses the square only where the wheels steer.',
    )


def _all(of):
    """The table of all set-ups on the square, and how they rank."""
    lines = [
        _line(f'{_short(planner)}: {fusion}', of.square[planner][fusion])
        for planner in FUSIONS
        for fusion in FUSIONS[planner]
    ]
    ranks = '; '.join(
        f'{_short(planner)}: {ranking({name: one["values"] for name, one in of.square[planner].items()})}'
        for planner in COMPARED
    )
    return f'{table(HEAD, lines)}\n\nBy the true corners (`<`: better beyond chance, `~`: perhaps not): {ranks}.'


def _explained(results, of):
    drives = results_of(results, 'E9', 'square', 'changed', STEERED)
    right = spread([end for drive in drives for end in drive['fused_end_error']])
    wheels = spread([np.mean(drive['wheels']['position']) for drive in drives])
    return [
        (
            'One thing changed: who steers',
            "vx is fused, but navigation follows the wheels' odometry. By it the chair reaches every corner "
            f'({mean(wheels, 2, "m")} off); in truth it is {mean(of.steered["corner_m"], 1, "m")} off. '
            f"The filter's path, which looks lost, is within {mean(right, 2, 'm')} of the true one. This is figure "
            '4.24, whose red path the thesis calls "the one the system really drove".',
        ),
        (
            'One thing changed: steps instead of positions',
            "With `odom0_differential: true` the filter fuses the wheels' steps in x, y instead of positions that it "
            f'transformed itself. Corners are {mean(of.steps["corner_m"], 2, "m")} off instead of '
            f'{mean(of.square[LONG][XY]["corner_m"], 1, "m")}, and {of.steps["long_way"]:.0%} instead of '
            f'{of.square[LONG][XY]["long_way"]:.0%} of the drives turn the long way.',
        ),
    ]


EXPERIMENT = Experiment(
    'E9', 'the square with sensor fusion', SETTING, 6, cases_9, fusions, lambda key: DEFAULT in key, of_drive
)
