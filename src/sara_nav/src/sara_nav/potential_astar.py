"""The wave of potential.py drawn towards the goal: A* (Hart, Nilsson, Raphael 1968) in place of Dijkstra.

A cell's turn comes by its potential plus WEIGHT times the least that driving on to the goal can cost (the straight line
over free cells). With the weight a little over 1, cells that can only lead to a way about as good as the one under
study are left alone; the way found costs at most that share more. Cells wait in a ring of lists by that
sum, WIDTH wide each; within a list, rounds go as in potential.py. Arrays as there.
"""
import math

import numpy as np
from ahead_of_time import kernel

from sara_nav.potential import INVERSE_ROOT_2, plane_wave

WEIGHT = 1.03
LISTS = 64
"""Lists in the ring: a cell is never put further ahead than LISTS x WIDTH, some four times the dearest step."""
WIDTH = 20.0


@kernel
def spread_astar(steps, potential, level_of, current, following, count, width, target, obstacle, neutral):
    """Run the wave from the ``count`` cells in ``current`` until ``target`` is settled or nothing is left.

    level_of: int32, -1 everywhere: the list in which a cell waits. current, following: uint32 buffers, each as long as
    the grid. neutral: the least cost of a step. Returns the number of updates.
    """
    w, one = np.uint64(width), np.uint64(1)
    goal_x, goal_y = target % width, target // width
    ahead = neutral * WEIGHT
    rows_per_cell = 1.0 / width
    heads = np.full(LISTS, -1, np.int64)
    cells = np.empty(4096, np.uint32)
    links = np.empty(4096, np.int64)
    unused, entries = -1, 0
    nearest = math.inf
    for i in range(count):
        n = np.int64(current[i])
        nearest = min(nearest, math.hypot(n % width - goal_x, n // width - goal_y))
    level = int(nearest * ahead / WIDTH)
    updates = 0
    while True:
        updates += count
        for i in range(count):
            level_of[current[i]] = -1
        further = 0
        for i in range(count):
            n = np.uint64(current[i])
            left, right = potential[n - one], potential[n + one]
            below, above = potential[n - w], potential[n + w]
            low, value = plane_wave(min(left, right), min(below, above), np.float32(steps[n]), True)
            if not low < value < potential[n]:
                continue
            potential[n] = value
            row = int((np.int64(n) + 0.5) * rows_per_cell)  # the half keeps it exact; a division is six times slower
            dx, dy = np.int64(n) - row * width - goal_x, row - goal_y
            at = max(level, int((value + ahead * math.sqrt(dx * dx + dy * dy)) / WIDTH))
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
                if 0 <= level_of[m] <= at:
                    continue
                level_of[m] = at
                if at == level:
                    following[further] = m
                    further += 1
                    continue
                if unused >= 0:
                    entry = unused
                    unused = links[entry]
                else:
                    entry = entries
                    entries += 1
                    if entry == len(cells):
                        longer = np.empty(2 * entry, np.uint32)
                        longer[:entry] = cells
                        cells = longer
                        more = np.empty(2 * entry, np.int64)
                        more[:entry] = links
                        links = more
                cells[entry] = m
                links[entry] = heads[at % LISTS]
                heads[at % LISTS] = entry
        current, following = following, current
        count = further
        if count > 0:
            continue
        if potential[target] < level * WIDTH:
            return updates
        for _ in range(LISTS):
            level += 1
            entry = heads[level % LISTS]
            heads[level % LISTS] = -1
            while entry >= 0:
                m = cells[entry]
                if level_of[m] == level:
                    level_of[m] = -1
                    current[count] = m
                    count += 1
                next_entry = links[entry]
                links[entry] = unused
                unused = entry
                entry = next_entry
            if count > 0:
                break
        if count == 0:
            return updates


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    blocked, levels = np.full(9, 2, np.uint8), np.full(9, -1, np.int32)
    waiting = [np.zeros(9, np.uint32) for _ in range(2)]
    spread_astar(blocked, np.full(9, 1e10, np.float32), levels, *waiting, 0, 3, 4, 2, 1.0)
