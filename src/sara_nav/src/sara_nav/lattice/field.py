"""How far every point of a map is from the nearest obstacle, and how long the path from there to the goal takes
at least.

Obstacles are whole cells, not cells' centres: the nearest point of a square to a grid's corner is a corner again, so
that the exact distances between corners of cells (distances.py), corners of obstacles being the obstacles, are those to
the cells' true areas. Between corners they are interpolated bilinearly, which is exact along straight walls. The edge
of the map counts as an obstacle.

The wave (potential.py) runs over the corners too, from the goal, as if the robot were the circle that fits into it: no
oriented body can be faster, and so the wave is a search's lower bound (the obstacle-aware heuristic of Dolgov et al.
2010, "Path Planning for Autonomous Vehicles in Unknown Semi-structured Environments").
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from ahead_of_time import kernel
from sara_common.grids import distances
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import LETHAL, UNKNOWN
from sara_nav.planners import potential

BLOCKED = 255
"""Step of a corner that the wave may not enter."""
UNIT = 20
"""Step of a corner where nothing slows the robot; others are as many times dearer, up to BLOCKED - 1."""


@kernel
def corners_of(costs: np.ndarray, unknown_blocks: bool) -> np.ndarray:
    """Return uint8 (rows + 1, columns + 1): 254 at corners of obstacle cells and on the map's edge, else 0."""
    rows, columns = costs.shape
    corners = np.zeros((rows + 1, columns + 1), np.uint8)
    corners[0, :] = LETHAL
    corners[rows, :] = LETHAL
    for i in range(rows):
        line = costs[i]
        corners[i + 1, 0] = LETHAL
        corners[i + 1, columns] = LETHAL
        for j in range(columns):
            if line[j] == LETHAL or (line[j] == UNKNOWN and unknown_blocks):
                corners[i, j] = LETHAL
                corners[i, j + 1] = LETHAL
                corners[i + 1, j] = LETHAL
                corners[i + 1, j + 1] = LETHAL
    return corners


@kernel
def as_metres(squares: np.ndarray, table: np.ndarray, result: np.ndarray) -> None:
    """Put the distance (m, float32) of each squared distance (cells) into ``result``; beyond the table, its last."""
    last = len(table) - 1
    for i in range(squares.shape[0]):
        for j in range(squares.shape[1]):
            result[i, j] = table[min(squares[i, j], last)]


@kernel
def distance_at(field: np.ndarray, u: float, v: float) -> float:
    """Return the distance (m) at the point u columns, v rows from the map's corner; 0 off the map and for NaN."""
    rows, columns = field.shape
    if not (0.0 <= u < columns - 1 and 0.0 <= v < rows - 1):
        return 0.0
    i, j = int(v), int(u)
    a, b = u - j, v - i
    low = field[i, j] * (1.0 - a) + field[i, j + 1] * a
    high = field[i + 1, j] * (1.0 - a) + field[i + 1, j + 1] * a
    return low * (1.0 - b) + high * b


@kernel
def lay_out(squares: np.ndarray, table: np.ndarray, steps: np.ndarray, wave: np.ndarray, pending: np.ndarray) -> None:
    """Prepare potential.spread over the corners: steps by squared distance (table uint8), nothing reached yet."""
    rows, columns = squares.shape
    width, last = columns + 2, len(table) - 1
    steps[:width] = BLOCKED
    steps[(rows + 1) * width :] = BLOCKED
    for i in range(rows):
        at = (i + 1) * width
        steps[at] = BLOCKED
        steps[at + columns + 1] = BLOCKED
        for j in range(columns):
            steps[at + 1 + j] = table[min(squares[i, j], last)]
    wave[:] = potential.HIGH
    pending[:] = 0


