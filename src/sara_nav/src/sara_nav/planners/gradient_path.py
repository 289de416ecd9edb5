"""From a potential to a path: steps of half a cell down its gradient, from the goal to where the wave came from.

The peers' method, without their two ends: they give up after a number of steps (and may then return what they have), or
where the gradient vanishes. Here every cell the wave reached has a neighbour of lower potential, for its own potential
was computed from one. So whenever a gradient step leaves the reached cells, cuts a corner or has not come lower for a
few steps, the path goes back to its lowest cell and steps to that cell's lowest neighbour; the potential of
the lowest cell falls with every few steps, and the path must end at the source. A way is never cut short.

Positions are in cells of the padded grid of potential.py with whole numbers at cell centres.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_nav.planners.potential import HIGH

STEP = 0.5
PATIENCE = 6
"""Gradient steps that may pass without a lower cell."""


@kernel
def _slope(potential, n, width):
    """Return the unit vector downhill at a reached cell, (0, 0) where there is none."""
    here = potential[n]
    x, y = 0.0, 0.0
    if potential[n - 1] < HIGH:
        x += potential[n - 1] - here
    if potential[n + 1] < HIGH:
        x += here - potential[n + 1]
    if potential[n - width] < HIGH:
        y += potential[n - width] - here
    if potential[n + width] < HIGH:
        y += here - potential[n + width]
    norm = math.hypot(x, y)
    if norm == 0.0:
        return 0.0, 0.0
    return x / norm, y / norm


@kernel
def clear_step(potential, width, x0, y0, x1, y1):
    """True when a line of at most a cell runs through reached cells alone."""
    column, row = int(math.floor(x0 + 0.5)), int(math.floor(y0 + 0.5))
    column1, row1 = int(math.floor(x1 + 0.5)), int(math.floor(y1 + 0.5))
    if potential[row1 * width + column1] >= HIGH:
        return False
    if column == column1 or row == row1:
        return True
    across = (max(column, column1) - 0.5 - x0) / (x1 - x0)  # share of the line at which it changes column
    along = (max(row, row1) - 0.5 - y0) / (y1 - y0)
    if across <= along and potential[row * width + column1] >= HIGH:
        return False
    return not (along <= across and potential[row1 * width + column] >= HIGH)


@kernel
def lowest_neighbour(potential, n, width):
    """Return the lowest of a cell's eight neighbours that is lower than it, without squeezing past a corner, or -1."""
    best = -1
    lowest = potential[n]
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            m = n + dy * width + dx
            if potential[m] < lowest:
                if dx != 0 and dy != 0 and (potential[n + dx] >= HIGH or potential[n + dy * width] >= HIGH):
                    continue
                best = m
                lowest = potential[m]
    return best


@kernel
def descend(potential, width, source_x, source_y, goal_x, goal_y):
    """Return the path (n, 2) from the goal down the potential to the source; empty if the goal was not reached.

    source: where the wave came from, its cell the lowest of all. The first and the last point are goal and source.
    """
    x, y = goal_x, goal_y
    source = int(math.floor(source_y + 0.5)) * width + int(math.floor(source_x + 0.5))
    best = int(math.floor(y + 0.5)) * width + int(math.floor(x + 0.5))
    path = np.empty((1024, 2))
    if potential[best] >= HIGH:
        return path[:0]
    path[0, 0], path[0, 1] = x, y
    count, kept, stale = 1, 1, 0
    while best != source:
        if (
            abs(x - source_x) <= 1.0
            and abs(y - source_y) <= 1.0
            and clear_step(potential, width, x, y, source_x, source_y)
        ):
            break
        column, row = int(math.floor(x)), int(math.floor(y))
        fx, fy = x - column, y - row
        gx, gy = 0.0, 0.0
        for corner in range(4):
            cx, cy = corner & 1, corner >> 1
            n = (row + cy) * width + column + cx
            if potential[n] < HIGH:
                weight = (fx if cx else 1.0 - fx) * (fy if cy else 1.0 - fy)
                sx, sy = _slope(potential, n, width)
                gx += weight * sx
                gy += weight * sy
        norm = math.hypot(gx, gy)
        moved = False
        if stale < PATIENCE and norm > 1e-6:
            x1, y1 = x + STEP * gx / norm, y + STEP * gy / norm
            if clear_step(potential, width, x, y, x1, y1):
                x, y = x1, y1
                moved = True
        if not moved:
            count = kept
            best = lowest_neighbour(potential, best, width)
            if best < 0:
                return path[:0]
            x, y = float(best % width), float(best // width)
        if count == len(path):
            longer = np.empty((2 * count, 2))
            longer[:count] = path
            path = longer
        path[count, 0], path[count, 1] = x, y
        count += 1
        stale += 1
        n = int(math.floor(y + 0.5)) * width + int(math.floor(x + 0.5))
        if not moved or potential[n] < potential[best]:
            best, kept, stale = n, count, 0
    result = np.empty((count + 1, 2))
    result[:count] = path[:count]
    result[count, 0], result[count, 1] = source_x, source_y
    return result


@kernel
def descend_grid(potential, width, source_x, source_y, goal_x, goal_y):
    """Return the path (n, 2) from the goal to the source over cell centres, each the lowest neighbour of the last."""
    source = int(math.floor(source_y + 0.5)) * width + int(math.floor(source_x + 0.5))
    n = int(math.floor(goal_y + 0.5)) * width + int(math.floor(goal_x + 0.5))
    path = np.empty((1024, 2))
    if potential[n] >= HIGH:
        return path[:0]
    path[0, 0], path[0, 1] = goal_x, goal_y
    count = 1
    while n != source:
        n = lowest_neighbour(potential, n, width)
        if n < 0:
            return path[:0]
        if count == len(path):
            longer = np.empty((2 * count, 2))
            longer[:count] = path
            path = longer
        path[count, 0], path[count, 1] = float(n % width), float(n // width)
        count += 1
    result = np.empty((count + 1, 2))
    result[:count] = path[:count]
    result[count, 0], result[count, 1] = source_x, source_y
    return result


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = np.full(9, HIGH, np.float32)
    for follow in (descend, descend_grid):
        follow(field, 3, 1.0, 1.0, 1.0, 1.0)
