"""Exact Euclidean distances on a grid; compiled by numba.

Two passes, first along the columns, then the least sum of squares along the rows (Saito and Toriwaki 1994), cut off at
a reach. Both run along rows of memory with one operation a cell, so that the compiler makes vector instructions of
them.
"""

from __future__ import annotations

import numpy as np

from ahead_of_time import kernel

OBSTACLE = 254
"""What marks a cell as an obstacle, as a lethal cost of costmap_2d."""


@kernel
def along_columns(cells: np.ndarray, window: tuple[int, int, int, int], reach: int) -> np.ndarray:
    """Return the squares (float32, whole) of the gaps along each column to the nearest obstacle of the window (x0, y0,
    xn, yn) of uint8 cells (rows, columns).
    """
    x0, y0, xn, yn = window
    rows, columns = yn - y0, xn - x0
    one, far = np.float32(1.0), np.float32(reach + 1)
    gap = np.empty((rows, columns), np.float32)
    before = np.full(columns, far, np.float32)
    for i in range(rows):
        source, row = cells[y0 + i, x0:xn], gap[i]
        for j in range(columns):
            row[j] = np.float32(0.0) if source[j] == OBSTACLE else _least(before[j] + one, far)
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
def along_row(squares: np.ndarray, reach: int, best: np.ndarray) -> bool:
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
def squared_distances(cells: np.ndarray, reach: int) -> np.ndarray:
    """Return the exact squared distance (cells squared, int32) from each cell to the nearest OBSTACLE.

    Only distances up to ``reach`` cells are found; further cells hold more than reach squared.
    """
    height, width = cells.shape
    squares = along_columns(cells, (0, 0, width, height), reach)
    best = np.empty(width, np.float32)
    result = np.empty((height, width), np.int32)
    for y in range(height):
        along_row(squares[y], reach, best)
        for x in range(width):
            result[y, x] = np.int32(best[x])
    return result


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    squared_distances(np.zeros((3, 3), np.uint8), 2)
