"""Turning in place: the way round, whether there is room for it, and a rate that starts and ends gently on the heading.

The short way is taken, unless the plan turns the other way there, or the short way is not free and the other one is.
The rate is planned as a speed along a leg is (smooth_speed), so that it is zero when the heading is reached.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D, wrap
from sara_nav.grids.collision import LocalWorld
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_speed import Caps, Motion, SpeedLimits, next_speed

SLOWEST = 0.02
"""The slowest rate (rad/s) of the end of a turn, which would else be neared for ever."""
REACHED = 0.004
"""A heading nearer than this (rad) is reached,"""
SHARE = 0.2
"""and one nearer than this share of ``enough``: what follows a turn takes up more, too."""


def planned_way(error: float, angle: float) -> float:
    """Return the turn (rad) onto a heading that is off by error (rad, wrapped) on the way round that is nearest to a
    planned angle (rad).
    """
    return error + 2.0 * math.pi * round((angle - error) / (2.0 * math.pi))


class SmoothTurn:
    """One turn in place by ``left`` (rad, with its sense), which is what is still to turn; ``acceleration`` (rad/s2) of
    the size of the rate.
    ``enough`` (rad): a turn that went too far by no more than this is over, for what follows takes it up.
    """

    def __init__(self, left: float, enough: float = 0.0):
        self.left, self.enough = left, enough
        self._reached = max(REACHED, SHARE * enough)
        self.acceleration = 0.0
        self._sense = math.copysign(1.0, left)

    def rate(
        self, error: float, last: float, turn_gain: float, highest: float, config: RotateThenPursueConfig, dt: float
    ) -> float:
        """Return the rate (rad/s) to command, 0.0 when the heading is reached.

        error: heading wanted less heading (rad). last: rate last commanded (rad/s). turn_gain: rate driven over
        commanded. highest: rad/s.
        """
        self.left += wrap(error - self.left)  # the same way round, whatever the wrap
        sense = math.copysign(1.0, last if last else self.left)
        left = sense * self.left / turn_gain
        if not last and (left < self._reached or -self.enough <= self._sense * self.left < 0.0):
            return 0.0
        limits = SpeedLimits(config.acc_lim_theta, config.comfort_dec_theta, config.jerk_lim_theta)
        now, end = Motion(abs(last), self.acceleration), Caps([left], [0.0])
        rate, self.acceleration, _ = next_speed(now, highest, end, limits, dt)
        if left <= self._reached and rate <= SLOWEST:
            rate = self.acceleration = 0.0
        elif left > self._reached and self.acceleration <= 0.0:
            rate = max(rate, min(SLOWEST, abs(last) + config.acc_lim_theta * dt))
        return sense * rate


def turn_poses(pose: Pose2D, angle: float) -> np.ndarray:
    """Return the poses (n, 3) of a turn in place by ``angle`` (rad, with its sense) from a Pose2D, with steps of 0.05
    rad at most.
    """
    return turned(float(pose.x), float(pose.y), float(pose.yaw), float(angle))


@kernel
def turned(x: float, y: float, yaw: float, angle: float) -> np.ndarray:
    """See turn_poses."""
    n = max(2, int(math.ceil(abs(angle) / 0.05)))
    poses = np.empty((n + 1, 3))
    for i in range(n + 1):
        poses[i, 0], poses[i, 1], poses[i, 2] = x, y, yaw + angle * i / n
    return poses


def free_angle(world: LocalWorld, pose: Pose2D, angle: float) -> float:
    """Return how much (rad, 0 or more) of a turn in place by ``angle`` from a Pose2D touches nothing new in a
    LocalWorld.
    """
    touched = world.touched(turn_poses(pose, angle))
    worse = np.flatnonzero(touched > touched[0])
    return abs(angle) if not len(worse) else abs(angle) * max(int(worse[0]) - 1, 0) / (len(touched) - 1)


def way_round(world: LocalWorld, pose: Pose2D, angle: float, planned: bool) -> tuple[float, float]:
    """Return (angle, free): by how much to turn, and how much of that is free (rad, 0 or more).

    angle: the short way (or, when ``planned``, the way the plan turns, which is kept to). The long way is chosen only
    where it is free and the short one is not.
    """
    free = free_angle(world, pose, angle)
    if free < abs(angle) and not planned and angle:
        other = angle - math.copysign(2.0 * math.pi, angle)
        if free_angle(world, pose, other) >= abs(other):
            return other, abs(other)
    return angle, free


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    turned(0.0, 0.0, 0.0, 1.0)
