"""Marking and clearing cells by what a sensor saw, along the lines of outline.py; compiled by numba.

Each kernel returns the window (x0, y0, xn, yn) of the cells whose cost it changed, empty when it changed none.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids.grid import FREE, LETHAL, Grid
from sara_nav.grids.outline import line_cells
from sara_nav.grids.windows import Window, grown

GAP = 0.5
"""s that may be between two marks of the same thing."""


class Marks(NamedTuple):
    """What a layer has marked; times are of another size where they are not kept."""

    costs: np.ndarray
    """uint8 (h, w), 254 where something is."""
    marked_at: np.ndarray
    """float64 (h, w), when a cell was last marked, s."""
    since: np.ndarray
    """float64 (h, w), from when on it was marked without a GAP, s."""
    stands: np.ndarray
    """bool (h, w), whether that was long enough."""


class Reach(NamedTuple):
    """Which points mark."""

    obstacle_range: float
    """m from the sensor from which on they do not."""
    highest: float
    """m above the ground up to which they do."""


@kernel
def clear_rays(costs: np.ndarray, grid: Grid, sensor: tuple[float, float], points: np.ndarray, reach: int) -> Window:
    """Free the cells on the lines from a sensor (x, y), m, on the grid to points (n, 3), m, no further than ``reach``
    cells. grid: a Grid.
    """
    origin_x, origin_y, resolution = grid
    sensor_x, sensor_y = sensor
    height, width = costs.shape
    x0 = int(math.floor((sensor_x - origin_x) / resolution))
    y0 = int(math.floor((sensor_y - origin_y) / resolution))
    window = (width, height, 0, 0)
    for i in range(len(points)):
        dx, dy = points[i, 0] - sensor_x, points[i, 1] - sensor_y
        share = 1.0
        if dx != 0.0:
            edge = origin_x + (width * resolution if dx > 0.0 else 0.0)
            share = min(share, (edge - sensor_x) / dx)
        if dy != 0.0:
            edge = origin_y + (height * resolution if dy > 0.0 else 0.0)
            share = min(share, (edge - sensor_y) / dy)
        x1 = int(math.floor((sensor_x + share * dx - origin_x) / resolution))
        y1 = int(math.floor((sensor_y + share * dy - origin_y) / resolution))
        x1, y1 = min(max(x1, 0), width - 1), min(max(y1, 0), height - 1)
        window = _free_line(costs, (x0, y0), (x1, y1), reach, window)
    return window


@kernel
def _free_line(costs, begin, end, reach, window):
    """Free the cells from one to another (column, row); returns the window grown by those changed."""
    x0, y0 = begin
    x1, y1 = end
    cells = line_cells(x0, y0, x1, y1)
    length = math.hypot(x1 - x0, y1 - y0)
    last = len(cells) if length <= reach else int(reach / length * (len(cells) - 1)) + 1
    for k in range(last):
        x, y = cells[k]
        if costs[y, x] != FREE:
            costs[y, x] = FREE
            window = grown(window, x, y)
    return window


@kernel
def mark_points(marks: Marks, grid: Grid, t: float, sensor: np.ndarray, points: np.ndarray, reach: Reach) -> Window:
    """Make lethal, at t (s), the cells of points (n, 3), m, within ``reach`` of the sensor (3,)."""
    origin_x, origin_y, resolution = grid
    costs, marked_at = marks.costs, marks.marked_at
    height, width = costs.shape
    timed = marked_at.shape == costs.shape
    window = (width, height, 0, 0)
    for i in range(len(points)):
        dx, dy, dz = points[i, 0] - sensor[0], points[i, 1] - sensor[1], points[i, 2] - sensor[2]
        if points[i, 2] > reach.highest or dx * dx + dy * dy + dz * dz >= reach.obstacle_range**2:
            continue
        u, v = (points[i, 0] - origin_x) / resolution, (points[i, 1] - origin_y) / resolution
        if 0.0 <= u < width and 0.0 <= v < height:
            x, y = int(u), int(v)
            if timed:
                if t - marked_at[y, x] > GAP:
                    marks.since[y, x] = t
                marked_at[y, x] = t
            if costs[y, x] != LETHAL:
                costs[y, x] = LETHAL
                window = grown(window, x, y)
    return window


@kernel
def forget_marks(marks: Marks, since: float, until: float, cost: int) -> Window:
    """Give a ``cost`` to the lethal cells that were last marked from ``since`` until ``until``, s."""
    costs, marked_at = marks.costs, marks.marked_at
    height, width = costs.shape
    window = (width, height, 0, 0)
    for y in range(height):
        for x in range(width):
            if costs[y, x] == LETHAL and since <= marked_at[y, x] <= until:
                costs[y, x] = cost
                window = grown(window, x, y)
    return window


@kernel
def find_standing(marks: Marks, least: float) -> Window:
    """Bring ``stands`` up to date: lethal cells that were marked for ``least`` s; returns what changed."""
    height, width = marks.costs.shape
    window = (width, height, 0, 0)
    for y in range(height):
        for x in range(width):
            stands = marks.costs[y, x] == LETHAL and marks.marked_at[y, x] - marks.since[y, x] >= least
            if stands != marks.stands[y, x]:
                marks.stands[y, x] = stands
                window = grown(window, x, y)
    return window


@kernel
def far_from(
    costs: np.ndarray, grid: Grid, frame: tuple[float, float, float], points: np.ndarray, tolerance: float
) -> np.ndarray:
    """Which of the points (n, 3), m, are farther than ``tolerance`` (m) from every lethal cell of ``costs``, bool (n,).
    frame: x, y, yaw of the points' frame in that of the grid, a Grid.
    """
    origin_x, origin_y, resolution = grid
    height, width = costs.shape
    c, s = math.cos(frame[2]), math.sin(frame[2])
    reach = int(math.ceil(tolerance / resolution))
    result = np.ones(len(points), np.bool_)
    for i in range(len(points)):
        u = (frame[0] + c * points[i, 0] - s * points[i, 1] - origin_x) / resolution
        v = (frame[1] + s * points[i, 0] + c * points[i, 1] - origin_y) / resolution
        column, row = int(math.floor(u)), int(math.floor(v))
        for y in range(max(row - reach, 0), min(row + reach + 1, height)):
            for x in range(max(column - reach, 0), min(column + reach + 1, width)):
                if costs[y, x] == LETHAL:
                    dx, dy = max(abs(u - x - 0.5) - 0.5, 0.0), max(abs(v - y - 0.5) - 0.5, 0.0)
                    if math.hypot(dx, dy) * resolution <= tolerance:
                        result[i] = False
    return result


@kernel
def free_polygon(costs: np.ndarray, cells: np.ndarray) -> Window:
    """Free the cells of a convex polygon whose corners lie in ``cells`` (k, 2) int64 (column, row), its outline too."""
    height, width = costs.shape
    left, right = max(0, cells[:, 0].min()), min(width - 1, cells[:, 0].max())
    window = (width, height, 0, 0)
    if right < left:
        return window
    bottom = np.full(right - left + 1, height, np.int64)
    top = np.full(right - left + 1, -1, np.int64)
    for i in range(len(cells)):
        j = (i + 1) % len(cells)
        line = line_cells(cells[i, 0], cells[i, 1], cells[j, 0], cells[j, 1])
        for k in range(len(line)):
            x, y = line[k]
            if left <= x <= right:
                bottom[x - left], top[x - left] = min(bottom[x - left], y), max(top[x - left], y)
    for x in range(left, right + 1):
        for y in range(max(0, bottom[x - left]), min(height - 1, top[x - left]) + 1):
            if costs[y, x] != FREE:
                costs[y, x] = FREE
                window = grown(window, x, y)
    return window


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs, points = np.zeros((3, 3), np.uint8), np.zeros((1, 3))
    grid = Grid(0.0, 0.0, 1.0)
    clear_rays(costs, grid, (0.5, 0.5), points, 2)
    marks = Marks(costs, np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3), np.bool_))
    mark_points(marks, grid, 1.0, np.zeros(3), points, Reach(1.0, 1.0))
    find_standing(marks, 1.0)
    forget_marks(marks, 0.0, 1.0, FREE)
    far_from(costs, grid, (0.0, 0.0, 0.0), points, 0.1)
    free_polygon(costs, np.zeros((3, 2), np.int64))
