"""Where a way leads through something narrow, the straight way through it that lies best: in the middle, and square to
it.

Of lines through the narrowest place of the way, turned and moved aside a little, the one is taken that the body drives
soonest, which keeps the greatest gaps; coarsely first, then finely. Places on that line before and behind are offered
to the straightening.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_nav.lattice.body import ENTRIES, HARD, NARROW, ORIGIN_X, ORIGIN_Y, RESOLUTION, RUN_UP_COST, move
from sara_nav.lattice.field import distance_at

APART = 1.0
"""m of way on either side, within which a narrow place is the narrowest."""
HALF = 0.6
"""m before and behind the narrow place that the line is judged over."""
PLACES = (0.6, 0.9, 1.2)
"""m before and behind, at which places on the line are offered."""
ANGLE, ASIDE, MANY = 0.13, 0.06, 5
"""rad and m between the lines that are tried first, and how many to either side; afterwards a third and a ninth of
that, about the best, but none further turned.
"""


@kernel
def narrow_places(field, rules, poses, inscribed):
    """Return the indices (int64) of the poses (n, 3) where the way is narrowest about, with less than NARROW at the
    sides.
    """
    n = len(poses)
    found = np.empty(n, np.int64)
    near, way = np.empty(n), np.zeros(n)
    for i in range(n):
        u, v = (poses[i, 0] - rules[ORIGIN_X]) / rules[RESOLUTION], (poses[i, 1] - rules[ORIGIN_Y]) / rules[RESOLUTION]
        near[i] = distance_at(field, u, v)
        if i:
            way[i] = way[i - 1] + math.hypot(poses[i, 0] - poses[i - 1, 0], poses[i, 1] - poses[i - 1, 1])
    count = 0
    for i in range(1, n - 1):
        if near[i] > inscribed + rules[NARROW]:
            continue
        least = True
        j = i - 1
        while j >= 0 and way[i] - way[j] < APART:
            least = least and near[j] >= near[i]
            j -= 1
        j = i + 1
        while j < n and way[j] - way[i] < APART:
            least = least and near[j] > near[i]
            j += 1
        if least:
            found[count] = i
            count += 1
    return found[:count].copy()


@kernel
def best_line(field, rules, outline, inside, x, y, yaw):
    """Return (x, y, yaw) of the best way straight through near a pose; yaw is NaN when none is free."""
    best, cx, cy, heading = np.inf, x, y, yaw
    rules = rules.copy()
    rules[RUN_UP_COST] = 0.0
    angle, aside, many = ANGLE, ASIDE, MANY
    for _ in range(3):
        x0, y0, yaw0 = cx, cy, heading
        for a in range(-many, many + 1):
            way = yaw0 + a * angle
            if abs(way - yaw) > MANY * ANGLE + 1e-6:
                continue
            c, s = math.cos(way), math.sin(way)
            for b in range(-many, many + 1):
                px, py = x0 - s * b * aside, y0 + c * b * aside
                seconds, _ = move(
                    field, rules, outline, inside, px - HALF * c, py - HALF * s, way, 2.0 * HALF, 0.0, rules[HARD]
                )
                if seconds < best - 1e-6:
                    best, cx, cy, heading = seconds, px, py, way
        if best == np.inf:
            return x, y, np.nan
        angle, aside, many = angle / 3.0, aside / 3.0, 3
    return cx, cy, heading


def with_gates(world, poses, moves, inscribed):
    """Return (poses (m, 3), moves (m, 2), follow (m,)): the way's poses with places before and behind narrow ones put
    among them.

    moves[i] leads from pose i of the way to pose follow[i], int64; that is -1 for the last, and for places put in.
    world: distances, rules, outline, inside. inscribed: radius, m.
    """
    put = {}
    for i in narrow_places(*world[:2], poses, inscribed).tolist():
        back = moves[min(i, len(moves) - 1), 0] < 0.0
        x, y, yaw = best_line(*world, *poses[i].tolist()[:2], float(poses[i, 2]) + (math.pi if back else 0.0))
        if math.isnan(yaw):
            continue
        along = np.array([math.cos(yaw), math.sin(yaw)])
        before, behind = put.setdefault(i, []), put.setdefault(i + 1, [])
        for way in PLACES[::-1]:
            before.append((*((x, y) - way * along), yaw + (math.pi if back else 0.0)))
        for way in PLACES:
            behind.append((*((x, y) + way * along), yaw + (math.pi if back else 0.0)))
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


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    rules, points, field = np.ones(ENTRIES), np.zeros((4, 2)), np.zeros((4, 4), np.float32)
    narrow_places(field, rules, np.ones((3, 3)), 0.1)
    best_line(field, rules, points, points, 1.0, 1.0, 0.0)
