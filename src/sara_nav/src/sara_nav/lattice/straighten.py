"""A path of many small moves becomes one of few long straight legs with turns between them.

Dynamic programming over the places of the path: each may be left straight, ahead or astern, for any later one, when the
body fits, by the same times that the search goes by. A place keeps the best arrival there is, and the best that ends in
the path's own yaw; from that the path itself always continues, so that something is always found, arcs through tight
bends included.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_common.planar import Pose2D
from sara_nav.lattice.arrivals import ANY, OWN, Arrivals, enter, no_arrivals, trace
from sara_nav.lattice.body import BEND, arrive, move, room_at, turn_to
from sara_nav.lattice.joining import sees
from sara_nav.lattice.moves import TURNS, kind_of
from sara_nav.lattice.world import Rules, World, example_world

BITTY = 1.0
"""s that each of the path's own arcs and turns costs besides, so that legs take their place."""
LATE = 4.0
"""s; no arrival is kept that comes so much later than the one with the path's own yaw."""
APART, TIGHT_APART = 0.7, 0.35
"""m of path between places that legs join."""
LEAST_LEG = 0.02
"""m."""


class Path(NamedTuple):
    """A path to be made straight, and places beside it."""

    poses: np.ndarray
    """float64 (n, 3): x, y, yaw (m, rad); the path leads from the first to the last."""
    moves: np.ndarray
    """float64 (n, 2): length (m), turn (rad) from each pose to the pose ``follow`` tells."""
    follow: np.ndarray
    """int64 (n,): the next pose of the path; -1 at its last, and at poses that are not on it but may be made use of."""
    limit: float
    """m; the gap allowed at the first pose, see body.move."""
    limit_end: float
    """m; the gap allowed at the last pose."""


class Reach(NamedTuple):
    """How far legs may lead."""

    radius: float
    """m, of the circle that must see a leg's end from its beginning."""
    longest: float
    """m, of a leg."""
    astern: float
    """m, of a leg astern."""


class Leg(NamedTuple):
    """A straight leg between two places of a path."""

    begin: int
    end: int
    length: float
    """m, negative astern."""
    heading: float
    """rad, of the body on it."""


@kernel
def straighten(world: World, path: Path, anchors: np.ndarray, reach: Reach) -> np.ndarray:
    """Return moves (m, 5) x, y, yaw, length, turn from the first to the last pose of a Path; none where none is found.

    anchors: indices (int64) of the poses that legs may join, the first and the last among them. reach: a Reach.
    """
    poses, follow = path.poses, path.follow
    n = len(poses)
    known = no_arrivals(n)
    known.cost[0, OWN], known.yaw[0, OWN], known.limit[0, OWN] = 0.0, poses[0, 2], path.limit
    taken = follow_path(world, path, known)
    k = 0
    for i in range(n - 1):
        if follow[i] >= 0 and known.cost[i, OWN] < np.inf:
            go_on(world, path, known, i, taken[i])
        while anchors[k] < i:
            k += 1
        if anchors[k] != i:
            continue
        for ahead in range(k + 1, len(anchors)):
            j = anchors[ahead]
            if j == n - 1 and path.limit_end < world.rules.hard_margin:
                continue
            join_straight(world, path, known, i, j, reach)
    return trace(poses, path.moves, known)


@kernel
def pose_of(poses: np.ndarray, i: int) -> Pose2D:
    """Return row i of poses (n, 3) as a Pose2D."""
    return Pose2D(poses[i, 0], poses[i, 1], poses[i, 2])


@kernel
def follow_path(world: World, path: Path, known: Arrivals) -> np.ndarray:
    """Enter the path's own moves into the arrivals, so that whatever takes longer need not be looked at. Return the
    seconds (n,) that each takes, without changes of gear; inf beside the path.
    """
    poses, moves = path.poses, path.moves
    allowed = towards_end(world, path)
    taken = np.full(len(poses), np.inf)
    hard = world.rules.hard_margin
    i = 0
    while path.follow[i] >= 0:
        next, length, turn = path.follow[i], moves[i, 0], moves[i, 1]
        if allowed[next] < hard:
            seconds = arrive(world, pose_of(poses, next), length, turn, allowed[next])
            known.limit[next, OWN] = hard
        else:
            seconds, known.limit[next, OWN] = move(world, pose_of(poses, i), length, turn, known.limit[i, OWN])
        what = kind_of(length)
        known.kind[next, OWN] = known.kind[i, OWN] if what == TURNS else what
        taken[i] = seconds + (BITTY if turn != 0.0 else 0.0)
        cost = known.cost[i, OWN] + taken[i] + gear(world.rules, known.kind[i, OWN], what)
        known.cost[next, OWN], known.yaw[next, OWN] = cost, poses[next, 2]
        known.parent[next, OWN], known.label[next, OWN] = i, -1
        i = next
    return taken


@kernel
def go_on(world: World, path: Path, known: Arrivals, i: int, taken: float) -> None:
    """Go on from place i by the path's own move, which takes ``taken`` s, where that is sooner than what is known."""
    next, what = path.follow[i], kind_of(path.moves[i, 0])
    total = known.cost[i, OWN] + taken + gear(world.rules, known.kind[i, OWN], what)
    if total < known.cost[next, OWN]:
        known.cost[next, OWN] = total
        known.kind[next, OWN] = known.kind[i, OWN] if what == TURNS else what
        known.parent[next, OWN], known.label[next, OWN] = i, -1


