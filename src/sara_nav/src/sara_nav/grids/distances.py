"""The spreading of costs around obstacles by exact distances (sara_common.grids.distances); compiled by numba."""

from __future__ import annotations

import numpy as np

from ahead_of_time import kernel
from sara_common.grids.distances import along_columns, along_row
from sara_nav.grids import windows
from sara_nav.grids.grid import LETHAL, UNKNOWN
from sara_nav.grids.windows import Window


@kernel
def pick_lethal(costs: np.ndarray, obstacles: np.ndarray, window: Window) -> None:
    """Write 254 into a window of obstacles (uint8 (h, w)) where the costs hold it, else 0."""
    x0, y0, xn, yn = window
    for y in range(y0, yn):
        for x in range(x0, xn):
            obstacles[y, x] = LETHAL if costs[y, x] == LETHAL else 0


@kernel
def spread(
    obstacles: np.ndarray, costs: np.ndarray, window: Window, reach: int, table: np.ndarray, unknown_from: int
) -> None:
    """Raise the costs of a window by what the obstacles in and around it cost there.

    obstacles: uint8 (h, w), 254 where an obstacle is. costs: uint8 (h, w), changed in the window.
    table: cost (uint8) by squared distance in cells, reach^2 + 1 entries. A known cell keeps the greater cost; an
    unknown one takes a cost of at least ``unknown_from``.
    """
    x0, y0, xn, yn = window
    height, width = costs.shape
    left, right = max(0, x0 - reach), min(width, xn + reach)
    low, high = max(0, y0 - reach), min(height, yn + reach)
    squares = along_columns(obstacles, (left, low, right, high), reach)
    best = np.empty(right - left, np.float32)
    limit = np.float32(reach * reach)
    for y in range(y0, yn):
        if not along_row(squares[y - low], reach, best):
            continue
        for x in range(x0, xn):
            if best[x - left] <= limit:
                cost = table[np.int64(best[x - left])]
                if costs[y, x] == UNKNOWN:
                    if cost >= unknown_from:
                        costs[y, x] = cost
                elif cost > costs[y, x]:
                    costs[y, x] = cost


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs = np.zeros((3, 3), np.uint8)
    pick_lethal(costs, costs.copy(), (0, 0, 3, 3))
    windows.warm()
    spread(costs, costs, (0, 0, 3, 3), 2, np.zeros(5, np.uint8), 1)
