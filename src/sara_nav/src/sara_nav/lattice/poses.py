"""Moves of a body as poses: those that it begins with, and the plan's rows along them."""

import math
from collections.abc import Iterable

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.lattice import body, transitions
from sara_nav.lattice.moves import TURNS, kind_of
from sara_nav.lattice.world import World
from sara_nav.pursuit.plan_stages import SAME_PLACE

TURN_ROWS = 0.1
"""rad between the rows of a turn in place."""
BENDING_SHARE = 0.5
"""Share of the spacing of rows that those of gentle bends have: from each to the next the robot rolls by an arc."""


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


def as_plan(world: World, steps: np.ndarray, ends: tuple[Pose2D, Pose2D], spacing: float, law: tuple) -> np.ndarray:
    """Return the plan (n, 3), x, y, yaw (m, rad), along moves (m, 5) from the first to the second of ``ends``, at most
    ``spacing`` (m) apart. law: of transitions.with_transitions, for its drives.
    """
    start, goal = ends
    rows, first = [np.array([[start.x, start.y, start.yaw]])], 0
    while first < len(steps):
        kind, last = kind_of(steps[first, 3]), first + 1
        while last < len(steps) and kind_of(steps[last, 3]) == kind:
            last += 1
        plain = [_rows(step, spacing) for step in steps[first:last].tolist()]
        rows += plain if kind == TURNS else [drive(world, steps[first:last], plain, spacing, law)]
        first = last
    plan = np.vstack(rows)
    if len(plan) == 1:
        plan = np.repeat(plan, 2, axis=0)
    plan[:, 2] = wrap(plan[:, 2])
    plan[0], plan[-1] = (start.x, start.y, start.yaw), (goal.x, goal.y, goal.yaw)
    return plan


def drive(world: World, steps: np.ndarray, plain: list[np.ndarray], spacing: float, law: tuple) -> np.ndarray:
    """Return ``plain``, poses (k, 3) along each of moves (m, 5), all ahead or all astern, in one, with others in place
    of those where bends begin and end gently. spacing, law: of as_plan.
    """
    rows = np.vstack(plain)
    if law[0] <= 0.0 or not steps[:, 4].any():
        return rows
    moves, sense = np.ascontiguousarray(steps[:, 3:]), math.copysign(1.0, steps[0, 3])
    poses, step = transitions.sampled(steps[0, :3].copy(), moves, spacing * BENDING_SHARE)
    poses, changed = transitions.with_transitions(world, poses, sense, step, law)
    changed[0] = False  # where it begins is a row already
    way = np.concatenate([np.full(len(part), abs(length) / len(part)) for part, length in zip(plain, moves[:, 0])])
    way = way.cumsum()
    before, nearest = np.minimum((way / step).astype(int), len(poses) - 2), np.rint(way / step).astype(int)
    stay = ~(changed[before] & changed[before + 1])
    # Rows at one place would be a turn: of one that stays and a pose beside those that were moved, the row is kept.
    changed[nearest[stay & (np.abs(way - nearest * step) < SAME_PLACE)]] = False
    order = np.argsort(np.concatenate([way[stay], np.flatnonzero(changed) * step]), kind='stable')
    return np.vstack([rows[stay], poses[changed]])[order]


def _rows(step, spacing):
    """Return the poses (n, 3) along one move (5,), but the first."""
    x, y, yaw, length, turn = step
    n = max(1, math.ceil(abs(length) / spacing - 1e-9), math.ceil(abs(turn) / TURN_ROWS - 1e-9))
    return np.array([body.place(Pose2D(x, y, yaw), length, turn, k / n) for k in range(1, n + 1)])
