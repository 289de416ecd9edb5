"""E8 and E9: courses, set-ups and cases of the thesis's square by wheel odometry alone, then with its fusions, two
sim_times and a second course (4.3.2, 4.3.3, figures 4.21 to 4.39).
"""

from sara_lab.experiments.core import Case
from sara_lab.experiments.courses import (
    DEFAULT,
    GEOMETRY,
    LONG,
    MIDDLE,
    OURS,
    RADII,
    SHORT,
    TRUTH,
    VX,
    WHEELS,
    XY,
    XY_VX,
    Course,
    SetUp,
)
from sara_lab.experiments.drives import course_driven

START = (1.0, 1.0, 0.0)
SQUARE = Course(
    START, ((5.0, 1.0, 90.0), (5.0, 5.0, 180.0), (1.0, 5.0, 270.0), (1.0, 1.0, 0.0)), (10.0, 0.0, 0.0), timeout_s=45.0
)
SECOND = {
    'as printed': ((3.0, 0.0, 270.0), (3.0, -3.0, 180.0), (1.0, -3.0, 90.0), (0.0, 0.0, 0.0)),
    'with (0, -3)': ((3.0, 0.0, 270.0), (3.0, -3.0, 180.0), (0.0, -3.0, 90.0), (0.0, 0.0, 0.0)),
}
SECOND = {name: Course((0.0, 0.0, 0.0), goals, (13.0, 5.0, 0.0), timeout_s=45.0) for name, goals in SECOND.items()}

ODOMETRY = {
    'thesis': SetUp(LONG, WHEELS),
    'ours': SetUp(OURS, WHEELS),
    'ours, radii known': SetUp(OURS, WHEELS, calibrated=RADII),
    'ours, calibrated': SetUp(OURS, WHEELS, calibrated=GEOMETRY),
}
FUSIONS = {
    SHORT: (VX, XY, XY_VX),
    MIDDLE: (XY_VX,),
    LONG: (VX, XY, XY_VX, TRUTH),
    OURS: (VX, XY, XY_VX, DEFAULT, TRUTH),
}
STEERED, STEPS = 'vx, steered by the wheels', 'steps of x, y'
CHANGED = {STEERED: SetUp(LONG, VX, steer_by_wheels=True), STEPS: SetUp(LONG, XY, file='thesis_xy_differential')}
ON_SECOND = {MIDDLE: SetUp(MIDDLE, XY_VX), LONG: SetUp(LONG, XY_VX), OURS: SetUp(OURS, DEFAULT, own_gain=True)}


def cases_8(seeds: int) -> list[Case]:
    """E8's."""
    return [
        Case(('E8', name, seed), course_driven, seed, {'course': SQUARE, 'setup': setup, 'trace': seed == 0})
        for seed in range(seeds)
        for name, setup in ODOMETRY.items()
    ]


def setups_9() -> dict[tuple[str, str, str], tuple[Course, SetUp]]:
    """{(course, planner, fusion): (Course, SetUp)} of E9."""
    found = {
        ('square', planner, fusion): (SQUARE, SetUp(planner, fusion, own_gain=planner == OURS))
        for planner, fusions in FUSIONS.items()
        for fusion in fusions
    }
    found.update({('square', 'changed', name): (SQUARE, setup) for name, setup in CHANGED.items()})
    found.update(
        {
            (name, planner, setup.fusion): (course, setup)
            for name, course in SECOND.items()
            for planner, setup in ON_SECOND.items()
        }
    )
    return found


def cases_9(seeds: int) -> list[Case]:
    """E9's."""
    return [
        Case(
            ('E9', *key, seed),
            course_driven,
            seed,
            {'course': course, 'setup': setup, 'trace': seed == 0},
            gain=setup.own_gain,
        )
        for seed in range(seeds)
        for key, (course, setup) in setups_9().items()
    ]
