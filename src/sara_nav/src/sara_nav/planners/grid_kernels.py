"""The hot loops of planning, compiled by numba and cached on disk.

Grids are uint8 cost arrays [row, column]; positions are in cells (x = column, y = row, centres at +0.5) where
the name ends in ``_cells``, else in metres. Call ``warm()`` once at start so that nothing compiles on the move.
"""

import heapq
import math

import numpy as np

from ahead_of_time import kernel

LETHAL, UNKNOWN = 254, 255
BLOCKED_FROM = 253
NEUTRAL_COST, COST_FACTOR = 50.0, 0.8
"""Driving through one cell of cost c costs (NEUTRAL_COST + COST_FACTOR c)/NEUTRAL_COST cells, navfn's weights."""
STEPS = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
ROOT_2 = math.sqrt(2.0)


@kernel
def astar(
    costs: np.ndarray, start_column: int, start_row: int, goal_column: int, goal_row: int, allow_unknown: bool
) -> np.ndarray:
    """Return the cheapest 8-connected way as an int64 array (n, 2) of (column, row), empty when there is none.

    A* (Hart, Nilsson, Raphael 1968) with the octile distance, which never overestimates as no cell costs less
    than 1. Cells of cost 253 and more are walls, but for the one the robot stands in; unknown cells are free
    or walls as asked. A diagonal step must not squeeze between two walls.
    """
    height, width = costs.shape
    reached = np.full(height * width, np.inf)
    parent = np.full(height * width, -1, np.int64)
    done = np.zeros(height * width, np.uint8)
    start, goal = start_row * width + start_column, goal_row * width + goal_column
    weight = _weights(allow_unknown)
    reached[start] = 0.0
    heap = [(0.0, start)]
    while len(heap) > 0:
        _, cell = heapq.heappop(heap)
        if done[cell]:
            continue
        done[cell] = 1
        if cell == goal:
            return _way_back(parent, start, goal, width)
        row, column = cell // width, cell % width
        for dx, dy in STEPS:
            x, y = column + dx, row + dy
            if x < 0 or y < 0 or x >= width or y >= height:
                continue
            cost = reached[cell] + _step_cost(costs, weight, (column, row), (x, y))
            index = y * width + x
            if cost < reached[index]:
                reached[index] = cost
                parent[index] = cell
                heapq.heappush(heap, (_estimate(cost, abs(x - goal_column), abs(y - goal_row)), index))
    return np.empty((0, 2), np.int64)


@kernel
def _weights(allow_unknown):
    """Return what driving through a cell costs, in cells, over the costs of a costmap (256,); infinite: a wall."""
    weight = np.empty(256)
    for c in range(256):
        weight[c] = (NEUTRAL_COST + COST_FACTOR * c) / NEUTRAL_COST if c < BLOCKED_FROM else np.inf
    weight[UNKNOWN] = (NEUTRAL_COST + COST_FACTOR * BLOCKED_FROM) / NEUTRAL_COST if allow_unknown else np.inf
    return weight


@kernel
def _step_cost(costs, weight, begin, end):
    """Return what the step between two neighbours (column, row) costs; infinite where there is none."""
    (column, row), (x, y) = begin, end
    here, there = weight[costs[row, column]], weight[costs[y, x]]
    if here == np.inf:
        here = 1.0
    length = 1.0
    if x != column and y != row:
        if weight[costs[row, x]] == np.inf or weight[costs[y, column]] == np.inf:
            return np.inf
        length = ROOT_2
    return length * 0.5 * (here + there)


@kernel
def _estimate(cost, columns, rows):
    """Return what the whole way costs at least (cells) that has cost so much with so many columns and rows to go."""
    return cost + max(columns, rows) + (ROOT_2 - 1.0) * min(columns, rows)


@kernel
def _way_back(parent, start, goal, width):
    """Return the cells (n, 2) from the start to the goal."""
    n = 1
    cell = goal
    while cell != start:
        cell = parent[cell]
        n += 1
    path = np.empty((n, 2), np.int64)
    cell = goal
    for i in range(n - 1, -1, -1):
        path[i, 0] = cell % width
        path[i, 1] = cell // width
        cell = parent[cell]
    return path


@kernel
def line_cost(costs: np.ndarray, x0: float, y0: float, x1: float, y1: float, allow_unknown: bool) -> float:
    """Return what the straight way between two points (cells) costs, infinite when it meets a wall.

    Every cell the line runs through counts by the length it runs there (the walk of Amanatides and Woo 1987).
    """
    height, width = costs.shape
    dx, dy = x1 - x0, y1 - y0
    length = math.hypot(dx, dy)
    column, row = int(math.floor(x0)), int(math.floor(y0))
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    share_x = abs(1.0 / dx) if dx != 0.0 else math.inf  # share of the line from one side of a cell to the next
    share_y = abs(1.0 / dy) if dy != 0.0 else math.inf
    next_x = ((column + 1 - x0) if dx > 0.0 else (x0 - column)) * share_x if dx != 0.0 else math.inf
    next_y = ((row + 1 - y0) if dy > 0.0 else (y0 - row)) * share_y if dy != 0.0 else math.inf
    total, at = 0.0, 0.0
    while True:
        if column < 0 or row < 0 or column >= width or row >= height:
            return np.inf
        c = costs[row, column]
        if c == UNKNOWN and allow_unknown:
            c = BLOCKED_FROM
        elif c >= BLOCKED_FROM:
            return np.inf
        until = min(next_x, next_y, 1.0)
        total += (until - at) * (NEUTRAL_COST + COST_FACTOR * c) / NEUTRAL_COST
        if until >= 1.0:
            return total * length
        at = until
        if next_x <= next_y:
            next_x += share_x
            column += step_x
        else:
            next_y += share_y
            row += step_y


@kernel
def shorten(costs: np.ndarray, points: np.ndarray, allow_unknown: bool, slack: float, window: int) -> np.ndarray:
    """Return the indices of the points to keep when a way is pulled straight.

    points: (n, 2) in cells. From each kept point on, the furthest of the next ``window`` points is taken that a
    straight line reaches at no more than (1 + slack) times the cost of the way between them.
    """
    n = len(points)
    along = np.zeros(n)
    for i in range(1, n):
        step = line_cost(costs, points[i - 1, 0], points[i - 1, 1], points[i, 0], points[i, 1], allow_unknown)
        if step == np.inf:  # the first or last cell may be one the robot should not be in
            step = 5.0 * math.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
        along[i] = along[i - 1] + step
    keep = np.empty(n, np.int64)
    keep[0] = 0
    count = 1
    i = 0
    while i < n - 1:
        chosen = i + 1
        for j in range(min(n - 1, i + window), i + 1, -1):
            straight = line_cost(costs, points[i, 0], points[i, 1], points[j, 0], points[j, 1], allow_unknown)
            if straight <= (1.0 + slack) * (along[j] - along[i]):
                chosen = j
                break
        i = chosen
        keep[count] = i
        count += 1
    return keep[:count].copy()


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs = np.zeros((3, 3), np.uint8)
    path = astar(costs, 0, 0, 2, 2, False)
    shorten(costs, path + 0.5, False, 0.05, 10)
