"""A search over x, y and heading for moves that take the body to a goal in the least time: hybrid A* (Dolgov, Thrun,
Montemerlo and Diebel 2010) whose cost is the time at the limits, a stop charged with what it costs.

States are exact poses; each cell keeps the best of each kind of move. Cells are 0.05, 0.1 or 0.2 m wide by how much
room there is, and one of the map's headings high. States are joined to the goal (joins.py) now and then.
"""

from __future__ import annotations

import heapq
import math

import numpy as np

from ahead_of_time import kernel
from sara_lab.ideal.joins import JOINS, RADII, cost_of, free_along
from sara_lab.ideal.moves import Limits, Space, after, change, example, passes, seconds_of
from sara_nav.lattice.dubins import dubins_join
from sara_nav.lattice.moves import kind_of
from sara_nav.lattice.tree import slot_of

OPTIONS = 22
"""Moves that are tried from a state."""
MOST = 400_000
"""States kept until the search gives up."""
FAR = 1e6
WIDE, ROOMY = 1.2, 0.7
"""m of room from which on cells are coarser."""


@kernel
def seconds_left(space: Space, x: float, y: float, speed: float, radius: float) -> np.ndarray:
    """(rows, columns) float32: s to a point (m) at that speed for a disc of that radius (m); FAR where none leads."""
    rows, columns = space.room.shape
    left = np.full((rows, columns), np.float32(FAR))
    row, column = int((y - space.y) / space.size), int((x - space.x) / space.size)
    left[row, column] = 0.0
    heap = [(0.0, row, column)]
    while len(heap) > 0:
        so_far, row, column = heapq.heappop(heap)
        if so_far > left[row, column] + 1e-4:
            continue
        for i in range(-2, 3):
            for j in range(-2, 3):
                if max(abs(i), abs(j)) == 2 and (i * i + j * j) != 5 or i == 0 and j == 0:
                    continue  # steps along the axes, the diagonals, and as knights
                r, c = row + i, column + j
                if not (0 <= r < rows and 0 <= c < columns) or space.room[r, c] < radius:
                    continue
                total = so_far + space.size * math.hypot(i, j) / speed
                if total < left[r, c] - 1e-4:
                    left[r, c] = total
                    heapq.heappush(heap, (total, r, c))
    return left


