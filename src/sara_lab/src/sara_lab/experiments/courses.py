"""What the thesis drives: a Course of poses, and the SetUp that it is driven with.

A set-up is a planner (the thesis's with a shorter or a longer sim_time, or SARA's own), a localization (wheels alone,
one of the thesis's fusions, SARA's own, the truth) and what read.py gives. Everything else is the chair and the stack
as they are.
"""

import math
from dataclasses import dataclass

import numpy as np

from sara_common.files import merged
from sara_common.planar import compose
from sara_common.platforms import parameters
from sara_sim.chair import SimulatedChair

Pose = tuple[float, float, float]
SETTLE_S = 1.0
SHORT, MIDDLE, LONG, OURS = 'thesis, sim_time 1.0 s', 'thesis, sim_time 1.5 s', 'thesis, sim_time 2.5 s', 'ours'
SIM_TIMES = {SHORT: 1.0, MIDDLE: 1.5, LONG: 2.5}
WHEELS, TRUTH, DEFAULT = 'wheels alone', 'true pose', 'default'
VX, XY, XY_VX = 'vx', 'x, y', 'x, y, vx'
FILTER, BOTH = 'filter', 'filter and read.py'
RADII, GEOMETRY = 'radii', 'radii and separation'
FILES = {VX: 'thesis_vx', XY: 'thesis_xy', XY_VX: 'thesis', DEFAULT: 'default'}  # sara_localization's config/ekf_*.yaml


COMPARED = {
    'max_vel_x': 0.5,
    'max_vel_theta': 0.5,
    'acc_lim_x': 0.3,
    'comfort_dec_x': 0.25,
    'jerk_lim_x': 0.6,
    'acc_lim_theta': 0.5,
    'comfort_dec_theta': 0.4,
    'jerk_lim_theta': 2.0,
    'max_lateral_acc': 0.2,
}
"""Limits of RotateThenPursue that are laid over sara_nav.yaml: as slow as the thesis's planner, with which it is
compared.
"""


def navigation(planner: str, turn_rate: float = 0.0) -> dict:
    """What is laid over sara_nav.yaml; `turn_rate`: rad/s, the fastest turn in place, 0: the planner's own."""
    if planner == OURS:
        return {'RotateThenPursue': {**COMPARED, **({'max_vel_theta': turn_rate} if turn_rate else {})}}
    tree = parameters('sara_bringup', 'thesis_planner.yaml')
    own = {
        'sim_time': SIM_TIMES[planner],
        **({'max_vel_theta': turn_rate, 'min_vel_theta': -turn_rate} if turn_rate else {}),
    }
    return merged(tree, {'TrajectoryPlannerROS': own})


@dataclass(frozen=True)
class SetUp:
    """`planner`, `fusion`: as above. `own_gain`: the gyro's gain is the chair's own, as E6 finds it; else read.py's
    1.08. `raw_rate`: the rate that the filter fuses beside the yaw is the chip's, without offset and gain, as the
    thesis's listing has it. `steer_by_wheels`: the filter runs, but navigation drives by the wheels' odometry. `file`:
    another ekf_*.yaml than the fusion's.
    `posed`: "" where the chair knows from the start where it stands; else filter and IMU start at zero, and RViz's "2D
    Pose Estimate" tells the filter alone ("filter"), or read.py's yaw too ("filter and read.py"). `turn_rate`: rad/s,
    the fastest turn in place; 0: the planner's own. `calibrated`: what of the wheels' geometry the odometry has as this
    chair has it: "", RADII or GEOMETRY.
    """

    planner: str
    fusion: str
    own_gain: bool = False
    raw_rate: bool = False
    steer_by_wheels: bool = False
    file: str = ''
    posed: str = ''
    turn_rate: float = 0.0
    calibrated: str = ''

    @property
    def localization(self) -> str:
        """ekf's parameter file."""
        return self.file or FILES.get(self.fusion, 'default')


@dataclass(frozen=True)
class Course:
    """Poses as the thesis has them, m and deg; driven on `map` with its origin at `at` (m, deg there). `timeout_s` for
    one goal, `pause_s` after it.
    """

    start: Pose
    goals: tuple[Pose, ...]
    at: Pose = (0.0, 0.0, 0.0)
    map: str = 'hall'
    timeout_s: float = 60.0
    pause_s: float = SETTLE_S

    def placed(self, pose: Pose) -> Pose:
        """A pose of the course on the map: m, rad."""
        return compose((self.at[0], self.at[1], math.radians(self.at[2])), (pose[0], pose[1], math.radians(pose[2])))

    def back(self, poses: np.ndarray) -> np.ndarray:
        """(n, 3) poses on the map in the course's own frame."""
        angle = math.radians(self.at[2])
        c, s = math.cos(angle), math.sin(angle)
        x, y = poses[:, 0] - self.at[0], poses[:, 1] - self.at[1]
        return np.column_stack([c * x + s * y, c * y - s * x, poses[:, 2] - angle])


def multipliers(setup: SetUp, chair: SimulatedChair) -> tuple[float, float, float]:
    """Those of wheel_separation, the left and the right wheel's radius, that a `calibrated` SetUp gives the odometry of
    a SimulatedChair; of RADII alone the first is 1.
    """
    drawn, nominal = chair.chair, chair.config.wheel_radius
    return (
        1.0 / drawn.slip if setup.calibrated == GEOMETRY else 1.0,
        drawn.left_radius / nominal,
        drawn.right_radius / nominal,
    )
