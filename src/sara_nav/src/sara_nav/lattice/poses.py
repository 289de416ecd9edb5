"""Moves of a body as poses: those that it begins with, and the plan's rows along them."""

import math
from collections.abc import Iterable

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.lattice import body

TURN_ROWS = 0.1
"""rad between the rows of a turn in place."""


def along(pose: Pose2D, moves: Iterable) -> tuple[np.ndarray, np.ndarray]:
    """Return poses (n, 3) and moves (n - 1, 2): those moves (length m, turn rad) from a pose on."""
    poses = [pose]
    for length, turn in moves:
        poses.append(body.place(poses[-1], length, turn, 1.0))
    return np.array(poses), np.array(moves).reshape(-1, 2)


def pieces(length: float, most: float = 0.2) -> list[tuple[float, float]]:
    """Return straight moves (length m, 0 rad) no longer than ``most`` (m) that add up to one of ``length`` (m)."""
    if length == 0.0:
        return []
    n = math.ceil(abs(length) / most)
    return [(length / n, 0.0)] * n


def as_plan(steps: np.ndarray, start: Pose2D, goal: Pose2D, spacing: float) -> np.ndarray:
    """Return the plan (n, 3), x, y, yaw (m, rad), along moves (m, 5) from start to goal, ``spacing`` (m) apart."""
    rows = [np.array([[start.x, start.y, start.yaw]])]
    for x, y, yaw, length, turn in steps.tolist():
        n = max(1, math.ceil(abs(length) / spacing - 1e-9), math.ceil(abs(turn) / TURN_ROWS - 1e-9))
        begin = Pose2D(x, y, yaw)
        rows.append(np.array([body.place(begin, length, turn, k / n) for k in range(1, n + 1)]))
    plan = np.vstack(rows)
    if len(plan) == 1:
        plan = np.repeat(plan, 2, axis=0)
    plan[:, 2] = wrap(plan[:, 2])
    plan[0], plan[-1] = (start.x, start.y, start.yaw), (goal.x, goal.y, goal.yaw)
    return plan
