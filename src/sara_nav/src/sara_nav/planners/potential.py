"""The wave that gives every cell what driving there costs: the potential of navfn and global_planner.

A wave runs out from the robot. Each cell takes, from its lowest neighbour in x and its lowest in y, the value a plane
wave would give it, or the lower neighbour's plus the cell's own cost where only one counts. The plane wave's equation
is solved by the peers' quadratic fit, a step of cost h between neighbours that differ by d: low + h (0.7040 + 0.5307 r
- 0.2301 r^2), r = d/h. (The method: Kimmel and Sethian 1998; the fit and the priority blocks: K. Konolige's navfn.)

Cells wait in three blocks in place of a heap: those of this round, those of the next below a threshold of potential,
and those above it. So a round is a loop over an array, cells are taken very nearly in order, and the few taken too
early are taken again.

Arrays are flat over the map with one cell of obstacle put all round it, so that no neighbour has to be tested for being
off the map: index = (row + 1)(columns + 2) + column + 1. ``warm()`` compiles or loads all of it.
"""

import numpy as np

from ahead_of_time import kernel

HIGH = np.float32(1e10)
"""Potential of a cell that the wave has not reached."""
INVERSE_ROOT_2 = np.float32(0.707106781)


@kernel
def prepare(costs, table, obstacle, outline, steps, potential, pending):
    """Lay out a search: table (256,) turns costs (rows, columns) into steps; nothing is reached or waits.

    outline: the outermost cells of the map are obstacles too.
    """
    rows, columns = costs.shape
    width = columns + 2
    for i in range(width):
        steps[i] = obstacle
        steps[(rows + 1) * width + i] = obstacle
    for row in range(rows):
        at = (row + 1) * width
        steps[at] = obstacle
        steps[at + columns + 1] = obstacle
        line = costs[row]
        inner = steps[at + 1 : at + 1 + columns]
        for column in range(columns):
            inner[column] = table[line[column]]
        if outline:
            inner[0] = obstacle
            inner[columns - 1] = obstacle
            if row == 0 or row == rows - 1:
                inner[:] = obstacle
    potential[:] = HIGH
    pending[:] = 0


@kernel(inline='always')
def plane_wave(low, other, cost, quadratic):
    """Return a cell's potential from the lowest neighbour along one axis and along the other, and its own cost."""
    if low > other:
        low, other = other, low
    value = low + cost
    if quadratic and other < value:
        ratio = (other - low) / cost
        value = low + cost * (np.float32(0.7040) + ratio * (np.float32(0.5307) - ratio * np.float32(0.2301)))
    return low, value


@kernel
def spread(steps, potential, pending, current, following, over, count, width, target, obstacle, increment, quadratic):
    """Run the wave from the ``count`` cells in ``current`` until ``target`` is settled or nothing is left.

    steps: uint8, a cell's cost, from ``obstacle`` on impassable. potential: float32, HIGH where unreached, the
    sources' values given. pending: uint8 zeros. current, following, over: uint32 buffers, each as long as the grid.
    target: index, or -1 to fill everything. increment: width of a priority block. quadratic: the plane wave, else
    the lowest neighbour plus the cost. Returns the number of updates.
    """
    w, one = np.uint64(width), np.uint64(1)
    threshold = float(obstacle)
    updates = 0
    waiting = 0
    while count > 0:
        updates += count
        for i in range(count):
            pending[current[i]] = 0
        further = 0
        for i in range(count):
            n = np.uint64(current[i])
            step = steps[n]
            if step >= obstacle:
                continue
            left, right = potential[n - one], potential[n + one]
            below, above = potential[n - w], potential[n + w]
            low, value = plane_wave(min(left, right), min(below, above), np.float32(step), quadratic)
            if not low < value < potential[n]:
                continue
            potential[n] = value
            soon = value < threshold
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
                if there > value + INVERSE_ROOT_2 * np.float32(step) and pending[m] == 0 and step < obstacle:
                    pending[m] = 1
                    if soon:
                        following[further] = m
                        further += 1
                    else:
                        over[waiting] = m
                        waiting += 1
        current, following = following, current
        count = further
        if count == 0:  # all below the threshold is settled
            if target >= 0 and potential[target] < threshold:
                break
            threshold += increment
            current, over = over, current
            count, waiting = waiting, 0
    return updates


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    steps, pending = np.zeros(25, np.uint8), np.zeros(25, np.uint8)
    field = np.zeros(25, np.float32)
    prepare(np.zeros((3, 3), np.uint8), np.ones(256, np.uint8), 2, True, steps, field, pending)
    spread(steps, field, pending, *(np.zeros(25, np.uint32) for _ in range(3)), 0, 5, -1, 2, 1.0, True)
