"""The cells under a robot's outline, and what they cost: Bresenham's lines (1965) as base_local_planner draws them.

Cells are (column, row). A line is stepped along its longer axis; it moves along the other one when the running sum of
the shorter length, begun at half the longer, reaches the longer. So lines, and with them footprint costs, are the
C++ peer's to the cell.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids.grid import Grid

LETHAL, UNKNOWN = 254, 255
SLACK = 2
"""Cells by which a drawn outline is off the true one at most, once its corners and a point are brought to cells."""
ALL = -1
"""Reach of Around with which outlines are drawn wherever they are."""
HIT_LETHAL, HIT_UNKNOWN, OFF_MAP = -1, -2, -3
"""What an outline costs where it may not be, as costmap_2d's CostmapModel has it."""


class Around(NamedTuple):
    """The highest costs about each cell, so that lines need not be drawn where nothing is high."""

    costs: np.ndarray
    """uint8 (h, w), of ``highest_around``."""
    reach: int
    """Cells that it was made with; ALL: there is no such array, the map itself stands in for it."""


class Placed(NamedTuple):
    """How a footprint lies on a costmap: multiplied by ``scale``, turned by a yaw, moved."""

    scale: float
    x: float
    """m, costmap's frame."""
    y: float
    cosine: float
    """Of the yaw."""
    sine: float


@kernel
def line_cells(x0: int, y0: int, x1: int, y1: int) -> np.ndarray:
    """Return the cells int64 (n, 2) of the line from cell (x0, y0) to (x1, y1), both included."""
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx = 1 if x1 >= x0 else -1
    sy = 1 if y1 >= y0 else -1
    longer, shorter = max(dx, dy), min(dx, dy)
    cells = np.empty((longer + 1, 2), np.int64)
    x, y, rest = x0, y0, longer // 2
    for i in range(longer + 1):
        cells[i, 0], cells[i, 1] = x, y
        rest += shorter
        aside = rest >= longer
        if aside:
            rest -= longer
        if dx >= dy:
            x += sx
            y += sy if aside else 0
        else:
            y += sy
            x += sx if aside else 0
    return cells


@kernel
def line_cost(costs: np.ndarray, x0: int, y0: int, x1: int, y1: int) -> int:
    """Return the highest cost on the line between two cells of the map, or HIT_LETHAL or HIT_UNKNOWN."""
    return _line_above(costs, Around(costs, ALL), 0, (x0, y0), (x1, y1))


@kernel
def _line_above(costs, around, floor, begin, end):
    """See ``outline_above``, for the line between two cells (column, row) of the map."""
    x0, y0 = begin
    x1, y1 = end
    reach = around.reach
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx = 1 if x1 >= x0 else -1
    sy = 1 if y1 >= y0 else -1
    if dx >= dy:
        longer, shorter, ahead_x, ahead_y, aside_x, aside_y = dx, dy, sx, 0, 0, sy
    else:
        longer, shorter, ahead_x, ahead_y, aside_x, aside_y = dy, dx, 0, sy, sx, 0
    per_step = 1.0 / max(longer, 1)
    first = 0
    while first <= longer:
        middle, last = min(first + max(reach, 0), longer), longer if reach == ALL else min(first + 2 * reach, longer)
        aside = _asides(middle, longer, shorter, per_step)
        x, y = x0 + middle * ahead_x + aside * aside_x, y0 + middle * ahead_y + aside * aside_y
        if reach == ALL or around.costs[np.uint64(y), np.uint64(x)] > floor:
            aside = _asides(first, longer, shorter, per_step)
            x, y = x0 + first * ahead_x + aside * aside_x, y0 + first * ahead_y + aside * aside_y
            rest = longer // 2 + first * shorter - aside * longer
            for _ in range(first, last + 1):
                cost = np.int64(costs[np.uint64(y), np.uint64(x)])
                if cost > floor:
                    if cost >= LETHAL:
                        return HIT_LETHAL if cost == LETHAL else HIT_UNKNOWN
                    floor = cost
                rest += shorter
                turn = 1 if rest >= longer else 0
                rest -= turn * longer
                x += ahead_x + turn * aside_x
                y += ahead_y + turn * aside_y
        first = last + 1
    return floor


