"""Compiled loops about one pose in a grid: its refinement below a cell and its certainty, how well it fits.

A pose is (3,): x, y in cells of the grid and yaw in rad; points (n, 2) are in the robot's frame, in cells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_slam.matching.grid_kernels import FULL

ON = 0.135 * FULL
"""From this value on a point lies on the grid's points: exp(-2), two standard deviations."""
STILL = 1e-4
"""Cells, and rad times 100 cells, of a step that ends the refinement."""


class Prior(NamedTuple):
    """A predicted pose, cells and rad, and its information: 1 / cells^2 of x and of y, 1 / rad^2 of yaw."""

    x: float
    y: float
    yaw: float
    shift_information: float
    turn_information: float


class Lines(NamedTuple):
    """nearest (rows, columns) int32: the index of the place on a surface that is nearest to each cell, -1 where none
    is near; points, normals (m, 2) of these, in cells; sigma: standard deviation of an echo, cells; information: what
    one echo counts.
    """

    nearest: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    sigma: float
    information: float


@kernel
def refined(
    lines: Lines, points: np.ndarray, pose: np.ndarray, prior: Prior, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """(3,) the pose near `pose` at which the points fit the lines best, and its information (3, 3), the prior's
    included: Gauss-Newton on the distances across the surfaces (Censi 2008), far ones weighted down by Geman and
    McClure's function.

    Distances along a surface do not count: at its end a scan sees more of it than is known, which would pull the pose.
    """
    best = pose.copy()
    H, g = _normal_equations(lines, points, best, prior)
    for _ in range(steps):
        step = np.linalg.solve(H, g)
        best = best + step
        H, g = _normal_equations(lines, points, best, prior)
        if abs(step[0]) + abs(step[1]) + 100.0 * abs(step[2]) < STILL:
            break
    return best, H


@kernel
def _normal_equations(lines, points, pose, prior):
    """(3, 3) and (3,) of a Gauss-Newton step."""
    H, g, J = np.zeros((3, 3)), np.zeros(3), np.empty(3)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    rows, columns = lines.nearest.shape
    for k in range(len(points)):
        px, py = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        x, y = pose[0] + px, pose[1] + py
        i, j = int(math.floor(y)), int(math.floor(x))
        if not (0 <= i < rows and 0 <= j < columns) or lines.nearest[i, j] < 0:
            continue
        m = lines.nearest[i, j]
        J[0], J[1] = lines.normals[m, 0], lines.normals[m, 1]
        J[2] = J[1] * px - J[0] * py
        off = J[0] * (lines.points[m, 0] - x) + J[1] * (lines.points[m, 1] - y)
        share = 1.0 / (1.0 + (off / lines.sigma) ** 2)
        weight = lines.information * share * share / (lines.sigma * lines.sigma)
        for a in range(3):
            g[a] += weight * J[a] * off
            for b in range(3):
                H[a, b] += weight * J[a] * J[b]
    deviation = (prior.x - pose[0], prior.y - pose[1], prior.yaw - pose[2])
    information = (prior.shift_information, prior.shift_information, prior.turn_information)
    for a in range(3):
        H[a, a] += information[a]
        g[a] += information[a] * deviation[a]
    return H, g


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
def agreement(grid: np.ndarray, free: np.ndarray, points: np.ndarray, pose: np.ndarray) -> tuple[int, int, float]:
    """(points on the grid's points, points where the grid's rays went through, the mean share of FULL of all)."""
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
    lines = Lines(np.zeros((4, 4), np.int32), points, points, 1.0, 1.0)
    refined(lines, points, pose, Prior(1.0, 1.0, 0.0, 1.0, 1.0), 1)
    agreement(grid, grid, points, pose)
