"""Exact Euclidean distances on a grid, and the spreading of costs around obstacles; compiled by numba.

Two passes, first along the columns, then the least sum of squares along the rows (Saito and Toriwaki 1994), cut off at
a reach. Both run along rows of memory with one operation a cell, so that the compiler makes vector instructions of
them.
"""

from __future__ import annotations

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids import windows
from sara_nav.grids.grid import LETHAL, UNKNOWN
from sara_nav.grids.windows import Window


@kernel
def _along_columns(costs, window, reach):
    """Return the squares (float32, whole) of the gaps along each column to the nearest lethal cell of the window."""
    x0, y0, xn, yn = window
    rows, columns = yn - y0, xn - x0
    one, far = np.float32(1.0), np.float32(reach + 1)
    gap = np.empty((rows, columns), np.float32)
    before = np.full(columns, far, np.float32)
    for i in range(rows):
        source, row = costs[y0 + i, x0:xn], gap[i]
        for j in range(columns):
            row[j] = np.float32(0.0) if source[j] == LETHAL else _least(before[j] + one, far)
        before = row
    for i in range(rows - 2, -1, -1):
        row, after = gap[i], gap[i + 1]
        for j in range(columns):
            row[j] = _least(row[j], after[j] + one)
    for i in range(rows):
        row = gap[i]
        for j in range(columns):
            row[j] = row[j] * row[j]
    return gap


@kernel
def _least(a, b):
    return a if a < b else b


@kernel
def _along_row(squares, reach, best):
    """Put the least of d^2 + squares[x - d], squares[x + d] over all d into best, for one row; False: nothing near."""
    n = len(squares)
    least = squares[0]
    for x in range(n):
        best[x] = squares[x]
        least = _least(least, squares[x])
    limit = np.float32(reach * reach)
    for d in range(1, min(reach, n - 1) + 1):
        dd = np.float32(d * d)
        if dd + least > limit:
            break
        before, upper = squares[: n - d], best[d:]
        for k in range(n - d):
            upper[k] = _least(before[k] + dd, upper[k])
        after, lower = squares[d:], best[: n - d]
        for k in range(n - d):
            lower[k] = _least(after[k] + dd, lower[k])
    return least <= limit


@kernel
def squared_distances(costs: np.ndarray, reach: int) -> np.ndarray:
    """Return the exact squared distance (cells squared, int32) from each cell to the nearest lethal one.

    Only distances up to ``reach`` cells are found; further cells hold more than reach squared.
    """
    height, width = costs.shape
    squares = _along_columns(costs, (0, 0, width, height), reach)
    best = np.empty(width, np.float32)
    result = np.empty((height, width), np.int32)
    for y in range(height):
        _along_row(squares[y], reach, best)
        for x in range(width):
            result[y, x] = np.int32(best[x])
    return result


@kernel
def pick_lethal(costs: np.ndarray, obstacles: np.ndarray, window: Window) -> None:
    """Write 254 into a window of obstacles (uint8 (h, w)) where the costs hold it, else 0."""
    x0, y0, xn, yn = window
    for y in range(y0, yn):
        for x in range(x0, xn):
            obstacles[y, x] = LETHAL if costs[y, x] == LETHAL else 0


@kernel
def spread(
    obstacles: np.ndarray, costs: np.ndarray, window: Window, reach: int, table: np.ndarray, unknown_from: int
) -> None:
    """Raise the costs of a window by what the obstacles in and around it cost there.

    obstacles: uint8 (h, w), 254 where an obstacle is. costs: uint8 (h, w), changed in the window.
    table: cost (uint8) by squared distance in cells, reach^2 + 1 entries. A known cell keeps the greater cost; an
    unknown one takes a cost of at least ``unknown_from``.
    """
    x0, y0, xn, yn = window
    height, width = costs.shape
    left, right = max(0, x0 - reach), min(width, xn + reach)
    low, high = max(0, y0 - reach), min(height, yn + reach)
    squares = _along_columns(obstacles, (left, low, right, high), reach)
    best = np.empty(right - left, np.float32)
    limit = np.float32(reach * reach)
    for y in range(y0, yn):
        if not _along_row(squares[y - low], reach, best):
            continue
        for x in range(x0, xn):
            if best[x - left] <= limit:
                cost = table[np.int64(best[x - left])]
                if costs[y, x] == UNKNOWN:
                    if cost >= unknown_from:
                        costs[y, x] = cost
                elif cost > costs[y, x]:
                    costs[y, x] = cost


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs = np.zeros((3, 3), np.uint8)
    squared_distances(costs, 2)
    pick_lethal(costs, costs.copy(), (0, 0, 3, 3))
    windows.warm()
    spread(costs, costs, (0, 0, 3, 3), 2, np.zeros(5, np.uint8), 1)
