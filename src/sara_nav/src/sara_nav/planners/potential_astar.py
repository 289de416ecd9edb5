"""The wave of potential.py drawn towards the goal: A* (Hart, Nilsson, Raphael 1968) in place of Dijkstra.

A cell's turn comes by its potential plus WEIGHT times the least that driving on to the goal can cost (the straight line
over free cells). With the weight over 1, cells that can only lead to a way about as good as the one under study are
left alone; the way found may cost that share more, and costs a good percent more at the most (test_plans_reference).
Cells wait in a ring of lists by that sum, WIDTH wide each; within a list, rounds go as in potential.py. Arrays as
there.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_nav.planners.potential import INVERSE_ROOT_2, plane_wave

WEIGHT = 1.1
LISTS = 64
"""Lists in the ring, a power of two: a cell is never put further ahead than LISTS x WIDTH, some four times the dearest
step.
"""
WIDTH = 20.0
SLIGHT = np.float32(2.0)
"""Potential by which a cell must come lower to be worth telling its neighbours: a small share of the least step."""


@kernel
def spread_astar(steps, potential, pending, current, following, count, width, target, obstacle, neutral):
    """Run the wave from the ``count`` cells in ``current`` until ``target`` is settled or nothing is left.

    pending: uint8 zeros: one more than the place in the ring of the list in which a cell waits. current, following:
    uint32 buffers, each as long as the grid. neutral: the least cost of a step. Returns the number of updates.
    """
    w, one = np.uint64(width), np.uint64(1)
    goal_x, goal_y = target % width, target // width
    ahead, lists_per_cost = np.float32(neutral * WEIGHT / WIDTH), np.float32(1.0 / WIDTH)
    rows_per_cell = 1.0 / width
    waiting, length = np.empty((LISTS, 512), np.uint32), np.zeros(LISTS, np.int64)
    nearest = math.inf
    for i in range(count):
        n = np.int64(current[i])
        nearest = min(nearest, math.hypot(n % width - goal_x, n // width - goal_y))
    level = int(nearest * ahead)
    updates = 0
    while True:
        updates += count
        for i in range(count):
            pending[current[i]] = 0
        further = 0
        for i in range(count):
            n = np.uint64(current[i])
            left, right = potential[n - one], potential[n + one]
            below, above = potential[n - w], potential[n + w]
            low, value = plane_wave(min(left, right), min(below, above), np.float32(steps[n]), True)
            if not low < value < potential[n] - SLIGHT:
                continue
            potential[n] = value
            row = int((np.int64(n) + 0.5) * rows_per_cell)  # the half keeps it exact; a division is six times slower
            dx, dy = np.float32(np.int64(n) - row * width - goal_x), np.float32(row - goal_y)
            later = max(int(value * lists_per_cost + ahead * math.sqrt(dx * dx + dy * dy)) - level, 0)
            place = (level + later) & (LISTS - 1)
            for side in range(4):
                if side == 0:
                    m, there = n - one, left
                elif side == 1:
                    m, there = n + one, right
                elif side == 2:
                    m, there = n - w, below
                else:
                    m, there = n + w, above
                step = steps[m]
                if step >= obstacle or there <= value + INVERSE_ROOT_2 * np.float32(step):
                    continue
                if pending[m] and (pending[m] - 1 - level) & (LISTS - 1) <= later:
                    continue
                pending[m] = place + 1
                if later == 0:
                    following[further] = m
                    further += 1
                    continue
                k = length[place]
                if k == waiting.shape[1]:
                    longer = np.empty((LISTS, 2 * k), np.uint32)
                    longer[:, :k] = waiting
                    waiting = longer
                waiting[place, k] = m
                length[place] = k + 1
        current, following = following, current
        count = further
        if count > 0:
            continue
        if potential[target] * lists_per_cost < level:
            return updates
        for _ in range(LISTS):
            level += 1
            place = level & (LISTS - 1)
            for k in range(length[place]):
                m = waiting[place, k]
                if pending[m] == place + 1:  # else it has been called to a nearer list
                    pending[m] = 0
                    current[count] = m
                    count += 1
            length[place] = 0
            if count > 0:
                break
        if count == 0:
            return updates


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    blocked = np.full(9, 2, np.uint8)
    waiting = [np.zeros(9, np.uint32) for _ in range(2)]
    spread_astar(blocked, np.full(9, 1e10, np.float32), np.zeros(9, np.uint8), *waiting, 0, 3, 4, 2, 1.0)
