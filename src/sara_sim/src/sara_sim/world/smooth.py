"""Smoothing of grids in numpy: what World asks of an image library, without the tenth of a second it takes to import
one.

Beyond its edge a grid is continued by its mirror image, the outermost cells twice.
"""

import math

import numpy as np


def along(grid: np.ndarray, weights: np.ndarray, axis: int) -> np.ndarray:
    """The weighted sum of each cell and its neighbours along an axis, same shape. `weights`: odd in number, of the
    cells behind to those ahead.
    """
    half = len(weights) // 2
    length = grid.shape[axis]
    # As many mirror images as it takes: a grid may be smaller than the reach.
    period = np.arange(-half, length + half) % (2 * length)
    grown = grid.take(np.where(period < length, period, 2 * length - 1 - period), axis)
    result = np.zeros(grid.shape)
    for k, weight in enumerate(weights):
        if weight:
            result += weight * grown.take(np.arange(k, k + length), axis)
    return result


def gaussian(grid: np.ndarray, sigma: float) -> np.ndarray:
    """Blurred by a normal distribution of `sigma` cells, cut off at four sigma."""
    half = math.ceil(4.0 * sigma)
    weights = np.exp(-0.5 * (np.arange(-half, half + 1) / sigma) ** 2)
    weights /= weights.sum()
    return along(along(grid, weights, 0), weights, 1)


def slopes(grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How the grid rises along its columns (x) and rows (y), after Sobel; times eight per cell."""
    difference, mean = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 2.0, 1.0])
    return along(along(grid, difference, 1), mean, 0), along(along(grid, difference, 0), mean, 1)


def none_within(occupied: np.ndarray, reach: int) -> np.ndarray:
    """Cells (bool) with no occupied cell in the square that reaches `reach` cells to each side."""
    rows, columns = occupied.shape
    sums = np.zeros((rows + 1, columns + 1), np.int64)
    sums[1:, 1:] = occupied.cumsum(0).cumsum(1)
    low_y, high_y = (
        np.maximum(np.arange(rows) - reach, 0)[:, None],
        np.minimum(np.arange(rows) + reach + 1, rows)[:, None],
    )
    low_x, high_x = np.maximum(np.arange(columns) - reach, 0), np.minimum(np.arange(columns) + reach + 1, columns)
    return sums[high_y, high_x] - sums[low_y, high_x] - sums[high_y, low_x] + sums[low_y, low_x] == 0