@kernel
def _asides(step, longer, shorter, share):
    """Return how many of the first ``step`` steps of a line also went along its shorter axis; share: 1/longer."""
    return int((longer // 2 + step * shorter + 0.5) * share)  # half is far from a whole number: no rounding matters


@kernel
def outline_cost(costs: np.ndarray, grid: Grid, corners: np.ndarray, placed: Placed) -> int:
    """Return the highest cost under the outline of a footprint, or HIT_LETHAL, HIT_UNKNOWN, OFF_MAP.

    grid: a Grid. corners: (k, 2) m, robot's frame. placed: a Placed.
    """
    return outline_above(costs, Around(costs, ALL), 0, grid, corners, placed)


@kernel
def outline_above(
    costs: np.ndarray, around: Around, floor: int, grid: Grid, corners: np.ndarray, placed: Placed
) -> int:
    """Return what ``outline_cost`` does, but ``floor`` where that is higher.

    around: an Around; where it is no higher than the floor, the outline is not drawn.
    """
    scale, x, y, cosine, sine = placed
    origin_x, origin_y, resolution = grid
    height, width = costs.shape
    px, py = (x - origin_x) / resolution, (y - origin_y) / resolution
    if not (px >= 0.0 and py >= 0.0 and px < width and py < height):
        return OFF_MAP
    start, before = (0, 0), (0, 0)
    for i in range(len(corners)):
        px = (x + scale * (corners[i, 0] * cosine - corners[i, 1] * sine) - origin_x) / resolution
        py = (y + scale * (corners[i, 0] * sine + corners[i, 1] * cosine) - origin_y) / resolution
        if not (px >= 0.0 and py >= 0.0 and px < width and py < height):
            return OFF_MAP
        cell = int(px), int(py)
        if i == 0:
            start = cell
        else:
            floor = _line_above(costs, around, floor, before, cell)
            if floor < 0:
                return floor
        before = cell
    return _line_above(costs, around, floor, before, start)


@kernel
def points_along(corners: np.ndarray, gap: float) -> np.ndarray:
    """Return points (n, 2) along the outline of corners (k, 2), such that every point of it has one within half of
    ``gap`` (m).
    """
    pieces = np.empty(len(corners), np.int64)
    for i in range(len(corners)):
        pieces[i] = max(
            1, math.ceil(math.hypot(corners[i, 0] - corners[i - 1, 0], corners[i, 1] - corners[i - 1, 1]) / gap)
        )
    points = np.empty((pieces.sum(), 2))
    n = 0
    for i in range(len(corners)):
        for j in range(pieces[i]):
            share = (j + 0.5) / pieces[i]
            points[n] = corners[i - 1] + share * (corners[i] - corners[i - 1])
            n += 1
    return points


@kernel
def is_below(around: Around, floor: int, grid: Grid, points: np.ndarray, placed: Placed) -> bool:
    """True when an outline that lies on the map, of points_along, surely costs no more than ``floor``; False says
    nothing.

    around: an Around whose reach is SLACK cells more than half the gap between points. placed: a Placed.
    """
    scale, x, y, cosine, sine = placed
    origin_x, origin_y, resolution = grid
    cells = 1.0 / resolution
    for i in range(len(points)):
        column = (x + scale * (points[i, 0] * cosine - points[i, 1] * sine) - origin_x) * cells
        row = (y + scale * (points[i, 0] * sine + points[i, 1] * cosine) - origin_y) * cells
        if around.costs[np.uint64(row), np.uint64(column)] > floor:
            return False
    return True


@kernel
def highest_around(costs: np.ndarray, reach: int) -> np.ndarray:
    """Return uint8 like ``costs``: the highest cost within ``reach`` cells of a cell, along rows and columns, or a
    higher one.
    """
    height, width = costs.shape
    edge = reach * (width + 1)
    padded = np.zeros(2 * edge + costs.size, np.uint8)  # what a row's ends see of the rows beside only makes it more
    padded[edge : edge + costs.size] = costs.ravel()
    return _highest(_highest(padded, 2 * reach + 1, 1), 2 * reach + 1, width).reshape(costs.shape)


@kernel
def cost_ceiling(costs: np.ndarray, column: int, row: int, half: int, reach: int) -> np.ndarray:
    """Return uint8 like ``costs``: the highest cost within ``reach`` cells of a cell, along rows and columns.

    Only cells up to ``half`` from (column, row), whose surroundings lie on the map, are worked out; all others hold
    255. Where the ceiling is no higher than what a trajectory costs already, its outline need not be drawn.
    """
    height, width = costs.shape
    ceiling = np.full((height, width), np.uint8(255))
    x0, x1 = max(column - half, reach), min(column + half, width - 1 - reach)
    y0, y1 = max(row - half, reach), min(row + half, height - 1 - reach)
    if x1 < x0 or y1 < y0:
        return ceiling
    block = costs[y0 - reach : y1 + reach + 1, x0 - reach : x1 + reach + 1].copy()
    stride = block.shape[1]
    best = _highest(_highest(block.ravel(), 2 * reach + 1, 1), 2 * reach + 1, stride)
    for j in range(y1 - y0 + 1):
        for i in range(x1 - x0 + 1):
            ceiling[y0 + j, x0 + i] = best[j * stride + i]
    return ceiling


@kernel
def _highest(values, span, stride):
    """Return uint8, for every i that has them all: the highest of the ``span`` values[i], values[i + stride], ..."""
    wide = 1
    while 2 * wide <= span:
        values = _higher(values, values[wide * stride :])
        wide *= 2
    return _higher(values, values[(span - wide) * stride :])


@kernel
def _higher(a, b):
    result = np.empty(len(b), np.uint8)
    for i in range(len(b)):
        result[i] = max(a[i], b[i])
    return result


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs = np.zeros((3, 3), np.uint8)
    line_cells(0, 0, 1, 1)
    line_cost(costs, 0, 0, 1, 1)
    grid, placed = Grid(0.0, 0.0, 1.0), Placed(1.0, 1.0, 1.0, 1.0, 0.0)
    around = Around(highest_around(costs, 1), 1)
    outline_cost(costs, grid, np.zeros((4, 2)), placed)
    is_below(around, 0, grid, points_along(np.zeros((4, 2)), 1.0), placed)
    cost_ceiling(costs, 1, 1, 1, 1)
