"""Which way a robot looks along a plan: the orientation modes of global_planner/GlobalPlanner."""

import math

import numpy as np

from sara_common.planar import wrap
from sara_common.repeatable import directions

NONE, FORWARD, INTERPOLATE, FORWARD_THEN_INTERPOLATE, BACKWARD, LEFTWARD, RIGHTWARD = range(7)
TURNED = {
    FORWARD: 0.0,
    FORWARD_THEN_INTERPOLATE: 0.0,
    BACKWARD: math.pi,
    LEFTWARD: -0.5 * math.pi,
    RIGHTWARD: 0.5 * math.pi,
}
STRAIGHT = 0.35
"""Headings that differ by less (rad) belong to one straight."""


def headings(points: np.ndarray, window: int) -> np.ndarray:
    """Return the direction (rad) at each point (n, 2): from the one ``window`` before it to the one as far after it."""
    n = len(points)
    before = np.maximum(np.arange(n) - window, 0)
    after = np.minimum(np.arange(n) + window, n - 1)
    return directions(points[after] - points[before])


def blend(start: float, end: float, count: int) -> np.ndarray:
    """Return ``count`` yaws (rad) that turn evenly, the short way, from start to end."""
    return wrap(start + wrap(end - start) * np.arange(count) / max(count - 1, 1))


def orient(points: np.ndarray, start_yaw: float, goal_yaw: float, mode: int = FORWARD, window: int = 1) -> np.ndarray:
    """Return the plan (n, 3) of points (n, 2): yaws as ``mode`` has them, the last one always the goal's.

    None: 0 (the peer's identity orientation). Forward, Backward, Leftward, Rightward: the robot's x, -x, y or -y axis
    points along the path. Interpolate: an even turn from start to goal. ForwardThenInterpolate: forward up to the
    last straight, on it an even turn to the goal's yaw.
    """
    points = np.asarray(points, float)
    n = len(points)
    yaw = np.zeros(n)
    if mode in TURNED:
        yaw = wrap(headings(points, window) + TURNED[mode])
    if mode == INTERPOLATE:
        yaw = blend(start_yaw, goal_yaw, n)
    elif mode == FORWARD_THEN_INTERPOLATE:
        last = max(n - 2, 0)  # the last heading before the goal's own yaw
        first = last
        while first > 0 and abs(wrap(yaw[first - 1] - yaw[last])) <= STRAIGHT:
            first -= 1
        yaw[first:] = blend(start_yaw if first == 0 else yaw[first], goal_yaw, n - first)
    yaw[-1] = goal_yaw
    return np.column_stack([points, yaw])
