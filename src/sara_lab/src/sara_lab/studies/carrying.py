"""A robot that somebody lifts and carries, and what its odometry makes of that.

Wheels alone stand still meanwhile. Where the odometry takes its heading from a gyro, as SARA's filter does, it turns as
the robot is turned, and only the place is lost.
"""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_sim.robot.recording import Moment
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import STEP_S
from sara_sim.world.world import WorldError

Pose = tuple[float, float, float]
WALKS = 1.0  # m/s: whoever carries the robot
GYRO_SCALE, GYRO_BIAS, GYRO_NOISE = 0.005, math.radians(0.01), math.radians(0.03)
"""Of the chair's calibrated gyro in sara_sim: the share of a turn by which it is at most wrong; standard deviations of
its offset, rad/s, and of a heading in rad per square root of a second.
"""


class Carrier:
    """Carries a robot along points (n, 2; m, map) at WALKS, level and at the height of its wheels, and turns it evenly
    by `turn` (rad); waits while somebody is in the way. `done`: whether it stands at the end.
    """

    def __init__(self, robot: SimulatedRobot, points: np.ndarray, turn: float) -> None:
        self._robot, self._points, self._yaw, self._turn = robot, points, robot.pose[2], turn
        self._ways = np.concatenate(((0.0,), np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
        self._way = 0.0

    @property
    def done(self) -> bool:
        return self._way >= self._ways[-1]

    def command(self, _t: float, _pose: Pose) -> tuple[float, float]:
        """Carry it on for STEP_S; the wheels are to stand still: (0, 0)."""
        way = min(self._way + WALKS * STEP_S, float(self._ways[-1]))
        x, y = (float(np.interp(way, self._ways, column)) for column in self._points.T)
        with suppress(WorldError):
            self._robot.place(x, y, float(wrap(self._yaw + self._turn * way / self._ways[-1])))
            self._way = way
        return 0.0, 0.0


class GyroOdometry:
    """Odometry of the ways that the wheels measure along the heading that a gyro does. `pose`: x, y, yaw in odom."""

    def __init__(self, start: Pose, random: np.random.Generator) -> None:
        self._random, self._truth, self._wheels, self._t = random, start, (0.0, 0.0, 0.0), 0.0
        self._scale = 1.0 + GYRO_SCALE * float(random.uniform(-1.0, 1.0))
        self._bias = GYRO_BIAS * float(random.standard_normal())
        self.pose = (0.0, 0.0, 0.0)

    def add(self, moment: Moment) -> Pose:
        """The next moment of a drive; returns the pose."""
        dt = moment.t - self._t
        along, across, _ = compose(inverse(self._wheels), moment.odometry)
        turn = self._scale * float(wrap(moment.truth[2] - self._truth[2])) + self._bias * dt
        turn += GYRO_NOISE * math.sqrt(dt) * float(self._random.standard_normal())
        half = compose(self.pose, (0.0, 0.0, 0.5 * turn))
        self.pose = compose(half, (math.copysign(math.hypot(along, across), along), 0.0, 0.5 * turn))
        self._t, self._truth, self._wheels = moment.t, moment.truth, moment.odometry
        return self.pose
