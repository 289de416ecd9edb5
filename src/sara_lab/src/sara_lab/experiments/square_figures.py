"""E9: its figures: the thesis's 4.24 to 4.39, and ours."""

from sara_lab.experiments import drive_figures, sensor_figures
from sara_lab.experiments.core import Figure, Results
from sara_lab.experiments.courses import DEFAULT, LONG, MIDDLE, OURS, SHORT, VX, XY, XY_VX
from sara_lab.experiments.square import SECOND, SQUARE, START, STEERED
from sara_lab.experiments.square_findings import Spreads


def figures(results: Results, of: Spreads) -> tuple[Figure, ...]:
    """All of them."""
    return (*_of_the_thesis(results), *_ours(results, of))


def _of_the_thesis(results):
    return [
        *_drawn(
            results,
            {'path': 24, 'rates': 25, 'angles': 26},
            ('square', 'changed', STEERED),
            'vx fused, steered by the wheels',
        ),
        *_drawn(results, {'path': 27, 'rates': 28, 'angles': 29}, ('square', SHORT, XY), 'x, y fused'),
        *_drawn(
            results, {'path': 30, 'rates': 31, 'angles': 32}, ('square', SHORT, XY_VX), 'x, y, vx fused, sim_time 1.0 s'
        ),
        *_drawn(results, {'path': 33, 'angles': 34}, ('square', MIDDLE, XY_VX), 'x, y, vx fused, sim_time 1.5 s'),
        *_drawn(
            results,
            {'path': 35, 'angles': 36},
            ('as printed', MIDDLE, XY_VX),
            'second course as printed, x, y, vx, sim_time 1.5 s',
            SECOND['as printed'],
        ),
        *_drawn(
            results, {'path': 37, 'rates': 38, 'angles': 39}, ('square', LONG, XY_VX), 'x, y, vx fused, sim_time 2.5 s'
        ),
    ]


def _drawn(results, numbers, key, what, course=SQUARE):
    """The figures of one set-up's drive by chair 0: {kind: number}."""
    trace = results['E9', *key, 0]['trace']
    kinds = {
        'path': (
            f'{what}: path.',
            lambda path: drive_figures.path(path, {what: trace}, course.goals, course.start),
        ),
        'rates': (
            'Turn rates.',
            lambda path: drive_figures.rates(path, trace),
        ),
        'angles': (
            'Yaw, x, y.',
            lambda path: drive_figures.angles(path, trace),
        ),
    }
    return [Figure(sensor_figures.name(number), *kinds[kind]) for kind, number in numbers.items()]


def _ours(results, of):
    def trace(*key):
        return results['E9', *key, 0]['trace']

    return [
        Figure(
            'e9_second',
            "Second course with (0, -3): x, y, vx, sim_time 1.5 s, and SARA's own.",
            lambda path: drive_figures.path(
                path,
                {"thesis's": trace('with (0, -3)', MIDDLE, XY_VX), "SARA's own": trace('with (0, -3)', OURS, DEFAULT)},
                SECOND['with (0, -3)'].goals,
                (0.0, 0.0),
            ),
        ),
        Figure(
            'e9_paths',
            "The square with the thesis's planner and vx alone, and with SARA's own planner and fusion.",
            lambda path: drive_figures.path(
                path,
                {"thesis's planner, vx": trace('square', LONG, VX), "SARA's own": trace('square', OURS, DEFAULT)},
                SQUARE.goals,
                START,
            ),
        ),
        Figure(
            'e9_corners',
            'How far off the corners the chair truly ends, mean of a drive; boxes hold half the chairs, whiskers 5 to '
            '95 %.',
            lambda path: drive_figures.boxes(
                path,
                {
                    planner.replace(', ', ',\n'): {name: of['values'] for name, of in group.items()}
                    for planner, group in of.square.items()
                },
                'corner off (m)',
            ),
        ),
    ]
