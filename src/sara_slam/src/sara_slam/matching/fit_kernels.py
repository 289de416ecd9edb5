"""Compiled loops about one pose in a likelihood grid: its refinement below a cell, its covariance, how well it fits.

A pose is (3,): x, y in cells of the grid and yaw in rad; points (n, 2) are in the robot's frame, in cells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_slam.matching.grid_kernels import FULL

ENOUGH = 1e-5
"""Share of the cost: a smaller gain ends the refinement."""
ON = 0.135 * FULL
"""From this value on a point lies on the grid's points: exp(-2), two standard deviations."""


class Prior(NamedTuple):
    """A predicted pose, cells and rad, and the weights of squared deviations from it in the cost of `refined`."""

    x: float
    y: float
    yaw: float
    shift_weight: float
    turn_weight: float


class Spread(NamedTuple):
    """The lattice of `moments`: step of x and y (cells), of yaw (rad); steps to each side."""

    step: float
    turn: float
    half: int


@kernel
def _value(grid, x, y):
    """Share of FULL at a place, by the four nearest cells' centres; 0 outside."""
    x, y = x - 0.5, y - 0.5
    column, row = int(math.floor(x)), int(math.floor(y))
    if not (0 <= row < grid.shape[0] - 1 and 0 <= column < grid.shape[1] - 1):
        return 0.0
    u, v = x - column, y - row
    low = (1.0 - u) * grid[row, column] + u * grid[row, column + 1]
    high = (1.0 - u) * grid[row + 1, column] + u * grid[row + 1, column + 1]
    return ((1.0 - v) * low + v * high) / FULL


@kernel
def _weights(t):
    """Of four values in a row, for a place a share t from the second to the third: Catmull and Rom's cubic, and its
    derivative.
    """
    value = (
        ((-0.5 * t + 1.0) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((-1.5 * t + 2.0) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )
    slope = (
        (-1.5 * t + 2.0) * t - 0.5,
        (4.5 * t - 5.0) * t,
        (-4.5 * t + 4.0) * t + 0.5,
        (1.5 * t - 1.0) * t,
    )
    return value, slope


@kernel
def _smooth(grid, x, y):
    """Share of FULL and its derivatives (1 / cell) at a place, by the 16 nearest cells' centres; 0 outside. Linear
    weights would have no slope between two rows of cells that a wall runs between.
    """
    x, y = x - 0.5, y - 0.5
    column, row = int(math.floor(x)), int(math.floor(y))
    if not (1 <= row < grid.shape[0] - 2 and 1 <= column < grid.shape[1] - 2):
        return 0.0, 0.0, 0.0
    along, along_slope = _weights(x - column)
    across, across_slope = _weights(y - row)
    value = dx = dy = 0.0
    for i in range(4):
        line = line_slope = 0.0
        for j in range(4):
            cell = float(grid[row - 1 + i, column - 1 + j])
            line += along[j] * cell
            line_slope += along_slope[j] * cell
        value += across[i] * line
        dx += across[i] * line_slope
        dy += across_slope[i] * line
    return value / FULL, dx / FULL, dy / FULL


@kernel
def _cost(grid, points, pose, prior):
    c, s = math.cos(pose[2]), math.sin(pose[2])
    total = 0.0
    for k in range(len(points)):
        px, py = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        miss = 1.0 - _smooth(grid, pose[0] + px, pose[1] + py)[0]
        total += miss * miss
    dx, dy, turn = pose[0] - prior.x, pose[1] - prior.y, pose[2] - prior.yaw
    return total + prior.shift_weight * (dx * dx + dy * dy) + prior.turn_weight * turn * turn


@kernel
def _normal_equations(grid, points, pose, prior):
    """(3, 3) and (3,) of a Gauss-Newton step of `_cost`."""
    H, g = np.zeros((3, 3)), np.zeros(3)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    J = np.empty(3)
    for k in range(len(points)):
        px, py = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        value, J[0], J[1] = _smooth(grid, pose[0] + px, pose[1] + py)
        J[2] = px * J[1] - py * J[0]
        for m in range(3):
            g[m] += J[m] * (1.0 - value)
            for n in range(3):
                H[m, n] += J[m] * J[n]
    off = (prior.x - pose[0], prior.y - pose[1], prior.yaw - pose[2])
    weights = (prior.shift_weight, prior.shift_weight, prior.turn_weight)
    for m in range(3):
        H[m, m] += weights[m] + 1e-9
        g[m] += weights[m] * off[m]
    return H, g


@kernel
def refined(grid: np.ndarray, points: np.ndarray, pose: np.ndarray, prior: Prior, steps: int) -> np.ndarray:
    """(3,) the pose near `pose` that fits best: least squares of 1 - value of each point, as Kohlbrecher et al. 2011
    (section IV), and of the deviation from the prior, by so many steps of Levenberg and Marquardt.
    """
    best, damping = pose.copy(), 1e-3
    cost = _cost(grid, points, best, prior)
    H, g = _normal_equations(grid, points, best, prior)
    for _ in range(steps):
        damped = H.copy()
        for m in range(3):
            damped[m, m] *= 1.0 + damping
        tried = best + np.linalg.solve(damped, g)
        lower = _cost(grid, points, tried, prior)
        if lower < cost:
            gain, best, cost = cost - lower, tried, lower
            if gain < ENOUGH * cost:
                break
            H, g = _normal_equations(grid, points, best, prior)
            damping *= 0.1
        else:
            damping *= 10.0
    return best


@kernel
def scores(grid: np.ndarray, points: np.ndarray, pose: np.ndarray, spread: Spread) -> np.ndarray:
    """(turns, rows, columns) the sums of the points' values over a lattice of poses about one."""
    size, half = 2 * spread.half + 1, spread.half
    result = np.zeros((size, size, size))
    for a in range(size):
        angle = pose[2] + (a - half) * spread.turn
        c, s = math.cos(angle), math.sin(angle)
        for k in range(len(points)):
            x = pose[0] + c * points[k, 0] - s * points[k, 1]
            y = pose[1] + s * points[k, 0] + c * points[k, 1]
            for i in range(size):
                for j in range(size):
                    result[a, i, j] += _value(grid, x + (j - half) * spread.step, y + (i - half) * spread.step)
    return result


@kernel
def agreement(grid: np.ndarray, free: np.ndarray, points: np.ndarray, pose: np.ndarray) -> tuple[int, int, float]:
    """(points on the grid's points, points where the grid's rays went through, the mean value of all)."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    on = through = 0
    total = 0.0
    for k in range(len(points)):
        x, y = pose[0] + c * points[k, 0] - s * points[k, 1], pose[1] + s * points[k, 0] + c * points[k, 1]
        value = _value(grid, x, y)
        total += value
        i, j = int(math.floor(y)), int(math.floor(x))
        if value * FULL >= ON:
            on += 1
        elif 0 <= i < free.shape[0] and 0 <= j < free.shape[1] and free[i, j]:
            through += 1
    return on, through, total / max(len(points), 1)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    grid, points, pose = np.zeros((4, 4), np.uint8), np.zeros((1, 2)), np.ones(3)
    refined(grid, points, pose, Prior(1.0, 1.0, 0.0, 1.0, 1.0), 1)
    scores(grid, points, pose, Spread(0.5, 0.1, 1))
    agreement(grid, grid, points, pose)
