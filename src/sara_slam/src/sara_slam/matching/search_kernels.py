"""Compiled loops of the correlative search (Olson 2009, section III): the best of all poses in a window, exactly.

Scores are whole numbers, so their sums do not depend on the order of addition, and the same input gives the same pose.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel


class Search(NamedTuple):
    """x, y, yaw: the predicted pose in the grid, cells and rad. The window: `blocks` by `blocks` blocks of `block` by
    `block` cells about it; `margin`: cells to the grid's edge that a shifted point needs. A pose is worse by
    shift_weight * (shift / cells)^2 + turn_weight * (turn / rad)^2 than its score.
    """

    x: float
    y: float
    yaw: float
    blocks: int
    block: int
    margin: int
    shift_weight: float
    turn_weight: float


@kernel
def _cells(points, search, turn, shape):
    """(n, 2) rows and columns of the points (m, 2) of the robot at the predicted place with an additional turn (rad);
    only those that the margin surrounds.
    """
    c, s = math.cos(search.yaw + turn), math.sin(search.yaw + turn)
    found = np.empty((len(points), 2), np.int64)
    count, margin = 0, search.margin
    for k in range(len(points)):
        column = int(math.floor(search.x + c * points[k, 0] - s * points[k, 1]))
        row = int(math.floor(search.y + s * points[k, 0] + c * points[k, 1]))
        if margin <= row < shape[0] - margin and margin <= column < shape[1] - margin:
            found[count, 0], found[count, 1] = row, column
            count += 1
    return found[:count]


@kernel
def _penalty(dx, dy, turn, search):
    return search.shift_weight * (dx * dx + dy * dy) + search.turn_weight * turn * turn


@kernel
def _nearest_to_0(start, block):
    """The number nearest to 0 of start to start + block - 1."""
    return 0.0 if start <= 0 <= start + block - 1 else float(min(abs(start), abs(start + block - 1)))


@kernel
def bounds(coarse: np.ndarray, points: np.ndarray, turns: np.ndarray, search: Search) -> np.ndarray:
    """(turns, blocks, blocks) what no pose of a block of shifts exceeds.

    coarse: grid_kernels.pooled by `block`; points (n, 2) in the robot's frame, cells; turns (a,), rad.
    """
    blocks, block = search.blocks, search.block
    result = np.empty((len(turns), blocks, blocks))
    first = -(blocks * block) // 2
    for a in range(len(turns)):
        cells = _cells(points, search, turns[a], coarse.shape)
        for i in range(blocks):
            for j in range(blocks):
                dy, dx = first + i * block, first + j * block
                total = 0
                for k in range(len(cells)):
                    total += coarse[cells[k, 0] + dy, cells[k, 1] + dx]
                least = _penalty(_nearest_to_0(dx, block), _nearest_to_0(dy, block), turns[a], search)
                result[a, i, j] = total - least
    return result


@kernel
def best_shift(
    grid: np.ndarray, points: np.ndarray, turns: np.ndarray, search: Search, most: np.ndarray, order: np.ndarray
) -> tuple[float, int, int, int]:
    """(score less penalty, index of the turn, dx, dy in cells) of the best pose of all.

    most: `bounds` of the same search; order: the flat indices of its values, greatest first.
    """
    blocks, block = search.blocks, search.block
    best = (-1e300, 0, 0, 0)
    first = -(blocks * block) // 2
    turn_of_cells, cells = -1, np.empty((0, 2), np.int64)
    for n in range(len(order)):
        index = order[n]
        a, i, j = index // (blocks * blocks), index // blocks % blocks, index % blocks
        if most[a, i, j] <= best[0]:
            break
        if a != turn_of_cells:
            cells = _cells(points, search, turns[a], grid.shape)
            turn_of_cells = a
        for dy in range(first + i * block, first + (i + 1) * block):
            for dx in range(first + j * block, first + (j + 1) * block):
                total = 0
                for k in range(len(cells)):
                    total += grid[cells[k, 0] + dy, cells[k, 1] + dx]
                score = total - _penalty(float(dx), float(dy), turns[a], search)
                if score > best[0]:
                    best = (score, a, dx, dy)
    return best


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    grid, points, turns = np.zeros((8, 8), np.uint8), np.zeros((1, 2)), np.zeros(1)
    search = Search(4.0, 4.0, 0.0, 2, 1, 2, 0.0, 0.0)
    most = bounds(grid, points, turns, search)
    best_shift(grid, points, turns, search, most, np.argsort(most, axis=None))
