"""A search for moves of an oriented body from a pose to a pose: hybrid A* over straights, arcs and turns in place.

After Dolgov, Thrun, Montemerlo and Diebel (2010): states are exact poses, of which each cell of position and heading
keeps the best; a state is joined to the goal analytically where that is free. A differential drive's analytic path is
turn, straight, turn. Turns end on multiples of STEP; where it is too tight for them there are arcs so slight that the
body leaves a wall that it stands along without swinging its tail into it (moves.py). Cells and steps are finer where it
is tight. The order is weighted A*'s (Pohl 1970): the time so far plus ``greed`` times what the wave says is left. The
wave ignores turns, so the path found is a good one to make straight, no more.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_common.planar import Pose2D
from sara_nav.lattice.body import gap, move
from sara_nav.lattice.field import distance_at
from sara_nav.lattice.joining import join, sees
from sara_nav.lattice.moves import AHEAD, ASTERN, FAR, FINE_HEADINGS, FINE_STEP, TURNS, key_of, kind_of, option_of
from sara_nav.lattice.tree import Tree, empty_tree, put, slot_of, trace
from sara_nav.lattice.world import Rules, World, example_world

FOUND, NO_PATH, GAVE_UP = 0, 1, 2
BESIDE = 0.08
"""m; with a gap of less than that the slight arcs are tried."""
MOST_JOINTS = 60
"""Joints to the goal that a search keeps."""
ASTERN_WITHIN = 3.0
"""m of a straight leg astern to the goal."""


class Quest(NamedTuple):
    """What a search looks for, and where."""

    world: World
    wave: np.ndarray
    """float32 (rows + 1, columns + 1): least s from each corner of cells to the nearest end; see Field.wave_from."""
    ends: np.ndarray
    """float64 (m, 4): x, y, yaw (m, rad) where the search may end, and the s from there to the goal."""
    radius: float
    """m, of the circle that must see an end before the end is joined."""
    greed: float
    """How many times as much as the time so far the time left counts."""
    most: int
    """States expanded before the search gives up."""
    escape: float
    """m; where that is not negative, any pose that has so much room round the circle that turning about sweeps ends the
    search, in place of ``ends``.
    """


class Joints(NamedTuple):
    """How states were joined to ends."""

    rows: np.ndarray
    """float64 (MOST_JOINTS + 4, 3): state, 1 ahead or -1 astern, number of the end."""
    seconds: np.ndarray
    """float64 (1,): of the best path found so far; inf without one."""
    counts: np.ndarray
    """int64 (2,): rows in use; states that are still expanded before the next are joined."""


@kernel
def left_at(quest: Quest, x: float, y: float) -> float:
    """Return the time (s) the wave says is left at a point (m), FAR where it did not come.

    With ``escape``: the time to where turning about has that much room, at least. Distances grow no faster than one
    drives.
    """
    rules = quest.world.rules
    u, v = (x - rules.origin_x) / rules.resolution, (y - rules.origin_y) / rules.resolution
    if quest.escape >= 0.0:
        return max(0.0, rules.radius + quest.escape - distance_at(quest.world.distances, u, v)) / rules.speed
    wave = quest.wave
    i, j = int(v), int(u)
    if not (u >= 0.0 and v >= 0.0 and i < wave.shape[0] - 1 and j < wave.shape[1] - 1):
        return FAR
    a, b = u - j, v - i
    total, share = 0.0, 0.0
    for di in range(2):
        for dj in range(2):
            value = wave[i + di, j + dj]
            if value < FAR:
                w = (b if di else 1.0 - b) * (a if dj else 1.0 - a)
                total += w * value
                share += w
    return total / share if share > 1e-6 else FAR


@kernel
def search(quest: Quest, start: Pose2D, limit: float) -> tuple[int, int, np.ndarray, np.ndarray]:
    """Search from a Pose2D, where the gap may be as little as ``limit`` (m, see body.move), for what a Quest asks.

    Return (status, expanded, moves (n, 5), joint): moves are x, y, yaw at their beginning, length, turn; the last is no
    move but a pose, and the joint (state, 1 ahead or -1 astern, number of the end) tells how the end is joined to it.
    """
    world, tree = quest.world, empty_tree(quest.most)
    joints = Joints(np.zeros((MOST_JOINTS + 4, 3)), np.full(1, np.inf), np.zeros(2, np.int64))
    none = np.empty((0, 5))
    heading = np.int16(round(start.yaw / FINE_STEP)) % FINE_HEADINGS
    put(tree, 0, start, (0.0, 0.0), (0.0, limit), (-1, heading, TURNS))
    heap = [(quest.greed * min(left_at(quest, start.x, start.y), FAR), 0)]
    expanded, count = 0, 1
    while len(heap) > 0:
        _, n = heapq.heappop(heap)
        if n < 0:  # an end is the best of what waits
            joint = joints.rows[-n - 1]
            return FOUND, expanded, trace(tree, int(joint[0])), joint
        pose = Pose2D(tree.x[n], tree.y[n], tree.yaw[n])
        u, v, room = look(world, pose.x, pose.y)
        key = key_of(u, v, tree.index[n], room, world.rules)
        at = slot_of(tree.keys, key)
        if tree.keys[at] == key and tree.best[at] < tree.spent[n] - 1e-4:
            continue
        if quest.escape >= 0.0 and room >= world.rules.radius + quest.escape:
            return FOUND, expanded, trace(tree, n), joints.rows[0]
        if expanded >= quest.most:
            return GAVE_UP, expanded, none, joints.rows[0]
        expanded += 1
        join_ends(quest, tree, n, joints, heap, expanded)
        stride = 0.5 if room > world.rules.radius + world.rules.greatest_gap else 0.2
        for option in range(20 if wants_slight_arcs(world, tree, n, pose, room) else 12):
            length, turn = option_of(option, pose.yaw, stride)
            if option < 2 and tree.kind[n] == TURNS and tree.turn[n] * turn < 0.0:
                continue  # it would undo the turn that led here
            if turn == 0.0 and length == 0.0:
                continue
            added, priority = try_move(quest, tree, n, (length, turn), count, joints.seconds[0])
            if added < 0:
                return GAVE_UP, expanded, none, joints.rows[0]
            if added > 0:
                heapq.heappush(heap, (priority, count))
                count += 1
    return NO_PATH, expanded, none, joints.rows[0]


@kernel
def look(world: World, x: float, y: float) -> tuple[float, float, float]:
    """Return (column, row, distance) of a point (m): its place on the grid, not rounded, and m to the next obstacle."""
    scale = 1.0 / world.rules.resolution
    u, v = (x - world.rules.origin_x) * scale, (y - world.rules.origin_y) * scale
    return u, v, distance_at(world.distances, u, v)


@kernel
def join_ends(quest: Quest, tree: Tree, n: int, joints: Joints, heap: list, expanded: int) -> None:
    """Join state n to the ends that it sees, now and then: the more seldom, the more time is left and the longer the
    search has run. Joints that are sooner than all before are kept and wait in the heap, as -1 minus their number.
    """
    joints.counts[1] -= 1
    if joints.counts[1] > 0 or joints.counts[0] >= MOST_JOINTS:
        return
    world, pose = quest.world, Pose2D(tree.x[n], tree.y[n], tree.yaw[n])
    left = left_at(quest, pose.x, pose.y)
    joints.counts[1] = max(1, min(20, int(0.25 * left)), expanded // 50)
    ends = quest.ends
    for e in range(len(ends)):
        end = Pose2D(ends[e, 0], ends[e, 1], ends[e, 2])
        if not sees(world, pose.x, pose.y, end.x, end.y, quest.radius):
            continue
        for sense in (1, -1):
            if sense < 0 and math.hypot(pose.x - end.x, pose.y - end.y) > ASTERN_WITHIN:
                continue
            seconds, _, _, _ = join(world, pose, tree.kind[n], tree.limit[n], end, sense)
            total = tree.spent[n] + seconds + ends[e, 3]
            if total < joints.seconds[0] - 1e-6 and joints.counts[0] < MOST_JOINTS:
                joints.seconds[0] = total
                row = joints.counts[0]
                joints.rows[row, 0], joints.rows[row, 1], joints.rows[row, 2] = n, sense, e
                joints.counts[0] += 1
                heapq.heappush(heap, (total, -joints.counts[0]))


@kernel
def wants_slight_arcs(world: World, tree: Tree, n: int, pose: Pose2D, room: float) -> bool:
    """True where the body stands beside something before any turn of the lattice was possible."""
    if not (n == 0 or tree.index[n] % (FINE_HEADINGS // 32) != 0):
        return False
    return room < world.rules.radius + BESIDE and gap(world, pose, tree.limit[n]) < BESIDE


@kernel
def change_cost(rules: Rules, before: int, now: int, first: bool) -> float:
    """Return the seconds that a move of kind ``now`` costs for what was ``before``: a turn's beginning, or a change of
    gear. first: nothing was before.
    """
    if now == TURNS:
        return rules.turn_cost if before != TURNS or first else 0.0
    return rules.gear_cost if (now == AHEAD and before == ASTERN) or (now == ASTERN and before == AHEAD) else 0.0


@kernel
def try_move(
    quest: Quest, tree: Tree, n: int, run: tuple[float, float], count: int, incumbent: float
) -> tuple[int, float]:
    """Make one move (length m, turn rad) from state n. Return (1, s by which the search orders it) where it led to a
    new state, kept as number ``count``; 0 first where it did not, is no better than what is known, or cannot be better
    than the best path found so far (``incumbent``, s); -1 first where there is no room for more states.
    """
    length, turn = run
    world, rules, spent = quest.world, quest.world.rules, tree.spent[n]
    pose = Pose2D(tree.x[n], tree.y[n], tree.yaw[n])
    kind = kind_of(length)
    extra = change_cost(rules, tree.kind[n], kind, n == 0)
    chord = length if abs(turn) < 1e-9 else length * math.sin(0.5 * turn) / (0.5 * turn)
    x, y = pose.x + chord * math.cos(pose.yaw + 0.5 * turn), pose.y + chord * math.sin(pose.yaw + 0.5 * turn)
    yaw = pose.yaw + turn
    heading = np.int16(round(yaw / FINE_STEP)) % FINE_HEADINGS
    u, v, room = look(world, x, y)
    key = key_of(u, v, heading, room, rules)
    at = slot_of(tree.keys, key)
    known = tree.best[at] if tree.keys[at] == key else np.inf
    least = spent + extra + abs(length) / rules.speed  # before looking whether the body fits, which takes longest
    if known <= least + 1e-4:
        return 0, 0.0
    left = left_at(quest, x, y)
    if least + left >= incumbent:
        return 0, 0.0
    seconds, limit = move(world, pose, length, turn, tree.limit[n])
    if seconds == np.inf or (left >= FAR and limit >= rules.hard_margin):
        return 0, 0.0
    total = spent + extra + seconds
    if known <= total + 1e-4 or total + left >= incumbent:
        return 0, 0.0
    if count >= len(tree.x):
        return -1, 0.0
    tree.keys[at], tree.best[at] = key, total
    put(tree, count, Pose2D(x, y, wrap(yaw)), run, (total, limit), (n, heading, kind))
    return 1, total + quest.greed * min(left, FAR)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    quest = Quest(example_world(), np.zeros((4, 4), np.float32), np.zeros((1, 4)), 0.1, 1.5, 10, -1.0)
    search(quest, Pose2D(1.0, 1.0, 0.0), 0.0)
