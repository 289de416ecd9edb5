"""A way of many small moves becomes one of few long straight legs with turns between them.

Dynamic programming over the places of the way: each may be left straight, ahead or astern, for any later one, when the
body fits, by the same times that the search goes by. A place keeps the best arrival there is, and the best that ends in
the way's own yaw; from that the way itself always goes on, so that something is always found, arcs through tight bends
included.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.lattice.body import (
    BEND,
    ENTRIES,
    GEAR_COST,
    HARD,
    ORIGIN_X,
    ORIGIN_Y,
    RADIUS,
    RESOLUTION,
    REVERSE,
    SPEED,
    TURN_COST,
    TURN_RATE,
    arrive,
    move,
    turn_to,
)
from sara_nav.lattice.field import distance_at
from sara_nav.lattice.search import AHEAD, ASTERN, TURNS, sees

BITTY = 1.0
"""s that each of the way's own arcs and turns costs besides, so that legs take their place."""
LATE = 4.0
"""s; no arrival is kept that comes so much later than the one with the way's own yaw."""
APART, TIGHT_APART = 0.7, 0.35
"""m of way between places that legs join."""
OWN, ANY = 0, 1
"""Arrivals: with the way's own yaw, with whichever."""


@kernel
def straighten(
    field, rules, outline, inside, poses, moves, follow, anchors, limit, limit_end, radius, longest, astern_within
):
    """Return moves (m, 5) x, y, yaw, length, turn from the first to the last of the poses (n, 3).

    moves: (n, 2) length and turn from each pose to the pose follow[i], int64, of the way; that is -1 at its last pose,
    and at poses that are not on it but may be made use of. anchors: indices (int64) of the poses that legs may join,
    the first and the last among them. limit, limit_end: the gaps allowed at the first and the last pose. longest: m, of
    a leg; astern_within: m, of one astern.
    """
    n = len(poses)
    cost = np.full((n, 2), np.inf)
    yaw, limits = np.zeros((n, 2)), np.zeros((n, 2))
    kind = np.zeros((n, 2), np.int8)
    parent, label = np.full((n, 2), -1, np.int32), np.zeros((n, 2), np.int8)
    first, run, second = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2))
    cost[0, OWN], yaw[0, OWN], limits[0, OWN] = 0.0, poses[0, 2], limit
    allowed = towards_end(field, rules, outline, inside, poses, moves, follow, limit_end)
    taken = np.full(n, np.inf)
    i = 0
    while follow[i] >= 0:  # the way as it is, first, so that whatever takes longer need not be looked at
        next, length, turn = follow[i], moves[i, 0], moves[i, 1]
        if allowed[next] < rules[HARD]:
            seconds = arrive(
                field,
                rules,
                outline,
                inside,
                poses[next, 0],
                poses[next, 1],
                poses[next, 2],
                length,
                turn,
                allowed[next],
            )
            limits[next, OWN] = rules[HARD]
        else:
            seconds, limits[next, OWN] = move(
                field, rules, outline, inside, poses[i, 0], poses[i, 1], poses[i, 2], length, turn, limits[i, OWN]
            )
        what = TURNS if length == 0.0 else AHEAD if length > 0.0 else ASTERN
        kind[next, OWN] = kind[i, OWN] if what == TURNS else what
        taken[i] = seconds + (BITTY if turn != 0.0 else 0.0)
        cost[next, OWN], yaw[next, OWN] = cost[i, OWN] + taken[i] + gear(rules, kind[i, OWN], what), poses[next, 2]
        parent[next, OWN], label[next, OWN] = i, -1
        i = next
    k = 0
    for i in range(n - 1):
        x, y = poses[i, 0], poses[i, 1]
        next = follow[i]
        if next >= 0 and cost[i, OWN] < np.inf:
            what = TURNS if moves[i, 0] == 0.0 else AHEAD if moves[i, 0] > 0.0 else ASTERN
            total = cost[i, OWN] + taken[i] + gear(rules, kind[i, OWN], what)
            if total < cost[next, OWN]:
                cost[next, OWN] = total
                kind[next, OWN] = kind[i, OWN] if what == TURNS else what
                parent[next, OWN], label[next, OWN] = i, -1
        while anchors[k] < i:
            k += 1
        if anchors[k] != i:
            continue
        for ahead in range(k + 1, len(anchors)):
            j = anchors[ahead]
            if j == n - 1 and limit_end < rules[HARD]:
                continue
            gx, gy = poses[j, 0], poses[j, 1]
            length = math.hypot(gx - x, gy - y)
            if length > longest:
                continue
            if length < 0.02:
                continue
            soonest = min(cost[i, OWN], cost[i, ANY]) + length / rules[SPEED]
            if soonest >= cost[j, OWN] and soonest >= cost[j, ANY]:
                continue
            if not sees(field, rules, x, y, gx, gy, radius):
                continue
            bearing = math.atan2(gy - y, gx - x)
            for way in (1, -1):
                if way < 0 and length > astern_within:
                    continue
                heading = bearing if way > 0 else bearing + math.pi
                known = False
                for own in range(2):
                    if cost[i, own] == np.inf:
                        continue
                    about = abs(wrap(heading - yaw[i, own]))
                    least = (
                        cost[i, own]
                        + about / rules[TURN_RATE]
                        + rules[TURN_COST] * min(1.0, about / BEND)
                        + length / rules[SPEED] * (1.0 if way > 0 else rules[REVERSE])
                    )
                    if least >= cost[j, OWN] and (least >= cost[j, ANY] or least >= cost[j, OWN] + LATE):
                        continue
                    at, turn, after = turn_to(field, rules, outline, inside, x, y, yaw[i, own], heading, limits[i, own])
                    if at == np.inf:
                        continue
                    if not known or i == 0:
                        leg, arrived = move(field, rules, outline, inside, x, y, heading, way * length, 0.0, after)
                        known = True
                    if leg == np.inf:
                        break
                    what = AHEAD if way > 0 else ASTERN
                    total = cost[i, own] + at + leg + gear(rules, kind[i, own], what)
                    if total < cost[j, ANY] and j < n - 1:
                        cost[j, ANY], yaw[j, ANY], limits[j, ANY], kind[j, ANY] = total, heading, arrived, what
                        parent[j, ANY], label[j, ANY] = i, own
                        first[j, ANY], run[j, ANY], second[j, ANY] = turn, way * length, 0.0
                    if total < cost[j, OWN]:
                        there, back, last = turn_to(
                            field, rules, outline, inside, gx, gy, heading, poses[j, 2], arrived
                        )
                        if total + there < cost[j, OWN]:
                            cost[j, OWN], yaw[j, OWN], limits[j, OWN] = total + there, poses[j, 2], last
                            kind[j, OWN], parent[j, OWN], label[j, OWN] = what, i, own
                            first[j, OWN], run[j, OWN], second[j, OWN] = turn, way * length, back
    return trace(poses, moves, yaw, parent, label, first, run, second, cost[n - 1, OWN])


