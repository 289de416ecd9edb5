"""Compiled loops that make grids of points: how likely an echo is in each cell, and which cells rays went through.

Places are in cells of the grid: a point at (x, y) lies in column int(x) of row int(y), and a cell's centre is half a
cell from its corner.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel

FULL = 255
"""The value of a cell whose centre lies on a point."""
FREE_BEFORE = 2.0
"""Cells before its echo at which a ray's free part ends."""


@kernel
def stamp(squares: np.ndarray, nearest: np.ndarray, points: np.ndarray, reach: int) -> None:
    """Lower squares (rows, columns; float32, cells squared) to the squared distance of each cell's centre from the
    points (n, 2), within `reach` cells of these, and set nearest (rows, columns; int32) to the index of that point.
    """
    rows, columns = squares.shape
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        column, row = int(math.floor(x)), int(math.floor(y))
        for i in range(max(row - reach, 0), min(row + reach + 1, rows)):
            dy = i + 0.5 - y
            for j in range(max(column - reach, 0), min(column + reach + 1, columns)):
                dx = j + 0.5 - x
                square = np.float32(dx * dx + dy * dy)
                if square < squares[i, j]:
                    squares[i, j] = square
                    nearest[i, j] = k


@kernel
def likelihoods(squares: np.ndarray, deviation: float) -> np.ndarray:
    """(rows, columns) uint8: FULL exp(-d^2 / 2 sigma^2) of squared distances; deviation: sigma, cells."""
    rows, columns = squares.shape
    grid = np.zeros((rows, columns), np.uint8)
    factor = -0.5 / (deviation * deviation)
    most = 13.0 * deviation * deviation  # beyond, it rounds to 0
    for i in range(rows):
        for j in range(columns):
            if squares[i, j] < most:
                grid[i, j] = np.uint8(FULL * math.exp(factor * squares[i, j]) + 0.5)
    return grid


@kernel
def pooled(grid: np.ndarray, block: int) -> np.ndarray:
    """(rows, columns) uint8: the greatest value of the `block` by `block` cells from each cell on, up and right; block:
    a power of 2.
    """
    rows, columns = grid.shape
    result = grid.copy()
    d = 1
    while d < block:
        for i in range(rows):
            row = result[i]
            for j in range(columns - d):  # later cells still hold what they held before this pass
                row[j] = max(row[j], row[j + d])
        for i in range(rows - d):
            row, above = result[i], result[i + d]
            for j in range(columns):
                row[j] = max(row[j], above[j])
        d *= 2
    return result


@kernel
def clear_rays(free: np.ndarray, origin: tuple[float, float], ends: np.ndarray) -> None:
    """Set the cells of free (rows, columns; uint8) to 1 that rays go through, from an origin to FREE_BEFORE cells
    before their ends (n, 2), in steps of a cell.
    """
    rows, columns = free.shape
    for k in range(len(ends)):
        dx, dy = ends[k, 0] - origin[0], ends[k, 1] - origin[1]
        length = math.sqrt(dx * dx + dy * dy)
        if length <= FREE_BEFORE:
            continue
        dx, dy = dx / length, dy / length
        for step in range(int(length - FREE_BEFORE) + 1):
            i, j = int(math.floor(origin[1] + step * dy)), int(math.floor(origin[0] + step * dx))
            if 0 <= i < rows and 0 <= j < columns:
                free[i, j] = 1


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    squares, points = np.full((4, 4), np.float32(9.0), np.float32), np.ones((2, 2))
    stamp(squares, np.zeros((4, 4), np.int32), points, 1)
    grid = likelihoods(squares, 1.0)
    pooled(grid, 2)
    clear_rays(grid, (0.0, 0.0), points)
