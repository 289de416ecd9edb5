"""A search for moves of an oriented body from a pose to a pose: hybrid A* over straights, arcs and turns in place.

After Dolgov, Thrun, Montemerlo and Diebel (2010): states are exact poses, of which each cell of position and heading
keeps the best; a node is joined to the goal analytically where that is free. A differential drive's analytic way is
turn, straight, turn. Turns end on multiples of STEP; where it is too tight for them there are arcs so slight that the
body leaves a wall that it stands along without swinging its tail into it. Cells and steps are finer where it is tight.
The order is weighted A*'s (Pohl 1970): the time so far plus ``greed`` times what the wave says is left. The wave knows
of no turns, so the way found is a good one to make straight, no more.
"""

import heapq
import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.lattice.body import (
    CAP,
    ENTRIES,
    GEAR_COST,
    HARD,
    ORIGIN_X,
    ORIGIN_Y,
    RADIUS,
    RESOLUTION,
    SPEED,
    TURN_COST,
    gap,
    move,
    turn_to,
)
from sara_nav.lattice.field import distance_at

STEP = 2.0 * math.pi / 32.0
"""rad between the headings that turns end on."""
FINE_HEADINGS = 512
FINE_STEP = 2.0 * math.pi / FINE_HEADINGS
"""rad between headings that are told apart where it is tight; elsewhere sixteen times that."""
FOUND, NO_WAY, GAVE_UP = 0, 1, 2
FAR = 1e9
BESIDE = 0.08
"""m; with a gap of less than that the slight arcs are tried."""
TURNS, AHEAD, ASTERN = 0, 1, 2
"""What a move is."""


@kernel
def left_at(wave, rules, field, escape, x, y):
    """Return the time (s) the wave says is left at a point (m), FAR where it did not come.

    escape: m; where that is not negative, the time to where a turn about has so much room, at least: distances grow no
    faster than one goes.
    """
    u, v = (x - rules[ORIGIN_X]) / rules[RESOLUTION], (y - rules[ORIGIN_Y]) / rules[RESOLUTION]
    if escape >= 0.0:
        return max(0.0, rules[RADIUS] + escape - distance_at(field, u, v)) / rules[SPEED]
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
def sees(field, rules, x0, y0, x1, y1, radius):
    """True when a circle of ``radius`` (m) can go straight from one point to the other."""
    length = math.hypot(x1 - x0, y1 - y0)
    if length < 1e-9:
        return True
    scale, done = 1.0 / rules[RESOLUTION], 0.0
    while done < length:
        x, y = x0 + (x1 - x0) * done / length, y0 + (y1 - y0) * done / length
        d = distance_at(field, (x - rules[ORIGIN_X]) * scale, (y - rules[ORIGIN_Y]) * scale) - radius
        if d < 0.0:
            return False
        done += max(d, 0.5 * rules[RESOLUTION])
    return True


@kernel
def join(field, rules, outline, inside, x, y, yaw, last, limit, gx, gy, gyaw, way):
    """Return (seconds, first turn, length, second turn) from a pose to a pose by turn, straight, turn; inf where that
    is not free.

    way: 1 ahead, -1 astern. last: what the move before was, for the cost of changing gear.
    """
    length = math.hypot(gx - x, gy - y)
    if length < 1e-3:
        seconds, turn, _ = turn_to(field, rules, outline, inside, x, y, yaw, gyaw, limit)
        return seconds, turn, 0.0, 0.0
    heading = math.atan2(gy - y, gx - x) + (0.0 if way > 0 else math.pi)
    first, turn, limit = turn_to(field, rules, outline, inside, x, y, yaw, heading, limit)
    if first == np.inf:
        return np.inf, 0.0, 0.0, 0.0
    straight, limit = move(field, rules, outline, inside, x, y, heading, way * length, 0.0, limit)
    if straight == np.inf:
        return np.inf, 0.0, 0.0, 0.0
    second, back, _ = turn_to(field, rules, outline, inside, gx, gy, heading, gyaw, limit)
    if (way > 0 and last == ASTERN) or (way < 0 and last == AHEAD):
        second += rules[GEAR_COST]
    return first + straight + second, turn, way * length, back


