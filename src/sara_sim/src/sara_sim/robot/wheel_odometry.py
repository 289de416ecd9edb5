"""Wheel odometry that drifts: what a robot believes of the way that it drove.

A distance d and a turn r of a step are read as

    d' = (1 + e_d) d + N(0, n_dd^2 |d| + n_dr^2 |r|)
    r' = (1 + e_r) r + N(0, n_rd^2 |d| + n_rr^2 |r|)

with errors e drawn once for a robot and noise whose variance grows with the way, whatever the length of a step.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from sara_common.planar import advanced
from sara_sim.robot.robot_config import RobotConfig


class WheelOdometry:
    """`pose`: (x, y, yaw) in the frame odom, m, rad, from (0, 0, 0) on. `share`: (distance, turn) read of each true
    one, without the noise.
    """

    def __init__(self, config: RobotConfig, random: np.random.Generator) -> None:
        self._random, self._noise = random, config.odom_noise
        distance, turn = (float(random.uniform(-0.5, 0.5)) * error for error in config.odom_error)
        self.share = 1.0 + distance, 1.0 + turn
        self.pose = (0.0, 0.0, 0.0)

    def move(self, distance: float, turn: float) -> None:
        """The robot drove an arc of so many m and rad."""
        if not (distance or turn):
            return
        far, wide = abs(distance), abs(turn)
        dd, dr, rd, rr = self._noise
        first, second = self._random.standard_normal(2).tolist()
        distance = self.share[0] * distance + first * sqrt(dd * dd * far + dr * dr * wide)
        turn = self.share[1] * turn + second * sqrt(rd * rd * far + rr * rr * wide)
        self.pose = advanced(*self.pose, distance, turn, 1.0)
