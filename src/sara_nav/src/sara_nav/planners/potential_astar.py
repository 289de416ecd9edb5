"""The wave of potential.py drawn towards the goal: A* (Hart, Nilsson, Raphael 1968) in place of Dijkstra.

A cell's turn comes by its potential plus WEIGHT times the least that driving on to the goal can cost (the straight line
over free cells). With the weight over 1, cells that can only lead to a way about as good as the one under study are
left alone; the way found may cost that share more, and costs a good percent more at the most (test_plans_reference).
Cells wait in a ring of lists by that sum, WIDTH wide each: a bucket queue (Dial 1969). Within a list first come, first
served. Arrays as in potential.py.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.planners.potential import INVERSE_ROOT_2, Field, plane_wave

WEIGHT = 1.12
LISTS = 64
"""Lists in the ring, a power of two: a cell is never put further ahead than LISTS x WIDTH, some three times the
dearest step.
"""
WIDTH = 14.0
CALLED = 4
"""Neighbours that a cell may call up at most."""
SLIGHT = np.float32(4.0)
"""Potential by which a cell must come lower to be worth telling its neighbours: a small share of the least step."""


class Ring(NamedTuple):
    """The lists that cells wait in."""

    waiting: np.ndarray
    """uint32 (LISTS, n)."""
    length: np.ndarray
    """int64 (LISTS,)."""


class Towards(NamedTuple):
    """What tells a cell's list: column and row of the goal, lists per cell of way to it and per cost."""

    x: int
    y: int
    ahead: np.float32
    lists_per_cost: np.float32
    rows_per_cell: float
    """Of a flat index."""


@kernel
def spread_astar(field: Field, queue: np.ndarray, count: int, target: int, neutral: float) -> int:
    """Run the wave from the first ``count`` cells of ``queue`` until ``target`` is settled or nothing is left.

    field: as for potential.spread; pending: one more than the place in the ring of the list in which a cell waits.
    queue: uint32, as long as the grid. neutral: the least cost of a step. Returns the number of updates.
    """
    width = field.width
    ahead, lists_per_cost = np.float32(neutral * WEIGHT / WIDTH), np.float32(1.0 / WIDTH)
    towards = Towards(target % width, target // width, ahead, lists_per_cost, 1.0 / width)
    ring = Ring(np.empty((LISTS, 512), np.uint32), np.zeros(LISTS, np.int64))
    level = int(_nearest(queue, count, width, towards) * ahead)
    updates, first = 0, 0
    while count > 0:
        first, count, updated = _settle(field, ring, (queue, first, count), level, towards)
        updates += updated
        if count > 0:
            ring = Ring(_longer(ring.waiting), ring.length)
            continue
        if field.potential[target] * lists_per_cost < level:
            break
        level, count = _next_list(field.pending, ring, level, queue)
        first = 0
    return updates


@kernel
def _nearest(current, count, width, towards):
    """Return how near (cells) the nearest of the first ``count`` cells is to the goal."""
    nearest = math.inf
    for i in range(count):
        n = np.int64(current[i])
        nearest = min(nearest, math.hypot(n % width - towards.x, n // width - towards.y))
    return nearest


@kernel
def _settle(field, ring, cells, level, towards):
    """Update the cells of the list of a level, and call their neighbours up: into the same list, or into a later one.

    cells: the list as a circular buffer, its first and how many there are. Returns first and count of those that are
    left, because a later list is full, and how many were updated.
    """
    steps, potential, pending, width, obstacle = field
    waiting, length = ring
    queue, first, count = cells
    w, one = np.uint64(width), np.uint64(1)
    end = (first + count) % len(queue)
    room, longest, updated = waiting.shape[1] - CALLED, length.max(), 0
    while count > 0 and longest <= room:
        n = np.uint64(queue[first])
        first = first + 1 if first + 1 < len(queue) else 0
        count -= 1
        pending[n] = 0
        updated += 1
        left, right = potential[n - one], potential[n + one]
        below, above = potential[n - w], potential[n + w]
        low, value = plane_wave(min(left, right), min(below, above), np.float32(steps[n]), True)
        if not low < value < potential[n] - SLIGHT:
            continue
        potential[n] = value
        later = max(_list_of(np.int64(n), value, width, towards) - level, 0)
        place = (level + later) & (LISTS - 1)
        for m, there in ((n - one, left), (n + one, right), (n - w, below), (n + w, above)):
            step = steps[m]
            if step >= obstacle or there <= value + INVERSE_ROOT_2 * np.float32(step):
                continue
            if pending[m] and (pending[m] - 1 - level) & (LISTS - 1) <= later:
                continue
            pending[m] = place + 1
            if later == 0:
                queue[end] = m
                end = end + 1 if end + 1 < len(queue) else 0
                count += 1
            else:
                waiting[place, length[place]] = m
                length[place] += 1
        longest = max(longest, length[place])
    return first, count, updated


@kernel
def _list_of(n, value, width, towards):
    """Return the number of the list of a cell with a potential."""
    row = int((n + 0.5) * towards.rows_per_cell)  # the half keeps it exact; a division is six times slower
    dx, dy = np.float32(n - row * width - towards.x), np.float32(row - towards.y)
    return int(value * towards.lists_per_cost + towards.ahead * math.sqrt(dx * dx + dy * dy))


@kernel
def _longer(waiting):
    """Return the lists (LISTS, n) with room for twice as many cells."""
    longer = np.empty((LISTS, 2 * waiting.shape[1]), np.uint32)
    longer[:, : waiting.shape[1]] = waiting
    return longer


@kernel
def _next_list(pending, ring, level, queue):
    """Take the cells of the next list that holds any into ``queue``; return its level and how many there are."""
    for _ in range(LISTS):
        level += 1
        place = level & (LISTS - 1)
        count = 0
        for k in range(ring.length[place]):
            m = ring.waiting[place, k]
            if pending[m] == place + 1:  # else it has been called to a nearer list
                queue[count] = m
                count += 1
        ring.length[place] = 0
        if count > 0:
            return level, count
    return level, 0


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = Field(np.full(9, 2, np.uint8), np.full(9, 1e10, np.float32), np.zeros(9, np.uint8), 3, 2)
    spread_astar(field, np.zeros(9, np.uint32), 0, 4, 1.0)