@kernel
def join_straight(world: World, path: Path, known: Arrivals, i: int, j: int, reach: Reach) -> None:
    """Go straight from place i to place j, ahead and astern, where that is sooner than what is known."""
    x, y, gx, gy = path.poses[i, 0], path.poses[i, 1], path.poses[j, 0], path.poses[j, 1]
    length = math.hypot(gx - x, gy - y)
    if length > reach.longest or length < LEAST_LEG:
        return
    soonest = min(known.cost[i, OWN], known.cost[i, ANY]) + length / world.rules.speed
    if soonest >= known.cost[j, OWN] and soonest >= known.cost[j, ANY]:
        return
    if not sees(world, x, y, gx, gy, reach.radius):
        return
    bearing = math.atan2(gy - y, gx - x)
    leave(world, path, known, Leg(i, j, length, bearing))
    if length <= reach.astern:
        leave(world, path, known, Leg(i, j, -length, bearing + math.pi))


@kernel
def leave(world: World, path: Path, known: Arrivals, leg: Leg) -> None:
    """Leave the place where a Leg begins, after either of its arrivals."""
    i, j, length, heading = leg
    rules, poses = world.rules, path.poses
    what, looked = kind_of(length), False
    taken, arrived = np.inf, 0.0
    for own in range(2):
        if known.cost[i, own] == np.inf or not may_pay(rules, known, leg, own):
            continue
        begin = Pose2D(poses[i, 0], poses[i, 1], known.yaw[i, own])
        seconds, turn, after = turn_to(world, begin, heading, known.limit[i, own])
        if seconds == np.inf:
            continue
        if not looked or i == 0:
            taken, arrived = move(world, Pose2D(poses[i, 0], poses[i, 1], heading), length, 0.0, after)
            looked = True
        if taken == np.inf:
            return
        total = known.cost[i, own] + seconds + taken + gear(rules, known.kind[i, own], what)
        if total < known.cost[j, ANY] and j < len(poses) - 1:
            known.cost[j, ANY], known.yaw[j, ANY], known.limit[j, ANY] = total, heading, arrived
            enter(known, j, ANY, (i, own, what), (turn, length, 0.0))
        if total < known.cost[j, OWN]:
            end = Pose2D(poses[j, 0], poses[j, 1], heading)
            there, back, last = turn_to(world, end, poses[j, 2], arrived)
            if total + there < known.cost[j, OWN]:
                known.cost[j, OWN], known.yaw[j, OWN], known.limit[j, OWN] = total + there, poses[j, 2], last
                enter(known, j, OWN, (i, own, what), (turn, length, back))


@kernel
def may_pay(rules: Rules, known: Arrivals, leg: Leg, own: int) -> bool:
    """True when a Leg, free of all that slows it, may come to its end sooner than what is known."""
    i, j, length, heading = leg
    about = abs(wrap(heading - known.yaw[i, own]))
    least = (
        known.cost[i, own]
        + about / rules.turn_rate
        + rules.turn_cost * min(1.0, about / BEND)
        + abs(length) / rules.speed * (1.0 if length > 0.0 else rules.reverse_factor)
    )
    return not (least >= known.cost[j, OWN] and (least >= known.cost[j, ANY] or least >= known.cost[j, OWN] + LATE))


@kernel
def anchors_of(world: World, poses: np.ndarray, follow: np.ndarray) -> np.ndarray:
    """Return the indices (int64) of the poses (n, 3) that legs are to join: first, last, and some between, nearer where
    it is tight, with all that are not on the path (follow (n,), see Path).
    """
    n = len(poses)
    chosen = np.empty(n, np.int64)
    chosen[0], count, done, last = 0, 1, 0.0, 0
    for i in range(1, n):
        step = math.hypot(poses[i, 0] - poses[last, 0], poses[i, 1] - poses[last, 1])
        if follow[i] >= 0 or i == n - 1:
            done, last = done + step, i
        apart = TIGHT_APART if room_at(world, poses[i, 0], poses[i, 1]) < world.rules.radius else APART
        if i == n - 1 or follow[i] < 0 or (done >= apart - 1e-6 and step > 0.0):
            chosen[count], count = i, count + 1
            done = 0.0 if follow[i] >= 0 else done
    return chosen[:count].copy()


@kernel
def towards_end(world: World, path: Path) -> np.ndarray:
    """Return the gap (n,), m, that a Path is allowed at each of its poses because it ends so near to something: the
    hard margin but for the last.
    """
    n, hard = len(path.poses), world.rules.hard_margin
    allowed = np.full(n, hard)
    allowed[n - 1] = path.limit_end
    at = n - 1
    for i in range(n - 2, -1, -1):
        if path.follow[i] == at:
            if allowed[at] < hard:
                end = pose_of(path.poses, at)
                _, allowed[i] = move(world, end, -path.moves[i, 0], -path.moves[i, 1], allowed[at])
            at = i
    return allowed


@kernel
def gear(rules: Rules, before: int, now: int) -> float:
    """Return what it costs (s) that the last drive was of one kind and this is of the other."""
    return rules.gear_cost if before != TURNS and now != TURNS and before != now else 0.0


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    world, poses, follow = example_world(), np.ones((2, 3)), np.array([1, -1])
    anchors = anchors_of(world, poses, follow)
    straighten(world, Path(poses, np.zeros((2, 2)), follow, 0.0, 0.0), anchors, Reach(0.1, 5.0, 1.0))
