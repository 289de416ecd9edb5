"""Parts of a path are replaced by shortcuts, above all turns in place by turns while driving: joins of two of its poses
(dubins.py), as Bellman's recursion over the poses finds them to take least time (driving.py).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.lattice.body import COARSE, FINE, gap, place, unhindered
from sara_nav.lattice.driving import Driving, example_driving, seconds_of
from sara_nav.lattice.dubins import dubins_join, joins_of
from sara_nav.lattice.moves import TURNS, kind_of
from sara_nav.lattice.world import Rules, World, example_world

PIECES = ((0.4, 0.4), (0.27, 0.3), (0.45, 0.5))
"""m, rad: pieces that the path is cut into, one after another."""
WINDOW = 16
"""Poses that a shortcut may span."""
NOTHING = 3
"""The kind of the last move where there was none; see moves.py."""
BITTY = 0.3
"""s that each join counts besides, so that a path is not made of many small pieces."""
SPARE = 0.002
"""m by which a path's own moves may lack the margin, as they are sampled elsewhere."""


class Shortcuts(NamedTuple):
    """What shortcuts are made by: the radii (n,) of their arcs, m, and the least gap on these, m; a World whose Rules
    time them; a Driving.
    """

    radii: np.ndarray
    arc_margin: float
    world: World
    driving: Driving


@kernel
def cut(moves: np.ndarray, piece: float, twist: float) -> np.ndarray:
    """Return moves (n, 2), length m and turn rad, cut into pieces no longer than that (m, rad); empty ones left out."""
    count = 0
    for k in range(len(moves)):
        count += int(math.ceil(max(abs(moves[k, 0]) / piece, abs(moves[k, 1]) / twist) - 1e-9))
    result, n = np.empty((count, 2)), 0
    for k in range(len(moves)):
        parts = int(math.ceil(max(abs(moves[k, 0]) / piece, abs(moves[k, 1]) / twist) - 1e-9))
        for _ in range(parts):
            result[n, 0], result[n, 1] = moves[k, 0] / parts, moves[k, 1] / parts
            n += 1
    return result


@kernel
def change(rules: Rules, before: int, now: int) -> float:
    """Return the seconds that a move of the kind ``now`` costs after one of another: half of what stopping to turn does
    before the turn, half after it; or a change of gear.
    """
    if before in (NOTHING, now):
        return 0.0
    return 0.5 * rules.turn_cost if TURNS in (before, now) else rules.gear_cost


@kernel
def least_seconds(rules: Rules, moves: np.ndarray, before: int) -> tuple[float, int]:
    """Return (s of moves (n, 2) where nothing is near, the kind of the last), after one of the kind ``before``."""
    total = 0.0
    for k in range(len(moves)):
        length, turn = moves[k, 0], moves[k, 1]
        if abs(length) < 1e-9 and abs(turn) < 1e-9:
            continue
        total += change(rules, before, kind_of(length)) + unhindered(rules, length, turn)
        before = kind_of(length)
    return total, before


@kernel
def narrowest(world: World, start: np.ndarray, run: np.ndarray, most: float) -> float:
    """Return the least gap (m) on a move, ``run`` (2,), from a pose (3,); at most ``most``."""
    pose, length, turn = Pose2D(start[0], start[1], start[2]), run[0], run[1]
    path = abs(length) + world.rules.radius * abs(turn)
    samples = max(int(math.ceil(path / FINE)), 1)
    least = most
    for k in range(samples + 1):
        least = min(least, gap(world, place(pose, length, turn, k / samples), 0.0))
    return least


@kernel
def run_up_seconds(world: World, end: Pose2D, length: float) -> float:
    """Return the seconds that an arc of that length (m) costs more because a narrow place follows straight behind its
    end: as Rules.run_up of straight legs, for a chair leaves its arcs less exactly than its turns in place.
    """
    rules, sense, at = world.rules, math.copysign(1.0, length), 0.0
    while at < rules.run_up:
        if gap(world, place(end, sense * at, 0.0, 1.0), rules.narrow) < rules.narrow:
            return rules.run_up_cost * (1.0 - at / rules.run_up)
        at += COARSE
    return 0.0