@kernel
def slot_of(keys, key):
    """Return the place of a key in an open-addressed table whose empty places hold -1."""
    mask = np.uint64(len(keys) - 1)
    at = (np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(20)
    at &= mask
    while keys[at] != -1 and keys[at] != key:
        at = (at + np.uint64(1)) & mask
    return at


@kernel
def search(field, wave, rules, outline, inside, start, limit, ends, radius, greed, most, escape):
    """Return (status, expanded, moves (n, 5), final): moves are x, y, yaw at their beginning, length, turn; the last is
    no move but a pose, from which ``final`` tells how the way is joined to the goal: (node, 1 ahead or -1 astern,
    number of the end).

    start: (x, y, yaw). limit: the gap allowed there (see move). ends (m, 4): x, y, yaw and the seconds from there to
    the goal. radius: m, of the circle that must see an end before it is joined. most: states expanded before the search
    gives up. escape: m; where that is not negative, any pose that has so much room round the circle that turning about
    sweeps ends the search, in place of ``ends``.
    """
    room = 6 * most + 16
    x, y, yaw = np.empty(room), np.empty(room), np.empty(room)
    spent, limits = np.empty(room), np.empty(room)
    length, turned = np.empty(room), np.empty(room)
    parent, index, kind = np.empty(room, np.int32), np.empty(room, np.int16), np.empty(room, np.int8)
    size = 1
    while size < 8 * most:
        size *= 2
    keys, best = np.full(size, -1, np.int64), np.empty(size, np.float32)
    final = np.zeros((64, 3))  # node, ahead or astern, end
    finals, count = 0, 1
    none = np.empty((0, 5))
    x[0], y[0], yaw[0] = start[0], start[1], start[2]
    spent[0], limits[0], parent[0], index[0], kind[0], length[0], turned[0] = 0.0, limit, -1, 0, TURNS, 0.0, 0.0
    index[0] = np.int16(round(yaw[0] / FINE_STEP)) % FINE_HEADINGS
    left = left_at(wave, rules, field, escape, x[0], y[0])
    heap = [(greed * min(left, FAR), 0)]
    scale = 1.0 / rules[RESOLUTION]
    expanded, joined = 0, 0
    incumbent = np.inf
    while len(heap) > 0:
        _, n = heapq.heappop(heap)
        if n < 0:  # an end is the best of what waits
            number = -n - 1
            return FOUND, expanded, trace(x, y, yaw, length, turned, parent, int(final[number, 0])), final[number]
        px, py, pyaw = x[n], y[n], yaw[n]
        u, v = (px - rules[ORIGIN_X]) * scale, (py - rules[ORIGIN_Y]) * scale
        d = distance_at(field, u, v)
        open_space = d > rules[RADIUS] + rules[CAP]
        key = key_of(u, v, index[n], d, rules)
        at = slot_of(keys, key)
        if keys[at] == key and best[at] < spent[n] - 1e-4:
            continue
        if escape >= 0.0 and d >= rules[RADIUS] + escape:
            return FOUND, expanded, trace(x, y, yaw, length, turned, parent, n), final[0]
        if expanded >= most:
            return GAVE_UP, expanded, none, final[0]
        expanded += 1
        left = left_at(wave, rules, field, escape, px, py)
        joined -= 1
        if joined <= 0 and finals < 60:
            joined = max(1, min(20, int(0.25 * left)), expanded // 50)
            for e in range(len(ends)):
                if not sees(field, rules, px, py, ends[e, 0], ends[e, 1], radius):
                    continue
                for way in (1, -1):
                    if way < 0 and math.hypot(px - ends[e, 0], py - ends[e, 1]) > 3.0:
                        continue
                    seconds, _, _, _ = join(
                        field,
                        rules,
                        outline,
                        inside,
                        px,
                        py,
                        pyaw,
                        kind[n],
                        limits[n],
                        ends[e, 0],
                        ends[e, 1],
                        ends[e, 2],
                        way,
                    )
                    total = spent[n] + seconds + ends[e, 3]
                    if total < incumbent - 1e-6 and finals < 60:
                        incumbent = total
                        final[finals, 0], final[finals, 1], final[finals, 2] = n, way, e
                        finals += 1
                        heapq.heappush(heap, (total, -finals))
        stride = 0.5 if open_space else 0.2
        own = n == 0 or index[n] % (FINE_HEADINGS // 32) != 0  # no turn of the lattice was possible yet
        tight = (
            own and d < rules[RADIUS] + BESIDE and gap(field, rules, outline, inside, px, py, pyaw, limits[n]) < BESIDE
        )
        for option in range(20 if tight else 12):
            run, turn = option_of(option, pyaw, stride)
            if option < 2 and kind[n] == TURNS and turned[n] * turn < 0.0:
                continue
            if turn == 0.0 and run == 0.0:
                continue
            what = TURNS if run == 0.0 else AHEAD if run > 0.0 else ASTERN
            extra = 0.0
            if what == TURNS:
                if kind[n] != TURNS or n == 0:
                    extra = rules[TURN_COST]
            elif (what == AHEAD and kind[n] == ASTERN) or (what == ASTERN and kind[n] == AHEAD):
                extra = rules[GEAR_COST]
            chord = run if abs(turn) < 1e-9 else run * math.sin(0.5 * turn) / (0.5 * turn)
            nx, ny = px + chord * math.cos(pyaw + 0.5 * turn), py + chord * math.sin(pyaw + 0.5 * turn)
            nyaw = pyaw + turn
            heading = np.int16(round(nyaw / FINE_STEP)) % FINE_HEADINGS
            nu, nv = (nx - rules[ORIGIN_X]) * scale, (ny - rules[ORIGIN_Y]) * scale
            key = key_of(nu, nv, heading, distance_at(field, nu, nv), rules)
            at = slot_of(keys, key)
            known = best[at] if keys[at] == key else np.inf
            least = (
                spent[n] + extra + abs(run) / rules[SPEED]
            )  # before looking whether the body fits, which takes longest
            if known <= least + 1e-4:
                continue
            left = left_at(wave, rules, field, escape, nx, ny)
            if least + left >= incumbent:
                continue
            seconds, after = move(field, rules, outline, inside, px, py, pyaw, run, turn, limits[n])
            if seconds == np.inf or (left >= FAR and after >= rules[HARD]):
                continue
            total = spent[n] + extra + seconds
            if known <= total + 1e-4 or total + left >= incumbent:
                continue
            if count >= room:
                return GAVE_UP, expanded, none, final[0]
            keys[at], best[at] = key, total
            x[count], y[count], yaw[count] = nx, ny, wrap(nyaw)
            spent[count], limits[count], parent[count], index[count], kind[count] = total, after, n, heading, what
            length[count], turned[count] = run, turn
            heapq.heappush(heap, (total + greed * min(left, FAR), count))
            count += 1
    return NO_WAY, expanded, none, final[0]


@kernel
def key_of(u, v, heading, distance, rules):
    """Return the number of the cell of a state: 0.05, 0.1 or 0.25 m wide by how much room there is about it; heading in
    FINE_STEPs.
    """
    spare = distance - rules[RADIUS]
    level = 2 if spare > rules[CAP] else 1 if spare > 0.1 else 0
    size = 0.25 if level == 2 else 0.1 if level == 1 else 0.05
    if spare > rules[HARD]:
        heading = ((heading + 8) // 16) % 32
    share = rules[RESOLUTION] / size
    return ((np.int64(v * share) * 1000003 + np.int64(u * share)) * FINE_HEADINGS + heading) * 4 + level


@kernel
def option_of(option, yaw, stride):
    """Return (length m, turn rad) of one of twenty moves: turns, straights, arcs of about 1 m and 0.5 m, of 10 and 20
    m.
    """
    if option == 2:
        return stride, 0.0
    if option == 3:
        return -0.2, 0.0
    side = 1 if option % 2 == 0 else -1
    if option >= 12:
        return 0.5 if option < 16 else -0.5, side * (0.05 if option % 4 < 2 else 0.025)
    steps = 2 if option in (6, 7, 10, 11) else 1
    nearest = round(yaw / STEP) * STEP
    turn = nearest - yaw + side * steps * STEP
    if (
        abs(nearest - yaw) > 0.02 and side * (nearest - yaw) > 0.0
    ):  # off the lattice's headings: the next one counts as a step
        turn -= side * STEP
    if option < 2:
        return 0.0, turn
    return (max(0.2, 0.5 * stride) if option < 8 else -0.2), turn


@kernel
def trace(x, y, yaw, length, turned, parent, last):
    """Return the moves (n, 5) from the start to a node, and as one more row, with no move, the node itself."""
    n, at = 0, last
    while parent[at] >= 0:
        n += 1
        at = parent[at]
    moves = np.zeros((n + 1, 5))
    moves[n, 0], moves[n, 1], moves[n, 2] = x[last], y[last], yaw[last]
    at = last
    for k in range(n - 1, -1, -1):
        before = parent[at]
        moves[k, 0], moves[k, 1], moves[k, 2] = x[before], y[before], yaw[before]
        moves[k, 3], moves[k, 4] = length[at], turned[at]
        at = before
    return moves


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    rules, points = np.ones(ENTRIES), np.zeros((4, 2))
    field, wave = np.zeros((4, 4), np.float32), np.zeros((4, 4), np.float32)
    search(field, wave, rules, points, points, np.zeros(3), 0.0, np.zeros((1, 4)), 0.1, 1.5, 10, -1.0)
    join(field, rules, points, points, 1.0, 1.0, 0.0, 0, 0.0, 1.0, 1.5, 0.0, 1)
