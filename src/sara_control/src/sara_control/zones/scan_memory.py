"""What a laser scanner has seen about the chair in the last seconds: which cells are free, and where it hit something.

A grid of fixed cells in the frame of reckoning.py, which follows the chair. A cell is free when a ray has passed
through it. Without being seen again it stays free only as long as nobody who walks can have come there: cells of which
nothing is known spread over it at walking speed, around what stands there. Compiled by numba.
"""

import math

import numpy as np

from ahead_of_time import kernel

CELL = 0.05  # m
CELLS = 128  # along each side
SLACK = 0.02  # m before a hit that are not called free: two standard deviations of a scanner
NEVER = -1.0e9


class ScanMemory:
    """walk: m/s at which somebody may come into a free cell that is not seen. memory: s for which anything is kept."""

    def __init__(self, walk: float, memory: float) -> None:
        warm()
        self._walk, self._memory = walk, memory
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._free, self._hit = np.full((2, CELLS, CELLS), NEVER)  # s, when last seen so
        self._hits = np.zeros((2, CELLS, CELLS))  # x, y of each cell's newest hit, m
        self._corner = None  # column, row of the grid's first cell, counted from the frame's origin
        self._newest = NEVER

    def add(self, stamp: float, sensor: tuple[float, float], ends: np.ndarray, hit: np.ndarray) -> None:
        """A sweep of stamp (s): the rays from `sensor` (x, y; m) reached `ends` (n, 2), and hit something there or not
        (n bool).
        """
        self._follow(sensor)
        gone = min(max(stamp - self._newest, 0.0), self._memory)
        # Somebody walks along rows and columns here, farther than as the crow flies.
        steps = math.ceil(math.sqrt(2.0) * self._walk * gone / CELL)
        if steps:
            spread(self._free, self._hit, stamp - self._memory, min(steps, CELLS))
        origin = CELL * self._corner[0], CELL * self._corner[1]
        mark((self._free, self._hit, self._hits), origin, sensor, ends, (hit, float(stamp)))
        self._newest = stamp

    def _follow(self, middle):
        """Keep the grid about a place (m)."""
        corner = tuple(int(math.floor(along / CELL)) - CELLS // 2 for along in middle)
        if self._corner is None:
            self._corner = corner
        columns, rows = corner[0] - self._corner[0], corner[1] - self._corner[1]
        if max(abs(columns), abs(rows)) < CELLS // 8:
            return
        for grid, nothing in ((self._free, NEVER), (self._hit, NEVER), (self._hits[0], 0.0), (self._hits[1], 0.0)):
            _shift(grid, columns, rows, nothing)
        self._corner = corner

    def places(self) -> np.ndarray:
        """(n, 2) m where something was hit within the memory, and has not been seen through since."""
        if self._corner is None:
            return np.empty((0, 2))
        there = (self._hit > self._newest - self._memory) & (self._hit >= self._free)
        return np.ascontiguousarray(self._hits[:, there].T)

    def known(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool: which of `points` (n, 2; m) lie in cells that are free, or whose hit `places` tells."""
        if self._corner is None:
            return np.zeros(len(points), bool)
        origin = CELL * self._corner[0], CELL * self._corner[1]
        return are_known(self._free, self._hit, origin, points, self._newest - self._memory)


def _shift(grid, columns, rows, nothing):
    """Move the contents of a grid by whole cells, in place; what comes in is `nothing`."""
    old = grid.copy()
    grid[:] = nothing
    height, width = grid.shape
    if abs(columns) < width and abs(rows) < height:
        to = slice(max(-rows, 0), height - max(rows, 0)), slice(max(-columns, 0), width - max(columns, 0))
        of = slice(max(rows, 0), height - max(-rows, 0)), slice(max(columns, 0), width - max(-columns, 0))
        grid[to] = old[of]


@kernel
def mark(
    grids: tuple[np.ndarray, np.ndarray, np.ndarray],
    origin: tuple[float, float],
    sensor: tuple[float, float],
    ends: np.ndarray,
    what: tuple[np.ndarray, float],
) -> None:
    """Call the cells on the rays from `sensor` to `ends` (n, 2) free, then those of hits hit. grids: (free, hit, hits);
    what: (which rays hit, stamp).
    """
    free, hit, hits = grids
    was_hit, stamp = what
    rows, columns = free.shape
    for i in range(len(ends)):
        dx, dy = ends[i, 0] - sensor[0], ends[i, 1] - sensor[1]
        length = math.hypot(dx, dy)
        steps = int((length - SLACK) / (0.5 * CELL)) if length > SLACK else 0
        for k in range(steps + 1):
            share = k * 0.5 * CELL / length if length > 0.0 else 0.0
            column = int(math.floor((sensor[0] + share * dx - origin[0]) / CELL))
            row = int(math.floor((sensor[1] + share * dy - origin[1]) / CELL))
            if 0 <= row < rows and 0 <= column < columns:
                free[row, column] = stamp
    for i in range(len(ends)):
        column = int(math.floor((ends[i, 0] - origin[0]) / CELL))
        row = int(math.floor((ends[i, 1] - origin[1]) / CELL))
        if was_hit[i] and 0 <= row < rows and 0 <= column < columns:
            hit[row, column], free[row, column] = stamp, NEVER
            hits[0, row, column], hits[1, row, column] = ends[i, 0], ends[i, 1]


@kernel
def spread(free: np.ndarray, hit: np.ndarray, since: float, steps: int) -> None:
    """Cells that are not free take their neighbours, cell by cell, so many times. What was hit after `since` (s), and
    not seen through, stands in their way.
    """
    rows, columns = free.shape
    for _ in range(steps):
        before = free.copy()
        for row in range(rows):
            for column in range(columns):
                if before[row, column] <= since:
                    continue
                for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                    r, c = row + down, column + right
                    outside = r < 0 or c < 0 or r >= rows or c >= columns
                    if outside or (before[r, c] <= since and not (hit[r, c] > since and hit[r, c] >= before[r, c])):
                        free[row, column] = NEVER
                        break


@kernel
def are_known(
    free: np.ndarray, hit: np.ndarray, origin: tuple[float, float], points: np.ndarray, since: float
) -> np.ndarray:
    """Which `points` (n, 2) lie in cells that were seen free or hit after `since` (s)."""
    rows, columns = free.shape
    found = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        column = int(math.floor((points[i, 0] - origin[0]) / CELL))
        row = int(math.floor((points[i, 1] - origin[1]) / CELL))
        if 0 <= row < rows and 0 <= column < columns:
            found[i] = free[row, column] > since or hit[row, column] > since
    return found


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    free, hit, hits, points = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((2, 3, 3)), np.ones((1, 2))
    mark((free, hit, hits), (0.0, 0.0), (0.1, 0.1), points, (np.ones(1, np.bool_), 1.0))
    spread(free, hit, 0.0, 1)
    are_known(free, hit, (0.0, 0.0), points, 0.0)
