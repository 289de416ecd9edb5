"""Whether simple motions are free: to turn, to drive straight to a point, to brake. Free: the footprint touches nothing
on the way that it does not touch already.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D, wrap
from sara_nav.grids.collision import LocalWorld


class Ways:
    """Motions in one LocalWorld; poses are in the global frame."""

    def __init__(self, world: LocalWorld) -> None:
        self.world = world

    def turn_is_free(self, pose: Pose2D, yaw: float) -> bool:
        """True when the robot can turn in place, the short way, from a Pose2D to ``yaw`` (rad)."""
        return not self.world.worsens(_turn(pose, yaw))

    def straight_is_free(self, pose: Pose2D, goal: Pose2D) -> bool:
        """True when the robot can turn in place towards a goal (Pose2D) and drive straight to it."""
        bearing = math.atan2(goal.y - pose.y, goal.x - pose.x)
        n = max(2, math.ceil(pose.distance(goal) / 0.03))
        there = np.arange(n + 1)[:, None] / n
        drive = np.column_stack([(1.0 - there) * (pose.x, pose.y) + there * (goal.x, goal.y), np.full(n + 1, bearing)])
        return not self.world.worsens(np.vstack([_turn(pose, bearing), drive]))

    def stop_is_free(self, pose: Pose2D, v: float, w: float, acc_v: float, acc_w: float) -> bool:
        """True when the robot, moving at v (m/s) and w (rad/s), can brake at these accelerations, and a margin."""
        way = abs(v) * 0.2 + v * v / (2.0 * acc_v) + 0.03
        angle = abs(w) * 0.2 + w * w / (2.0 * acc_w)
        duration = way / abs(v) if abs(v) > 0.01 else angle / max(abs(w), 0.01)
        steps = max(2, math.ceil(max(way, 0.6 * angle) / 0.03))
        return not self.world.worsens(arc(pose, v, w, duration, steps))


def arc(pose: Pose2D, v: float, w: float, duration: float, steps: int) -> np.ndarray:
    """Return the poses (steps + 1, 3) from a Pose2D on along v (m/s) and w (rad/s), evenly over ``duration`` (s); yaw
    not wrapped.
    """
    return _arc((float(pose.x), float(pose.y), float(pose.yaw)), float(v), float(w), float(duration), steps)


@kernel
def _arc(pose, v, w, duration, steps):
    """See ``arc``: the chord of each way from the start, half its turn off the heading."""
    x, y, yaw = pose
    poses = np.empty((steps + 1, 3))
    for k in range(steps + 1):
        time = k * (duration / steps)
        half = 0.5 * w * time
        chord = v * time * (math.sin(half) / half if half != 0.0 else 1.0)
        poses[k, 0], poses[k, 1], poses[k, 2] = (
            x + chord * math.cos(yaw + half),
            y + chord * math.sin(yaw + half),
            yaw + 2.0 * half,
        )
    return poses


def _turn(pose, yaw):
    """Return the poses (n, 3) of a turn in place, the short way, with steps of 0.05 rad at most."""
    turn = wrap(yaw - pose.yaw)
    n = max(2, math.ceil(abs(turn) / 0.05))
    return np.column_stack([np.full(n + 1, pose.x), np.full(n + 1, pose.y), pose.yaw + turn * np.arange(n + 1) / n])


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    _arc((0.0, 0.0, 0.0), 0.1, 0.0, 1.0, 2)
