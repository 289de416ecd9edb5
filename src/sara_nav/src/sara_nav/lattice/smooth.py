"""Corners of a way are moved where the way takes less time, left out where they are not needed, and rounded where there
is room.

Moving them is coordinate descent: each corner in turn tries eight places about it, in smaller and smaller steps. As
moves take longer the nearer the body comes to something, legs come to lie in the middle of doors and square to them.
Only corners between two straight legs are touched; arcs that the search needed stay, and so does what begins or ends
nearer to an obstacle than the margin.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.lattice.body import BEND, ENTRIES, HARD, SPEED, TURN_RATE, move, place, turn_to

STEPS = (0.32, 0.16, 0.08, 0.04)
"""m, by which corners are moved."""
SWEEPS = 3
RADII = (2.0, 1.5, 1.0, 0.75, 0.5)
"""m, of rounded corners; the greatest that fits is taken."""
LEAST_TURN = 1e-3
STRAIGHT_END = 0.3
"""m of the first and of the last leg that are not rounded off."""


@kernel
def leg(field, rules, outline, inside, ax, ay, bx, by, way, before, bound):
    """Return (seconds, heading) of turning at a from ``before`` (rad) and going straight to b, ahead (way 1) or astern
    (-1).

    Seconds are inf as soon as they exceed ``bound``.
    """
    length = math.hypot(bx - ax, by - ay)
    if length < 0.02:
        return np.inf, 0.0
    heading = math.atan2(by - ay, bx - ax) + (0.0 if way > 0.0 else math.pi)
    if length / rules[SPEED] > bound:
        return np.inf, heading
    seconds, _, _ = turn_to(field, rules, outline, inside, ax, ay, before, heading, rules[HARD])
    if seconds > bound:
        return np.inf, heading
    going, _ = move(field, rules, outline, inside, ax, ay, heading, way * length, 0.0, rules[HARD])
    return seconds + going, heading


@kernel
def by_way_of(field, rules, outline, inside, a, x, y, b, ways, before, after, bound):
    """Return the seconds from a over (x, y) to b, with the turns from yaw ``before`` and to yaw ``after``; inf beyond
    ``bound``.
    """
    first, heading = leg(field, rules, outline, inside, a[0], a[1], x, y, ways[0], before, bound)
    if first > bound:
        return np.inf
    second, heading = leg(field, rules, outline, inside, x, y, b[0], b[1], ways[1], heading, bound - first)
    if first + second > bound:
        return np.inf
    third, _, _ = turn_to(field, rules, outline, inside, b[0], b[1], heading, after, rules[HARD])
    return first + second + third


@kernel
def relax(field, rules, outline, inside, moves, yaws):
    """Return moves (m, 5) x, y, yaw, length, turn without turns in place, which follow from the yaws, after moving
    corners.

    moves: (n, 5), none of them a turn in place. yaws: those at the start and at the goal (2,).
    """
    n = len(moves)
    moves = moves.copy()
    ends = np.empty((n, 2))
    for k in range(n):
        chord = moves[k, 3] * (1.0 if abs(moves[k, 4]) < 1e-9 else math.sin(0.5 * moves[k, 4]) / (0.5 * moves[k, 4]))
        heading = moves[k, 2] + 0.5 * moves[k, 4]
        ends[k, 0], ends[k, 1] = moves[k, 0] + chord * math.cos(heading), moves[k, 1] + chord * math.sin(heading)
    ways = np.empty(2)
    for size in STEPS:
        for _ in range(SWEEPS):
            better = False
            k = 1
            while k < n:
                if moves[k, 4] != 0.0 or moves[k - 1, 4] != 0.0:
                    k += 1
                    continue
                before = yaws[0] if k == 1 else moves[k - 2, 2] + moves[k - 2, 4]
                after = yaws[1] if k == n - 1 else moves[k + 1, 2]
                ways[0], ways[1] = math.copysign(1.0, moves[k - 1, 3]), math.copysign(1.0, moves[k, 3])
                a, b = moves[k - 1, :2], ends[k]
                x, y = moves[k, 0], moves[k, 1]
                best = by_way_of(field, rules, outline, inside, a, x, y, b, ways, before, after, np.inf)
                if ways[0] == ways[1]:
                    direct, heading = leg(field, rules, outline, inside, a[0], a[1], b[0], b[1], ways[0], before, best)
                    if direct < best:
                        direct += turn_to(field, rules, outline, inside, b[0], b[1], heading, after, rules[HARD])[0]
                    if direct <= best and direct < np.inf:
                        ends[k - 1, 0], ends[k - 1, 1] = b[0], b[1]
                        moves[k - 1, 2] = heading
                        moves[k - 1, 3] = ways[0] * math.hypot(b[0] - a[0], b[1] - a[1])
                        for m in range(k, n - 1):
                            moves[m], ends[m] = moves[m + 1], ends[m + 1]
                        n -= 1
                        better = True
                        continue
                to_x, to_y = x, y
                for side in range(8):
                    px, py = x + size * math.cos(side * math.pi / 4.0), y + size * math.sin(side * math.pi / 4.0)
                    seconds = by_way_of(field, rules, outline, inside, a, px, py, b, ways, before, after, best - 1e-3)
                    if seconds < best - 1e-3:
                        best, to_x, to_y = seconds, px, py
                if to_x != x or to_y != y:
                    better = True
                    for m, ax, ay, bx, by in ((k - 1, a[0], a[1], to_x, to_y), (k, to_x, to_y, b[0], b[1])):
                        way = ways[m - k + 1]
                        moves[m, 0], moves[m, 1], ends[m, 0], ends[m, 1] = ax, ay, bx, by
                        moves[m, 2] = math.atan2(by - ay, bx - ax) + (0.0 if way > 0.0 else math.pi)
                        moves[m, 3] = way * math.hypot(bx - ax, by - ay)
                k += 1
            if not better:
                break
    return moves[:n].copy()


@kernel
def rounded(field, rules, outline, inside, moves):
    """Return moves (m, 5) with an arc in place of each turn between two legs one way, where there is room for it.

    moves: (n, 5) without turns in place. A turn of over BEND is rounded only where nothing slows the arc by much.
    """
    n = len(moves)
    result = np.empty((2 * n, 5))
    count = 0
    moves = moves.copy()
    for k in range(n):
        result[count] = moves[k]
        count += 1
        if k == n - 1 or moves[k, 4] != 0.0 or moves[k + 1, 4] != 0.0 or moves[k, 3] * moves[k + 1, 3] <= 0.0:
            continue
        turn = wrap(moves[k + 1, 2] - moves[k, 2])
        if abs(turn) < LEAST_TURN or abs(turn) > 2.6:
            continue
        way = math.copysign(1.0, moves[k, 3])
        # What is left of this leg, and half of the next, but for the ends.
        mine = abs(moves[k, 3]) - (STRAIGHT_END if k == 0 else 0.02)
        other = abs(moves[k + 1, 3]) - STRAIGHT_END if k == n - 2 else 0.5 * abs(moves[k + 1, 3])
        tangent = math.tan(0.5 * abs(turn))
        for radius in RADII:
            cut = radius * tangent
            if cut > min(mine, other):
                continue
            x = moves[k + 1, 0] - way * cut * math.cos(moves[k, 2])
            y = moves[k + 1, 1] - way * cut * math.sin(moves[k, 2])
            length = way * radius * abs(turn)
            seconds, _ = move(field, rules, outline, inside, x, y, moves[k, 2], length, turn, rules[HARD])
            if seconds == np.inf:
                continue
            if abs(turn) > BEND and seconds > 1.15 * max(abs(length) / rules[SPEED], abs(turn) / rules[TURN_RATE]):
                continue
            result[count - 1, 3] -= way * cut
            result[count, 0], result[count, 1], result[count, 2] = x, y, moves[k, 2]
            result[count, 3], result[count, 4] = length, turn
            count += 1
            moves[k + 1, 0] += way * cut * math.cos(moves[k + 1, 2])
            moves[k + 1, 1] += way * cut * math.sin(moves[k + 1, 2])
            moves[k + 1, 3] -= way * cut
            break
    return result[:count].copy()


@kernel
def with_turns(field, rules, outline, inside, moves, start, goal):
    """Return moves (m, 5) with the turns in place that lie between them, from the pose ``start`` (3,) to the pose
    ``goal`` (3,).
    """
    n = len(moves)
    result = np.empty((2 * n + 1, 5))
    count, yaw, x, y = 0, start[2], start[0], start[1]
    for k in range(n + 1):
        if k < n:
            x, y, target = moves[k, 0], moves[k, 1], moves[k, 2]
        else:
            x, y, target = goal[0], goal[1], goal[2]
        _, turn, _ = turn_to(field, rules, outline, inside, x, y, yaw, target, rules[HARD])
        if abs(turn) >= LEAST_TURN:
            result[count, 0], result[count, 1], result[count, 2], result[count, 3], result[count, 4] = (
                x,
                y,
                yaw,
                0.0,
                turn,
            )
            count += 1
        if k < n:
            result[count] = moves[k]
            yaw = moves[k, 2] + moves[k, 4]
            count += 1
    return result[:count].copy()


def smooth(world, steps, start, goal, limit, limit_end):
    """Return moves (m, 5) that take less time than ``steps`` (n, 5); both from a pose (3,) to a pose (3,).

    world: distances, rules, outline, inside. limit, limit_end: the gaps allowed at the start and at the goal, m. What
    begins or ends nearer to something than the margin stays as it is.
    """
    hard, first, last = world[1][HARD], 0, len(steps)
    while first < last and limit < hard:
        _, limit = move(*world, *steps[first].tolist(), limit)
        start = place(*steps[first].tolist(), 1.0)
        first += 1
    while last > first and limit_end < hard:
        last -= 1
        x, y, yaw, length, turn = steps[last].tolist()
        _, limit_end = move(*world, *place(x, y, yaw, length, turn, 1.0), -length, -turn, limit_end)
        goal = x, y, yaw
    moves = np.ascontiguousarray(steps[first:last][steps[first:last, 3] != 0.0])
    if len(moves) == 0:
        return steps
    start, goal = np.array(start), np.array(goal)
    moves = rounded(*world, relax(*world, moves, np.array([start[2], goal[2]])))
    return np.vstack([steps[:first], with_turns(*world, moves, start, goal), steps[last:]])


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    rules, points, pose = np.ones(ENTRIES), np.zeros((4, 2)), np.ones(3)
    world = np.zeros((4, 4), np.float32), rules, points, points
    moves = np.ones((2, 5))
    relax(*world, moves, np.zeros(2))
    rounded(*world, moves)
    with_turns(*world, moves, pose, pose)
