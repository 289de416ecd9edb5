"""Where a path leads through something narrow, the best straight line through it: in the middle, and square to it.

Of lines through the narrowest place of the path, turned and moved aside a little, the one is taken that the body drives
soonest, which keeps the greatest gaps; coarsely first, then finely. Places on that line before and behind are offered
to the straightening.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.lattice.body import move, room_at
from sara_nav.lattice.world import World, example_world

APART = 1.0
"""m of path on either side, within which a narrow place is the narrowest."""
HALF = 0.6
"""m before and behind the narrow place that the line is judged over."""
PLACES = (0.6, 0.9, 1.2)
"""m before and behind, at which places on the line are offered."""
ANGLE, ASIDE, MANY = 0.13, 0.06, 5
"""rad and m between the lines that are tried first, and how many to either side; afterwards a third and a ninth of
that, about the best, but none further turned.
"""


@kernel
def narrow_places(world: World, poses: np.ndarray, inscribed: float) -> np.ndarray:
    """Return the indices (int64) of the poses (n, 3) where the path is narrowest about: with less than rules.narrow
    beside the inscribed radius (m), and nothing narrower within APART.
    """
    n = len(poses)
    found = np.empty(n, np.int64)
    near, done = np.empty(n), np.zeros(n)
    for i in range(n):
        near[i] = room_at(world, poses[i, 0], poses[i, 1])
        if i:
            done[i] = done[i - 1] + math.hypot(poses[i, 0] - poses[i - 1, 0], poses[i, 1] - poses[i - 1, 1])
    count = 0
    for i in range(1, n - 1):
        if near[i] <= inscribed + world.rules.narrow and is_narrowest(near, done, i):
            found[count] = i
            count += 1
    return found[:count].copy()


@kernel
def is_narrowest(near: np.ndarray, done: np.ndarray, i: int) -> bool:
    """True when ``near`` is least at i, of all within APART by ``done`` (m); of equals, at the last."""
    j = i - 1
    while j >= 0 and done[i] - done[j] < APART:
        if near[j] < near[i]:
            return False
        j -= 1
    j = i + 1
    while j < len(near) and done[j] - done[i] < APART:
        if near[j] <= near[i]:
            return False
        j += 1
    return True


@kernel
def best_line(world: World, pose: Pose2D) -> Pose2D:
    """Return the Pose2D of the best straight line through, near a Pose2D; its yaw is NaN when none is free."""
    best, found = np.inf, pose
    angle, aside, many = ANGLE, ASIDE, MANY
    for _ in range(3):
        middle = found
        for a in range(-many, many + 1):
            yaw = middle.yaw + a * angle
            if abs(yaw - pose.yaw) > MANY * ANGLE + 1e-6:
                continue
            c, s = math.cos(yaw), math.sin(yaw)
            for b in range(-many, many + 1):
                x, y = middle.x - s * b * aside, middle.y + c * b * aside
                begin = Pose2D(x - HALF * c, y - HALF * s, yaw)
                seconds, _ = move(world, begin, 2.0 * HALF, 0.0, world.rules.hard_margin)
                if seconds < best - 1e-6:
                    best, found = seconds, Pose2D(x, y, yaw)
        if best == np.inf:
            return Pose2D(pose.x, pose.y, np.nan)
        angle, aside, many = angle / 3.0, aside / 3.0, 3
    return found


def with_gates(
    world: World, poses: np.ndarray, moves: np.ndarray, inscribed: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (poses (m, 3), moves (m, 2), follow (m,)): the path's poses (n, 3) with places before and behind narrow
    ones put among them.

    moves[i] (length m, turn rad) leads from pose i of the path to pose follow[i], int64; that is -1 for the last, and
    for places put in. inscribed: radius, m.
    """
    put = {}
    straight = world._replace(rules=world.rules._replace(run_up_cost=0.0))
    for i in narrow_places(world, poses, inscribed).tolist():
        astern = math.pi if moves[min(i, len(moves) - 1), 0] < 0.0 else 0.0
        x, y, yaw = poses[i].tolist()
        x, y, yaw = best_line(straight, Pose2D(x, y, yaw + astern))
        if math.isnan(yaw):
            continue
        along = np.array([math.cos(yaw), math.sin(yaw)])
        before, behind = put.setdefault(i, []), put.setdefault(i + 1, [])
        for far in PLACES[::-1]:
            before.append((*((x, y) - far * along), yaw + astern))
        for far in PLACES:
            behind.append((*((x, y) + far * along), yaw + astern))
    rows, steps, own = [], [], []
    for i, pose in enumerate(poses):
        for place in put.get(i, ()):
            rows.append(place)
            steps.append((0.0, 0.0))
        own.append(len(rows))
        rows.append(tuple(pose))
        steps.append(tuple(moves[i]) if i < len(moves) else (0.0, 0.0))
    follow = np.full(len(rows), -1, np.int64)
    follow[own[:-1]] = own[1:]
    return np.array(rows), np.array(steps), follow


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    world = example_world()
    narrow_places(world, np.ones((3, 3)), 0.1)
    best_line(world, Pose2D(1.0, 1.0, 0.0))
