"""The echo that a map predicts for a range sensor with a wide cone, and how sure that is; compiled by numba.

The nearest thing in the cone echoes. Where that is a plane that the beam meets squarely, the echo is a "region of
constant depth" (J. Leonard, H. Durrant-Whyte, "Directed Sonar Sensing for Mobile Robot Navigation", 1992): the range is
the distance to the plane, wherever in the cone its foot lies, and moving or turning the sensor along the plane does not
change it. An edge, such as a jamb's, is another where it is the nearest thing and well within the cone; its echo is
weaker. It says what walls along a corridor do not. What lies at the border of the cone is where a real sensor hears one
time this, one time that: it is not predicted.

A range counts as predicted only if it is so over the whole uncertainty of the pose: at the ends of each axis of it the
map must predict the like again, as far away as the first one says within a tolerance (sigma points, as in the unscented
transform, as a test of smoothness).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel

FREE, OCCUPIED, UNKNOWN = 0, 1, 2

PLANE, SILENT, AMBIGUOUS, EDGE = 0, 1, 2, 3
"""What a prediction is: the range to a plane; nothing within the limit; something that no range can be said for; the
range to an edge.
"""
RAY_GAP = math.radians(2.0)
"""Between the rays of a cone."""
BORDER_RAYS = 1
"""A foot nearer to the border of the cone than this many rays may be just outside of it."""
EDGE_BORDER_RAYS = 3
"""The same of an edge, whose echo is weaker there."""
PLANE_RAYS = 4
"""Rays on either side of the foot that must meet the same plane."""
PLANE_LEAST = 0.10
"""m to either side of the foot that the plane must reach, however near it is."""


@kernel
def walk(grid: np.ndarray, x: float, y: float, angle: float, limit: float) -> tuple[float, int, int, int]:
    """Walk a ray through uint8 cells (rows, columns) from x, y (cells) until one that is not FREE; returns (distance in
    cells or inf, what is there, row and column of the cell before).

    The traversal of J. Amanatides and A. Woo, 1987. Outside of the grid all is UNKNOWN.
    """
    rows, columns = grid.shape
    dx, dy = math.cos(angle), math.sin(angle)
    column, row = int(math.floor(x)), int(math.floor(y))
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    gap_x = abs(1.0 / dx) if dx != 0.0 else math.inf
    gap_y = abs(1.0 / dy) if dy != 0.0 else math.inf
    next_x = ((column + 1 - x) if dx > 0.0 else (x - column)) * gap_x if dx != 0.0 else math.inf
    next_y = ((row + 1 - y) if dy > 0.0 else (y - row)) * gap_y if dy != 0.0 else math.inf
    distance, free_row, free_column = 0.0, row, column
    while distance <= limit:
        if not (0 <= row < rows and 0 <= column < columns):
            return distance, UNKNOWN, free_row, free_column
        if grid[row, column] != FREE:
            return distance, int(grid[row, column]), free_row, free_column
        free_row, free_column = row, column
        if next_x < next_y:
            distance = next_x
            next_x += gap_x
            column += step_x
        else:
            distance = next_y
            next_y += gap_y
            row += step_y
    return math.inf, FREE, free_row, free_column


@kernel
def cast(grid: np.ndarray, x: float, y: float, angle: float, limit: float) -> tuple[float, int]:
    """As `walk`: (distance in cells or inf, what is there)."""
    distance, what, _, _ = walk(grid, x, y, angle, limit)
    return distance, what


class Cone(NamedTuple):
    """What a sensor hears: half its cone, rad; up to which range, m; by how much a plane may differ from flat, m."""

    half: float
    limit: float
    tolerance: float


@kernel
def echo(
    grid: np.ndarray, resolution: float, sensor: tuple[float, float, float], cone: Cone
) -> tuple[int, float, float]:
    """What a sensor at x, y (m from the grid's corner), that looks along an axis (rad), hears of the map.

    grid: uint8 (rows, columns). Returns (PLANE, EDGE, SILENT or AMBIGUOUS; distance, m; direction of the plane's foot
    or of the edge, rad).
    """
    x, y, axis = sensor
    half, limit, tolerance = cone.half, cone.limit, cone.tolerance
    n = max(int(round(2.0 * half / RAY_GAP)), 2 * PLANE_RAYS) + 1
    gap = 2.0 * half / (n - 1)
    distances, best, first, nearest = np.empty(n), math.inf, 0, FREE
    for i in range(n):
        distance, what = cast(grid, x / resolution, y / resolution, axis - half + i * gap, limit / resolution)
        distances[i] = distance * resolution
        if distances[i] < best:
            best, first, nearest = distances[i], i, what
    if best == math.inf:
        return SILENT, math.inf, axis
    if nearest == UNKNOWN:
        return AMBIGUOUS, math.nan, math.nan
    # Cells make steps: the foot is in the middle of the rays that are as near as the nearest, within a step.
    last = first
    for i in range(first, n):
        if distances[i] <= best + 1e-3 * best:
            last = i
    foot = (first + last) // 2
    if foot < BORDER_RAYS or foot > n - 1 - BORDER_RAYS:
        return AMBIGUOUS, math.nan, math.nan
    reach = max(PLANE_RAYS, int(math.ceil(math.atan2(PLANE_LEAST, best) / gap)))
    if _flat(distances, foot, reach, gap, tolerance):
        return PLANE, best, axis - half + foot * gap
    if foot < EDGE_BORDER_RAYS or foot > n - 1 - EDGE_BORDER_RAYS:
        return AMBIGUOUS, math.nan, math.nan
    return EDGE, best, axis - half + foot * gap


@kernel
def _flat(distances, foot, reach, gap, tolerance):
    """Whether the rays about the foot meet one plane that is square to the foot's ray."""
    best, seen = distances[foot], 0
    for i in range(max(foot - reach, 0), min(foot + reach, len(distances) - 1) + 1):
        flat = best / math.cos((i - foot) * gap)
        if abs(distances[i] - flat) > tolerance + 0.1 * (flat - best):
            return False
        seen += 1
    return seen >= PLANE_RAYS + BORDER_RAYS


@kernel
def predict(
    grid: np.ndarray,
    resolution: float,
    base: tuple[float, float],
    sensor: tuple[float, float, float],
    cone: Cone,
    axes: np.ndarray,
) -> tuple[int, float, float, float, float]:
    """The echo predicted at a pose, and its slopes, if it is one over the whole uncertainty of that pose.

    All in the grid's frame (m from its corner, rad): base: x, y of the pose that is uncertain; sensor: x, y, axis of
    the sensor, rigidly with it (at the time of its burst). axes: float64 (k, 3), displacements of x, y, yaw to try on
    either side. Returns (PLANE, EDGE, SILENT or AMBIGUOUS; distance, m; slopes of the distance with x, y (m/m) and yaw
    (m/rad)).
    """
    what, distance, direction = echo(grid, resolution, sensor, cone)
    if what not in (PLANE, EDGE):
        return what, distance, 0.0, 0.0, 0.0
    base_x, base_y = base
    sensor_x, sensor_y, axis = sensor
    arm_x, arm_y = sensor_x - base_x, sensor_y - base_y
    slope_x, slope_y = -math.cos(direction), -math.sin(direction)
    slope_yaw = slope_y * arm_x - slope_x * arm_y
    for k in range(axes.shape[0]):
        for sign in (-1.0, 1.0):
            dx, dy, turn = sign * axes[k, 0], sign * axes[k, 1], sign * axes[k, 2]
            c, s = math.cos(turn), math.sin(turn)
            x, y = base_x + dx + c * arm_x - s * arm_y, base_y + dy + s * arm_x + c * arm_y
            other, moved, _ = echo(grid, resolution, (x, y, axis + turn), cone)
            off = abs(moved - distance - slope_x * dx - slope_y * dy - slope_yaw * turn)
            like = other == PLANE or other == what  # about an edge there may be the plane that it ends
            if not like or off > cone.tolerance:
                return AMBIGUOUS, math.nan, 0.0, 0.0, 0.0
    return what, distance, slope_x, slope_y, slope_yaw


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    grid = np.zeros((3, 3), np.uint8)
    cast(grid, 1.5, 1.5, 0.0, 1.0)
    echo(grid, 1.0, (1.5, 1.5, 0.0), Cone(0.5, 1.0, 0.1))
    predict(grid, 1.0, (1.5, 1.5), (1.5, 1.5, 0.0), Cone(0.5, 1.0, 0.1), np.zeros((3, 3)))
