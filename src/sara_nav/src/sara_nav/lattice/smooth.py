"""Corners of a path are moved where the path takes less time, left out where they are not needed, and rounded where
there is room (rounding.py).

Moving them is coordinate descent: each corner in turn tries eight places about it, in smaller and smaller steps. As
moves take longer the nearer the body comes to something, legs come to lie in the middle of doors and square to them.
Only corners between two straight legs are touched; arcs that the search needed stay, and so does what begins or ends
nearer to an obstacle than the margin.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.lattice.body import move, place, turn_to
from sara_nav.lattice.rounding import LEAST_TURN, rounded
from sara_nav.lattice.shortcuts import Shortcuts, with_shortcuts
from sara_nav.lattice.world import World, example_world

STEPS = (0.32, 0.16, 0.08, 0.04)
"""m, by which corners are moved."""
SWEEPS = 3
LEAST_LEG = 0.02
"""m."""


class Corner(NamedTuple):
    """What lies about a corner between two straight legs, which moving it leaves as it is."""

    ax: float
    """m; where the leg to the corner begins."""
    ay: float
    bx: float
    """m; where the leg from the corner ends."""
    by: float
    sense: float
    """1.0 where the leg to the corner is driven ahead, -1.0 astern."""
    next_sense: float
    """The same of the leg from the corner."""
    before: float
    """rad; the yaw before the leg to the corner, and its turn."""
    after: float
    """rad; the yaw after the leg from the corner, and its turn."""


@kernel
def leg(
    world: World, a: tuple[float, float], b: tuple[float, float], sense: float, before: float, bound: float
) -> tuple[float, float]:
    """Return (seconds, heading) of turning at a (x, y; m) from the yaw ``before`` (rad) and driving straight to b,
    ahead (sense 1.0) or astern (-1.0).

    Seconds are inf as soon as they exceed ``bound``.
    """
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    if length < LEAST_LEG:
        return np.inf, 0.0
    heading = bearing_of(a, b, sense)
    hard = world.rules.hard_margin
    if length / world.rules.speed > bound:
        return np.inf, heading
    seconds, _, _ = turn_to(world, Pose2D(a[0], a[1], before), heading, hard)
    if seconds > bound:
        return np.inf, heading
    straight, _ = move(world, Pose2D(a[0], a[1], heading), sense * length, 0.0, hard)
    return seconds + straight, heading


@kernel
def bearing_of(a: tuple[float, float], b: tuple[float, float], sense: float) -> float:
    """Return the yaw (rad) of a body that drives from a to b (x, y; m), ahead (sense 1.0) or astern (-1.0)."""
    return math.atan2(b[1] - a[1], b[0] - a[0]) + (0.0 if sense > 0.0 else math.pi)


@kernel
def by_way_of(world: World, corner: Corner, x: float, y: float, bound: float) -> float:
    """Return the seconds that the two legs about a Corner take, and the turns about them, if it lies at (x, y), m; inf
    beyond ``bound``.
    """
    c = corner
    first, heading = leg(world, (c.ax, c.ay), (x, y), c.sense, c.before, bound)
    if first > bound:
        return np.inf
    second, heading = leg(world, (x, y), (c.bx, c.by), c.next_sense, heading, bound - first)
    if first + second > bound:
        return np.inf
    third, _, _ = turn_to(world, Pose2D(c.bx, c.by, heading), c.after, world.rules.hard_margin)
    return first + second + third


@kernel
def directly(world: World, corner: Corner, best: float) -> tuple[float, float]:
    """Return (seconds, heading) of going without a Corner whose legs are driven the same way; more than ``best``, or
    inf, where that does not pay.
    """
    c = corner
    seconds, heading = leg(world, (c.ax, c.ay), (c.bx, c.by), c.sense, c.before, best)
    if seconds < best:
        seconds += turn_to(world, Pose2D(c.bx, c.by, heading), c.after, world.rules.hard_margin)[0]
    return seconds, heading


@kernel
def best_place(
    world: World, corner: Corner, place: tuple[float, float], size: float, best: float
) -> tuple[float, float]:
    """Return (x, y), m, where a Corner takes least time, of where it is and eight places ``size`` m about it.

    best: s that it takes where it is.
    """
    x, y = place
    to_x, to_y = x, y
    for side in range(8):
        px, py = x + size * math.cos(side * math.pi / 4.0), y + size * math.sin(side * math.pi / 4.0)
        seconds = by_way_of(world, corner, px, py, best - 1e-3)
        if seconds < best - 1e-3:
            best, to_x, to_y = seconds, px, py
    return to_x, to_y


@kernel
def set_leg(
    moves: np.ndarray, ends: np.ndarray, k: int, a: tuple[float, float], b: tuple[float, float], sense: float
) -> None:
    """Make move k a straight one from a to b (x, y; m)."""
    moves[k, 0], moves[k, 1], ends[k, 0], ends[k, 1] = a[0], a[1], b[0], b[1]
    moves[k, 2] = bearing_of(a, b, sense)
    moves[k, 3] = sense * math.hypot(b[0] - a[0], b[1] - a[1])


@kernel
def ends_of(moves: np.ndarray) -> np.ndarray:
    """Return where each of the moves (n, 5) ends, (n, 2), m."""
    n = len(moves)
    ends = np.empty((n, 2))
    for k in range(n):
        chord = moves[k, 3] * (1.0 if abs(moves[k, 4]) < 1e-9 else math.sin(0.5 * moves[k, 4]) / (0.5 * moves[k, 4]))
        heading = moves[k, 2] + 0.5 * moves[k, 4]
        ends[k, 0], ends[k, 1] = moves[k, 0] + chord * math.cos(heading), moves[k, 1] + chord * math.sin(heading)
    return ends


@kernel
def corner_at(moves: np.ndarray, ends: np.ndarray, yaws: np.ndarray, k: int, n: int) -> Corner:
    """Return the Corner where move k of the first n begins; yaws (2,): before the first move and after the last."""
    return Corner(
        moves[k - 1, 0],
        moves[k - 1, 1],
        ends[k, 0],
        ends[k, 1],
        math.copysign(1.0, moves[k - 1, 3]),
        math.copysign(1.0, moves[k, 3]),
        yaws[0] if k == 1 else moves[k - 2, 2] + moves[k - 2, 4],
        yaws[1] if k == n - 1 else moves[k + 1, 2],
    )


@kernel
def relax(world: World, moves: np.ndarray, yaws: np.ndarray) -> np.ndarray:
    """Return moves (m, 5) x, y, yaw, length, turn without turns in place, which follow from the yaws, after moving
    corners.

    moves: (n, 5), none of them a turn in place. yaws: those at the start and at the goal (2,).
    """
    n = len(moves)
    moves = moves.copy()
    ends = ends_of(moves)
    for size in STEPS:
        for _ in range(SWEEPS):
            before = n
            n, better = sweep(world, moves, ends, yaws, n, size)
            if not better and n == before:
                break
    return moves[:n].copy()


@kernel
def sweep(world: World, moves: np.ndarray, ends: np.ndarray, yaws: np.ndarray, n: int, size: float) -> tuple[int, bool]:
    """Move each corner of the first n moves by ``size`` m, or leave it out, where that takes less time; in place.

    Return (how many moves are left, whether any corner was moved).
    """
    better = False
    k = 1
    while k < n:
        if moves[k, 4] != 0.0 or moves[k - 1, 4] != 0.0:
            k += 1
            continue
        corner = corner_at(moves, ends, yaws, k, n)
        a, b, here = (corner.ax, corner.ay), (corner.bx, corner.by), (moves[k, 0], moves[k, 1])
        best = by_way_of(world, corner, here[0], here[1], np.inf)
        if corner.sense == corner.next_sense:
            direct, heading = directly(world, corner, best)
            if direct <= best and direct < np.inf:
                ends[k - 1, 0], ends[k - 1, 1] = b
                moves[k - 1, 2] = heading
                moves[k - 1, 3] = corner.sense * math.hypot(b[0] - a[0], b[1] - a[1])
                for m in range(k, n - 1):
                    moves[m], ends[m] = moves[m + 1], ends[m + 1]
                n -= 1
                continue
        there = best_place(world, corner, here, size, best)
        if there[0] != here[0] or there[1] != here[1]:
            better = True
            set_leg(moves, ends, k - 1, a, there, corner.sense)
            set_leg(moves, ends, k, there, b, corner.next_sense)
        k += 1
    return n, better


@kernel
def with_turns(world: World, moves: np.ndarray, start: Pose2D, goal: Pose2D) -> np.ndarray:
    """Return moves (m, 5) with the turns in place that lie between them, from a Pose2D to a Pose2D."""
    n = len(moves)
    result = np.empty((2 * n + 1, 5))
    count, yaw = 0, start.yaw
    for k in range(n + 1):
        target = Pose2D(moves[k, 0], moves[k, 1], moves[k, 2]) if k < n else goal
        _, turn, _ = turn_to(world, Pose2D(target.x, target.y, yaw), target.yaw, world.rules.hard_margin)
        if abs(turn) >= LEAST_TURN:
            result[count] = np.array([target.x, target.y, yaw, 0.0, turn])
            count += 1
        if k < n:
            result[count] = moves[k]
            yaw = moves[k, 2] + moves[k, 4]
            count += 1
    return result[:count].copy()


def smooth(
    world: World, steps: np.ndarray, ends: tuple[Pose2D, Pose2D], limits: tuple[float, float], by: Shortcuts | None
) -> np.ndarray:
    """Return moves (m, 5) that take less time than ``steps`` (n, 5); both from the first to the second of ``ends``.

    limits: the gaps allowed at the start and at the goal, m. What begins or ends nearer to something than the margin
    stays as it is. by: what shortcuts are made by; None: none are.
    """
    (start, goal), (limit, limit_end) = ends, limits
    hard, first, last = world.rules.hard_margin, 0, len(steps)
    while first < last and limit < hard:
        x, y, yaw, length, turn = steps[first].tolist()
        _, limit = move(world, Pose2D(x, y, yaw), length, turn, limit)
        start = place(Pose2D(x, y, yaw), length, turn, 1.0)
        first += 1
    while last > first and limit_end < hard:
        last -= 1
        x, y, yaw, length, turn = steps[last].tolist()
        goal = Pose2D(x, y, yaw)
        _, limit_end = move(world, place(goal, length, turn, 1.0), -length, -turn, limit_end)
    moves = np.ascontiguousarray(steps[first:last][steps[first:last, 3] != 0.0])
    if len(moves) == 0:
        return steps
    moves = rounded(world, relax(world, moves, np.array([start.yaw, goal.yaw])))
    moves = with_turns(world, moves, start, goal)
    if by is not None:
        last_turn = len(moves) - 1 if moves[-1, 3] == 0.0 else len(moves)  # the goal is come to straight
        moves = np.vstack([with_shortcuts(by, start, moves[:last_turn]), moves[last_turn:]])
    return np.vstack([steps[:first], moves, steps[last:]])


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    world, pose, moves = example_world(), Pose2D(1.0, 1.0, 1.0), np.ones((2, 5))
    relax(world, moves, np.zeros(2))
    with_turns(world, moves, pose, pose)
    move(world, pose, 1.0, 0.0, 0.0)
    place(pose, 1.0, 0.0, 1.0)