@kernel
def option_of(option: int, step: float, level: int) -> tuple[float, float]:
    """(length m, turn rad) of one of the OPTIONS; step: rad between headings, level: of the cells."""
    far = 1.0 + level
    if option < 4:
        return 0.0, (step if option < 2 else 4.0 * step) * (1.0 if option % 2 == 0 else -1.0)
    if option < 6:
        return (0.1 if option == 4 else -0.1) * far, 0.0
    sense = 1.0 if option % 2 == 0 else -1.0
    side = 1.0 if (option // 2) % 2 == 0 else -1.0
    which = (option - 6) // 4
    if which == 0:
        return sense * 1.6 * far * step, side * far * step
    if which == 1:
        return sense * 1.6 * step, side * 2.0 * step
    if which == 2:
        return sense * 2.0 * step, side * 4.0 * step
    return sense * step, side * 4.0 * step


@kernel
def key_of(space: Space, x: float, y: float, yaw: float, kind: int) -> tuple[int, int]:
    """(number of the cell of a state, its level)."""
    u, v = (x - space.x) / space.size, (y - space.y) / space.size
    room = space.room[int(v), int(u)]
    level = 2 if room > WIDE else 1 if room > ROOMY else 0
    size, headings = 4 if level == 2 else 1 + level, len(space.free)
    heading = int(round(yaw * headings / (2.0 * math.pi))) % headings
    cell = np.int64(int(v / size)) * 100003 + np.int64(int(u / size))
    return ((cell * headings + heading) * 3 + kind) * 3 + level, level


@kernel
def search(space: Space, limits: Limits, ends: np.ndarray, left: np.ndarray, charge: float, greed: float) -> np.ndarray:
    """Moves (n, 2) from the first to the second of two poses `ends` (2, 3); none (0, 2) where no way was found.

    `left`: s from everywhere, see seconds_left. `charge`: share of what stops cost. `greed`: weight of `left`.
    """
    states = np.empty((MOST, 7))  # x, y, yaw, s so far, length and turn that led there, kind
    parents = np.full(MOST, -1, np.int64)
    keys, best = np.full(1 << 21, -1, np.int64), np.empty(1 << 21)
    states[0, :3], states[0, 3:] = ends[0], 0.0
    states[0, 6] = -1
    heap, count, step = [(0.0, 0)], 1, 2.0 * math.pi / len(space.free)
    found, joint, joined, wait = np.inf, np.empty((3, 2)), -1, 0
    while len(heap) > 0 and count < MOST - 30:
        order, n = heapq.heappop(heap)
        if order >= found:
            break
        x, y, yaw, spent, kind = states[n, 0], states[n, 1], states[n, 2], states[n, 3], int(states[n, 6])
        key, level = key_of(space, x, y, yaw, max(kind, 0))
        at = slot_of(keys, key)
        if keys[at] == key and best[at] < spent - 1e-6:
            continue
        wait -= 1
        if wait <= 0:
            seconds, number = best_join(space, limits, states[n], ends[1], charge, found - spent)
            if number >= 0:
                found, joined = spent + seconds, n
                dubins_join(number, states[n], ends[1], RADII, joint)
            wait = int(2.0 + 2.0 * left[int((y - space.y) / space.size), int((x - space.x) / space.size)])
        for option in range(OPTIONS):
            length, turn = option_of(option, step, level)
            if kind == 0 and length == 0.0 and turn * states[n, 5] < 0.0:
                continue
            now = kind_of(length)
            total = spent + charge * change(limits, kind, now) + seconds_of(limits, length, turn)
            to = after(x, y, yaw, length, turn)
            row, column = int((to[1] - space.y) / space.size), int((to[0] - space.x) / space.size)
            if not (0 <= row < left.shape[0] and 0 <= column < left.shape[1]):
                continue
            order = total + greed * left[row, column]
            if order >= found:
                continue
            key, _ = key_of(space, to[0], to[1], to[2], now)
            at = slot_of(keys, key)
            if keys[at] == key and best[at] <= total + 1e-6 or not passes(space, x, y, yaw, length, turn):
                continue
            keys[at], best[at] = key, total
            states[count, 0], states[count, 1], states[count, 2] = to
            states[count, 3], states[count, 4], states[count, 5], states[count, 6] = total, length, turn, now
            parents[count] = n
            heapq.heappush(heap, (order, count))
            count += 1
    return _traced(states, parents, joined, joint)


@kernel
def _traced(states, parents, last, joint):
    """The moves that led to a state, and the three from there."""
    if last < 0:
        return np.empty((0, 2))
    count, at = 0, last
    while parents[at] >= 0:
        count, at = count + 1, parents[at]
    moves, at = np.empty((count + 3, 2)), last
    for k in range(count - 1, -1, -1):
        moves[k] = states[at, 4:6]
        at = parents[at]
    moves[count:] = joint
    return moves


@kernel
def best_join(
    space: Space, limits: Limits, state: np.ndarray, end: np.ndarray, charge: float, bound: float
) -> tuple[float, int]:
    """(s, number) of the fastest free join of a state with a pose, from its kind to rest; (bound, -1): none is faster
    than `bound`.
    """
    moves, which = np.empty((3, 2)), -1
    for number in range(JOINS):
        if not dubins_join(number, state, end, RADII, moves):
            continue
        seconds, kind = cost_of(moves, limits, int(state[6]), charge)
        seconds += charge * change(limits, kind, -1)
        if seconds < bound - 1e-6 and free_along(moves, space, state):
            bound, which = seconds, number
    return bound, which


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    space, limits = example()
    left = seconds_left(space, 0.2, 0.2, limits.ahead, 0.1)
    search(space, limits, np.full((2, 3), 0.2), left, 1.0, 1.0)