@kernel
def anchors_of(field, rules, poses, follow):
    """Return the indices (int64) of the poses that legs are to join: first, last, and some between, nearer where it is
    tight, with all that are not on the way.
    """
    n = len(poses)
    chosen = np.empty(n, np.int64)
    chosen[0], count, way, last = 0, 1, 0.0, 0
    for i in range(1, n):
        step = math.hypot(poses[i, 0] - poses[last, 0], poses[i, 1] - poses[last, 1])
        if follow[i] >= 0 or i == n - 1:
            way, last = way + step, i
        u, v = (poses[i, 0] - rules[ORIGIN_X]) / rules[RESOLUTION], (poses[i, 1] - rules[ORIGIN_Y]) / rules[RESOLUTION]
        apart = TIGHT_APART if distance_at(field, u, v) < rules[RADIUS] else APART
        if i == n - 1 or follow[i] < 0 or (way >= apart - 1e-6 and step > 0.0):
            chosen[count], count = i, count + 1
            way = 0.0 if follow[i] >= 0 else way
    return chosen[:count].copy()


@kernel
def towards_end(field, rules, outline, inside, poses, moves, follow, limit_end):
    """Return the gap (n,) that the way is allowed at each of its poses because it ends so near to something: HARD but
    for the last.
    """
    n = len(poses)
    allowed = np.full(n, rules[HARD])
    allowed[n - 1] = limit_end
    at = n - 1
    for i in range(n - 2, -1, -1):
        if follow[i] == at:
            if allowed[at] < rules[HARD]:
                _, allowed[i] = move(
                    field,
                    rules,
                    outline,
                    inside,
                    poses[at, 0],
                    poses[at, 1],
                    poses[at, 2],
                    -moves[i, 0],
                    -moves[i, 1],
                    allowed[at],
                )
            at = i
    return allowed


@kernel
def gear(rules, before, now):
    """Return what it costs (s) that the last drive was one way and this is the other."""
    return rules[GEAR_COST] if before != TURNS and now != TURNS and before != now else 0.0


@kernel
def trace(poses, moves, yaw, parent, label, first, run, second, cost):
    """Return the moves (m, 5) that lead to the last pose; none when nothing does."""
    n = len(poses)
    if cost == np.inf:
        return np.empty((0, 5))
    steps = np.empty((3 * n, 5))
    m = 3 * n
    j, own = n - 1, OWN
    while j > 0:
        i, was = parent[j, own], label[j, own]
        if was < 0:
            m -= 1
            steps[m] = np.array([poses[i, 0], poses[i, 1], poses[i, 2], moves[i, 0], moves[i, 1]])
            j, own = i, OWN
            continue
        start = yaw[i, was]
        heading = start + first[j, own]
        if second[j, own] != 0.0:
            m -= 1
            steps[m] = np.array([poses[j, 0], poses[j, 1], heading, 0.0, second[j, own]])
        m -= 1
        steps[m] = np.array([poses[i, 0], poses[i, 1], heading, run[j, own], 0.0])
        if first[j, own] != 0.0:
            m -= 1
            steps[m] = np.array([poses[i, 0], poses[i, 1], start, 0.0, first[j, own]])
        j, own = i, was
    return steps[m:].copy()


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    rules, points = np.ones(ENTRIES), np.zeros((4, 2))
    anchors_of(np.zeros((4, 4), np.float32), rules, np.ones((2, 3)), np.array([1, -1]))
    straighten(
        np.zeros((4, 4), np.float32),
        rules,
        points,
        points,
        np.ones((2, 3)),
        np.zeros((2, 2)),
        np.array([1, -1]),
        np.array([0, 1]),
        0.0,
        0.0,
        0.1,
        5.0,
        1.0,
    )
