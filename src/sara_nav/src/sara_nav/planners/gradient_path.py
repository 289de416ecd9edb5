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
def clear_step(potential: np.ndarray, width: int, x0: float, y0: float, x1: float, y1: float) -> bool:
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
def lowest_neighbour(potential: np.ndarray, n: int, width: int) -> int:
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
def cell_of(width: int, x: float, y: float) -> int:
    """Return the index of the cell of a position."""
    return int(math.floor(y + 0.5)) * width + int(math.floor(x + 0.5))


@kernel
def _downhill(potential, width, x, y):
    """Return the slope at a position, from those of the four cells about it by their nearness."""
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
    return gx, gy


@kernel
def _put(path, count, x, y):
    """Write a point behind the first ``count``; return the path (n, 2), a longer one where it was full."""
    if count == len(path):
        longer = np.empty((2 * count, 2))
        longer[:count] = path
        path = longer
    path[count, 0], path[count, 1] = x, y
    return path


@kernel
def descend(
    potential: np.ndarray, width: int, source_x: float, source_y: float, goal_x: float, goal_y: float
) -> np.ndarray:
    """Return the path (n, 2) from the goal down the potential to the source; empty if the goal was not reached.

    source: where the wave came from, its cell the lowest of all. The first and the last point are goal and source.
    """
    x, y = goal_x, goal_y
    source, best = cell_of(width, source_x, source_y), cell_of(width, x, y)
    path = np.empty((1024, 2))
    if potential[best] >= HIGH:
        return path[:0]
    path[0, 0], path[0, 1] = x, y
    count, kept, stale = 1, 1, 0
    while best != source:
        near = abs(x - source_x) <= 1.0 and abs(y - source_y) <= 1.0
        if near and clear_step(potential, width, x, y, source_x, source_y):
            break
        gx, gy = _downhill(potential, width, x, y)
        norm = math.hypot(gx, gy)
        x1, y1, moved = x, y, False
        if stale < PATIENCE and norm > 1e-6:
            x1, y1 = x + STEP * gx / norm, y + STEP * gy / norm
            moved = clear_step(potential, width, x, y, x1, y1)
        if moved:
            x, y = x1, y1
        else:
            count = kept
            best = lowest_neighbour(potential, best, width)
            if best < 0:
                return path[:0]
            x, y = float(best % width), float(best // width)
        path = _put(path, count, x, y)
        count += 1
        stale += 1
        n = cell_of(width, x, y)
        if not moved or potential[n] < potential[best]:
            best, kept, stale = n, count, 0
    return _put(path, count, source_x, source_y)[: count + 1].copy()


@kernel
def descend_grid(
    potential: np.ndarray, width: int, source_x: float, source_y: float, goal_x: float, goal_y: float
) -> np.ndarray:
    """Return the path (n, 2) from the goal to the source over cell centres, each the lowest neighbour of the last."""
    source, n = cell_of(width, source_x, source_y), cell_of(width, goal_x, goal_y)
    path = np.empty((1024, 2))
    if potential[n] >= HIGH:
        return path[:0]
    path[0, 0], path[0, 1] = goal_x, goal_y
    count = 1
    while n != source:
        n = lowest_neighbour(potential, n, width)
        if n < 0:
            return path[:0]
        path = _put(path, count, float(n % width), float(n // width))
        count += 1
    return _put(path, count, source_x, source_y)[: count + 1].copy()


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = np.full(9, HIGH, np.float32)
    for follow in (descend, descend_grid):
        follow(field, 3, 1.0, 1.0, 1.0, 1.0)