class Field:
    """Distances (m) over one costmap, remembered while its costs stay as they are.

    reach: m, greater distances are not told apart. ``metres``: float32 (rows + 1, columns + 1).
    """

    def __init__(self, costmap: Costmap, unknown_blocks: bool, reach: float) -> None:
        g = self.geometry = costmap.geometry
        self.reach, self.unknown_blocks = reach, unknown_blocks
        self._costs = costmap.costs.copy()
        cells = math.ceil(reach / g.resolution)
        self._squares = distances.squared_distances(corners_of(costmap.costs, unknown_blocks), cells)
        self._table = (g.resolution * np.sqrt(np.arange(cells * cells + 2))).clip(max=reach).astype(np.float32)
        self.metres = np.empty(self._squares.shape, np.float32)
        as_metres(self._squares, self._table, self.metres)
        size = (self._squares.shape[0] + 2) * (self._squares.shape[1] + 2)
        self._steps, self._pending = np.empty(size, np.uint8), np.empty(size, np.uint8)
        self._buffers = [np.empty(size, np.uint32) for _ in range(3)]
        self._wave = np.empty(size, np.float32)

    def holds(self, costmap: Costmap, unknown_blocks: bool, reach: float) -> bool:
        """True when this is the field of that costmap still."""
        return (
            self.geometry == costmap.geometry
            and self.unknown_blocks == unknown_blocks
            and self.reach == reach
            and np.array_equal(self._costs, costmap.costs)
        )

    def at(self, x: float, y: float) -> float:
        """Return the distance (m) at a point (m)."""
        g = self.geometry
        return float(distance_at(self.metres, (x - g.origin_x) / g.resolution, (y - g.origin_y) / g.resolution))

    def wave_from(self, sources: Iterable, slowness: Callable) -> np.ndarray:
        """Return float32 (rows + 1, columns + 1): the time (s) that the path to the nearest source takes,
        potential.HIGH: no path.

        sources: (x, y, seconds) m, s. slowness: function of distances (m, array) that gives s/m, inf where no path
        leads.
        """
        g = self.geometry
        rows, columns = self._squares.shape
        pace = slowness(self._table.astype(float))
        fastest = float(pace.min())
        scale = UNIT / (fastest * g.resolution)
        table = np.where(np.isfinite(pace), np.minimum(UNIT * pace / fastest, BLOCKED - 1), BLOCKED).astype(np.uint8)
        lay_out(self._squares, table, self._steps, self._wave, self._pending)
        width, count, first = columns + 2, 0, self._buffers[0]
        for x, y, seconds in sources:
            u, v = (x - g.origin_x) / g.resolution, (y - g.origin_y) / g.resolution
            for i in (int(v), int(v) + 1):
                for j in (int(u), int(u) + 1):
                    if not (0 <= i < rows and 0 <= j < columns):
                        continue
                    at = (i + 1) * width + j + 1
                    value = np.float32(UNIT * math.hypot(u - j, v - i) + scale * seconds)
                    if value < self._wave[at]:
                        self._wave[at] = value
                        for near in (at - 1, at + 1, at - width, at + width):
                            if not self._pending[near] and self._steps[near] < BLOCKED and count < 1024:
                                self._pending[near] = 1
                                first[count] = near
                                count += 1
        field = potential.Field(self._steps, self._wave, self._pending, width, BLOCKED)
        potential.spread(field, tuple(self._buffers), count, potential.Wave(-1, 4.0 * UNIT, True))
        inner = self._wave.reshape(rows + 2, width)[1:-1, 1:-1]
        return np.where(inner < potential.HIGH, inner / np.float32(scale), potential.HIGH)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    squares = distances.squared_distances(corners_of(np.zeros((3, 3), np.uint8), True), 2)
    metres = np.empty((4, 4), np.float32)
    as_metres(squares, np.zeros(5, np.float32), metres)
    distance_at(metres, 1.0, 1.0)
    lay_out(squares, np.zeros(5, np.uint8), np.zeros(36, np.uint8), np.zeros(36, np.float32), np.zeros(36, np.uint8))
    potential.warm()