@kernel
def delay(by: Shortcuts, start: np.ndarray, moves: np.ndarray, limits: tuple[float, float], most: float) -> float:
    """Return the seconds that what is near adds to moves (n, 2) from a pose (3,); inf where the body does not fit with
    the gaps ``limits`` (m; on arcs, else), or where it is more than ``most``.
    """
    pose, total = Pose2D(start[0], start[1], start[2]), 0.0
    for k in range(len(moves)):
        length, turn = moves[k, 0], moves[k, 1]
        if abs(length) < 1e-9 and abs(turn) < 1e-9:
            continue
        limit = limits[0] if length != 0.0 and turn != 0.0 else limits[1]
        free = unhindered(by.world.rules, length, turn)
        total += seconds_of(by.world, by.driving, pose, (length, turn), limit, most - total + free) - free
        if total > most:
            return np.inf
        pose = place(pose, length, turn, 1.0)
        if length != 0.0 and turn != 0.0:
            total += run_up_seconds(by.world, pose, length)
    return total


@kernel
def shorten(by: Shortcuts, start: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Return the moves (m, 2) of the fastest chain of joins between poses along moves (n, 2) from a pose (3,). The gap
    of a join is nowhere less than the least of what it replaces, or than the arcs' margin.
    """
    count, joins, rules = len(moves), joins_of(by.radii), by.world.rules
    as_found = (rules.hard_margin - SPARE, rules.hard_margin - SPARE)
    poses, own, gaps = np.empty((count + 1, 3)), np.empty(count), np.empty(count)
    poses[0] = start
    best = np.full((count + 1, 4), np.inf)  # by the kind of the last move
    source = np.full((count + 1, 4, 3), -1, np.int64)  # pose, kind there, join; `joins`: the path's own move
    best[0, NOTHING] = 0.0
    three, one = np.empty((3, 2)), np.empty((1, 2))
    turned = np.zeros(count + 1)  # rad, both ways, up to each pose
    for i in range(count):
        turned[i + 1] = turned[i] + abs(moves[i, 1])
        pose = place(Pose2D(poses[i, 0], poses[i, 1], poses[i, 2]), moves[i, 0], moves[i, 1], 1.0)
        poses[i + 1, 0], poses[i + 1, 1], poses[i + 1, 2] = pose.x, pose.y, pose.yaw
        one[0] = moves[i]
        gaps[i] = narrowest(by.world, poses[i], moves[i], by.arc_margin)
        own[i] = delay(by, poses[i], one, as_found, np.inf) + (BITTY if moves[i, 1] != 0.0 else 0.0)
        _relax(rules, one, own[i], best, source, (i, i + 1, joins))
    if best[count].min() == np.inf:
        return moves  # it was found with another margin
    for i in range(count):
        one[0] = moves[i]
        _relax(rules, one, own[i], best, source, (i, i + 1, joins))
        for j in range(min(count, i + WINDOW), i, -1):
            if turned[j] == turned[i]:
                continue  # straight as it is
            keeps = max(gaps[i:j].min() - SPARE, rules.hard_margin)
            for number in range(joins):
                if not dubins_join(number, poses[i], poses[j], by.radii, three):
                    continue
                spare = _spare(rules, three, best, i, j)
                limits = (by.arc_margin, keeps)
                if spare > 0.0 and _fits_between(by.world, poses[i], three, limits):
                    late = delay(by, poses[i], three, limits, spare)
                    if late < spare:
                        _relax(rules, three, late + BITTY, best, source, (i, j, number))
    return chained(poses, moves, by.radii, source, int(np.argmin(best[count])))


@kernel
def _fits_between(world, start, moves, limits):
    """Whether the body fits where each of moves but the last ends. `delay` looks there, too; but of ten joins that do
    not fit, eight fail here, without the time of what comes before.
    """
    pose = Pose2D(start[0], start[1], start[2])
    for k in range(len(moves) - 1):
        length, turn = moves[k, 0], moves[k, 1]
        if abs(length) < 1e-9 and abs(turn) < 1e-9:
            continue
        limit = limits[0] if length != 0.0 and turn != 0.0 else limits[1]
        pose = place(pose, length, turn, 1.0)
        if gap(world, pose, limit) < limit:
            return False
    return True


@kernel
def _spare(rules, moves, best, i, j):
    """The most seconds that a join from i to j may be delayed by and be sooner than what is known."""
    most = 0.0
    for kind in range(4):
        if best[i, kind] < np.inf:
            seconds, last = least_seconds(rules, moves, kind)
            most = max(most, best[j, last] - best[i, kind] - seconds - BITTY - 1e-6)
    return most


@kernel
def _relax(rules, moves, late, best, source, join):
    """Take a join (pose before, pose after, number) where it is sooner than what is known, after each kind of move."""
    i, j, number = join
    for kind in range(4):
        if best[i, kind] == np.inf:
            continue
        seconds, last = least_seconds(rules, moves, kind)
        total = best[i, kind] + seconds + late
        if total < best[j, last] - 1e-9:
            best[j, last] = total
            source[j, last, 0], source[j, last, 1], source[j, last, 2] = i, kind, number


@kernel
def chained(poses: np.ndarray, moves: np.ndarray, radii: np.ndarray, source: np.ndarray, kind: int) -> np.ndarray:
    """Return the moves (m, 2) to the last of poses (n, 3), the last of that kind. source (n, kinds, 3): the pose
    before, the kind there, and which join leads from there; as many as there are joins: the path's own of moves (n - 1,
    2).
    """
    at, joins = len(poses) - 1, joins_of(radii)
    result, n, three = np.empty((3 * len(poses), 2)), 3 * len(poses), np.empty((3, 2))
    while at > 0:
        i, before, number = source[at, kind, 0], source[at, kind, 1], source[at, kind, 2]
        if number == joins:
            n -= 1
            result[n] = moves[i]
        else:
            dubins_join(number, poses[i], poses[at], radii, three)
            n -= 3
            result[n : n + 3] = three
        at, kind = i, before
    return result[n:].copy()


@kernel
def merged(moves: np.ndarray) -> np.ndarray:
    """Return moves (m, 2) with those of one kind and curvature that follow each other made one, and without empty
    ones.
    """
    result, n = np.empty_like(moves), 0
    for k in range(len(moves)):
        length, turn = moves[k, 0], moves[k, 1]
        if abs(length) < 1e-6 and abs(turn) < 1e-6:
            continue
        if abs(length) < 1e-6:
            length = 0.0
        if n > 0 and kind_of(result[n - 1, 0]) == kind_of(length):
            before = result[n - 1]
            if length == 0.0 or abs(before[1] / before[0] - turn / length) < 1e-6:
                before[0] += length
                before[1] += turn
                continue
        result[n, 0], result[n, 1] = length, turn
        n += 1
    return result[:n].copy()


def with_shortcuts(by: Shortcuts, start: Pose2D, steps: np.ndarray) -> np.ndarray:
    """Return moves (m, 5), x, y, yaw, length m, turn rad, that take no more time than ``steps`` (n, 5) from a Pose2D,
    to the same end.
    """
    begin, moves = np.array([start.x, start.y, start.yaw]), np.ascontiguousarray(steps[:, 3:])
    for piece, twist in PIECES:
        moves = merged(shorten(by, begin, cut(moves, piece, twist)))
    found, pose = np.empty((len(moves), 5)), start
    for k, (length, turn) in enumerate(moves.tolist()):
        found[k] = (*pose, length, turn)
        pose = place(pose, length, turn, 1.0)
    return found


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    by, moves = Shortcuts(np.ones(1), 0.1, example_world(), example_driving()), np.full((2, 2), 0.01)
    merged(shorten(by, np.full(3, 0.2), cut(moves, *PIECES[0])))
    change(by.world.rules, 0, 1)
    least_seconds(by.world.rules, moves, 0)
    delay(by, np.full(3, 0.2), moves, (0.0, 0.0), np.inf)
    chained(np.zeros((1, 3)), moves, by.radii, np.zeros((1, 4, 3), np.int64), 0)
