"""The cells under a robot's outline, and what they cost: Bresenham's lines (1965) as base_local_planner draws them.

Cells are (column, row). A line is stepped along its longer axis; it moves along the other one when the running sum of
the shorter length, begun at half the longer, reaches the longer. So lines, and with them footprint costs, are the
C++ peer's to the cell.
"""
import math

import numpy as np
from ahead_of_time import kernel

LETHAL, UNKNOWN = 254, 255
HIT_LETHAL, HIT_UNKNOWN, OFF_MAP = -1, -2, -3
"""What an outline costs where it may not be, as costmap_2d's CostmapModel has it."""


@kernel
def line_cells(x0, y0, x1, y1):
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
def line_cost(costs, x0, y0, x1, y1):
    """Return the highest cost on the line between two cells of the map, or HIT_LETHAL or HIT_UNKNOWN."""
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx = 1 if x1 >= x0 else -1
    sy = 1 if y1 >= y0 else -1
    if dx >= dy:
        longer, shorter, ahead_x, ahead_y, aside_x, aside_y = dx, dy, sx, 0, 0, sy
    else:
        longer, shorter, ahead_x, ahead_y, aside_x, aside_y = dy, dx, 0, sy, sx, 0
    x, y, rest, worst = x0, y0, longer // 2, 0
    for _ in range(longer + 1):
        cost = np.int64(costs[y, x])
        if cost > worst:
            if cost >= LETHAL:
                return HIT_LETHAL if cost == LETHAL else HIT_UNKNOWN
            worst = cost
        rest += shorter
        if rest >= longer:
            rest -= longer
            x += aside_x
            y += aside_y
        x += ahead_x
        y += ahead_y
    return worst


@kernel
def outline_cost(costs, origin_x, origin_y, resolution, corners, scale, x, y, cosine, sine):
    """Return the highest cost under the outline of a footprint, or HIT_LETHAL, HIT_UNKNOWN, OFF_MAP.

    corners (k, 2) m, robot's frame, multiplied by ``scale``; x, y (m) and cosine, sine of the yaw, costmap's frame.
    """
    height, width = costs.shape
    px, py = (x - origin_x) / resolution, (y - origin_y) / resolution
    if not (px >= 0.0 and py >= 0.0 and px < width and py < height):
        return OFF_MAP
    start_x, start_y, x0, y0, worst = 0, 0, 0, 0, 0
    for i in range(len(corners)):
        px = (x + scale * (corners[i, 0] * cosine - corners[i, 1] * sine) - origin_x) / resolution
        py = (y + scale * (corners[i, 0] * sine + corners[i, 1] * cosine) - origin_y) / resolution
        if not (px >= 0.0 and py >= 0.0 and px < width and py < height):
            return OFF_MAP
        x1, y1 = int(px), int(py)
        if i == 0:
            start_x, start_y = x1, y1
        else:
            cost = line_cost(costs, x0, y0, x1, y1)
            if cost < 0:
                return cost
            worst = max(worst, cost)
        x0, y0 = x1, y1
    cost = line_cost(costs, x0, y0, start_x, start_y)
    return cost if cost < 0 else max(worst, cost)


@kernel
def cost_ceiling(costs, column, row, half, reach):
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
    along = np.empty((y1 - y0 + 1 + 2 * reach, x1 - x0 + 1), np.uint8)
    for j in range(along.shape[0]):
        for i in range(along.shape[1]):
            worst = np.uint8(0)
            for k in range(2 * reach + 1):
                worst = max(worst, costs[y0 - reach + j, x0 - reach + i + k])
            along[j, i] = worst
    for j in range(y1 - y0 + 1):
        for i in range(along.shape[1]):
            worst = np.uint8(0)
            for k in range(2 * reach + 1):
                worst = max(worst, along[j + k, i])
            ceiling[y0 + j, x0 + i] = worst
    return ceiling


def footprint_cells(pose, footprint, geometry, fill=False):
    """Return the cells int64 (n, 2) of a footprint's outline, edge after edge, and of its inside when ``fill``.

    pose: Pose2D in the costmap's frame; footprint (k, 2) m. Corners between two edges are there twice; cells of the
    inside come last, column by column. Empty when a corner lies off the map.
    """
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    cells = [geometry.to_cell(pose.x + c * x - s * y, pose.y + s * x + c * y) for x, y in footprint]
    if None in cells:
        return np.empty((0, 2), np.int64)
    outline = np.vstack([line_cells(*a, *b) for a, b in zip(cells, cells[1:] + cells[:1])])
    if not fill:
        return outline
    inside = [outline]
    for column in range(outline[:, 0].min(), outline[:, 0].max() + 1):
        rows = outline[outline[:, 0] == column, 1]
        between = np.arange(rows.min() + 1, rows.max())
        inside.append(np.column_stack([np.full(len(between), column), between]))
    return np.vstack(inside)


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs = np.zeros((3, 3), np.uint8)
    line_cells(0, 0, 1, 1)
    outline_cost(costs, 0.0, 0.0, 1.0, np.zeros((4, 2)), 1.0, 1.0, 1.0, 1.0, 0.0)
    cost_ceiling(costs, 1, 1, 1, 1)
