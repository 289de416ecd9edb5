"""What a laser scanner has seen about the chair in the last seconds: which cells are free, and where it hit something.

A grid of fixed cells in the frame of reckoning.py, which follows the chair. A cell is free when a ray has passed
through it. Without being seen again it stays free only as long as nobody who walks can have come there: cells of which
nothing is known spread over it at walking speed, around what stands there.

What stood still for a while is a wall or a jamb, and is remembered longer: a chair that waits in a door must know of
the jamb that its front has passed. What is hit in a cell that was free, as all about it and behind it was, moves.
Compiled by numba.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel

CELL = 0.05  # m
CELLS = 160  # along each side
SLACK = 0.02  # m before a hit that are not called free: two standard deviations of a scanner
STILL = 1.0  # s for which what is hit again and again in a cell stands still
GAP = 0.5  # s that may be between two hits of the same thing
ABOUT = 2  # cells about a hit, farther than noise moves a wall,
BEHIND = 0.1, 0.15  # and m behind it, through which rays had passed if it came there
NEVER = -1.0e9


class Cells(NamedTuple):
    """Arrays (rows, columns). free: s, when last seen so; NEVER once something is hit, or somebody may be there. seen:
    s, when a ray passed last, whatever came later. hit: s, when last hit; since: from when on without a GAP. came:
    whether what is hit came to where it was free. x, y: m, of the newest hit.
    """

    free: np.ndarray
    seen: np.ndarray
    hit: np.ndarray
    since: np.ndarray
    came: np.ndarray
    x: np.ndarray
    y: np.ndarray


class ScanMemory:
    """walk: m/s at which somebody may come into a free cell that is not seen. memory: s for which what was seen is
    kept; still_memory: s for what stood still.
    """

    def __init__(self, walk: float, memory: float, still_memory: float) -> None:
        warm()
        self._walk, self._memory, self._still_memory = walk, memory, still_memory
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._cells = nothing_seen(CELLS)
        self._corner = None  # column, row of the grid's first cell, counted from the frame's origin
        self._newest = NEVER
        self._there = np.zeros((CELLS, CELLS), bool)  # where something was hit and is remembered

    def add(self, stamp: float, sensor: tuple[float, float], ends: np.ndarray, hit: np.ndarray) -> None:
        """A sweep of stamp (s): the rays from `sensor` (x, y; m) reached `ends` (n, 2), and hit something there or not
        (n bool).
        """
        self._follow(sensor)
        gone = min(max(stamp - self._newest, 0.0), self._memory)
        # Somebody walks along rows and columns here, farther than as the crow flies.
        steps = math.ceil(math.sqrt(2.0) * self._walk * gone / CELL)
        if steps:
            spread(self._cells.free, self._remembered(stamp), stamp - self._memory, min(steps, CELLS))
        origin = CELL * self._corner[0], CELL * self._corner[1]
        mark(self._cells, origin, sensor, ends, (hit, float(stamp), float(stamp - self._memory)))
        self._newest, self._there = stamp, self._remembered(stamp)

    def _remembered(self, stamp):
        """(rows, columns) bool: where something was hit that at stamp (s) is remembered, and was not seen through."""
        cells = self._cells
        lately = cells.hit > stamp - self._memory
        still = (cells.hit - cells.since >= STILL) & (cells.hit > stamp - self._still_memory)
        return (lately | still) & (cells.hit >= cells.free)

    def _follow(self, middle):
        """Keep the grid about a place (m)."""
        corner = tuple(int(math.floor(along / CELL)) - CELLS // 2 for along in middle)
        if self._corner is None:
            self._corner = corner
        columns, rows = corner[0] - self._corner[0], corner[1] - self._corner[1]
        if max(abs(columns), abs(rows)) < CELLS // 8:
            return
        for grid, nothing in zip(self._cells, nothing_seen(1)):
            _shift(grid, columns, rows, nothing[0, 0])
        self._corner = corner

    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 2) m where something was hit that is remembered and has not been seen through since; (n,) bool: which of
        it moves.
        """
        cells, there = self._cells, self._there
        hit, since = cells.hit[there], cells.since[there]
        moves = cells.came[there] & (hit - since < STILL) & (hit > self._newest - GAP)
        return np.column_stack([cells.x[there], cells.y[there]]), moves

    def known(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool: which of `points` (n, 2; m) lie in cells that are free, or whose hit `places` tells."""
        if self._corner is None:
            return np.zeros(len(points), bool)
        origin = CELL * self._corner[0], CELL * self._corner[1]
        return are_known(self._cells.free, self._there, origin, points, self._newest - self._memory)


def nothing_seen(size: int) -> Cells:
    """The Cells of a square grid where nothing was seen."""
    free, seen, hit, since = np.full((4, size, size), NEVER)
    x, y = np.zeros((2, size, size))
    return Cells(free, seen, hit, since, np.zeros((size, size), bool), x, y)


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
def cell_of(origin: tuple[float, float], x: float, y: float) -> tuple[int, int]:
    """(row, column) of the cell in which (x, y) lies, m; of the grid or not."""
    return int(math.floor((y - origin[1]) / CELL)), int(math.floor((x - origin[0]) / CELL))


@kernel
def is_within(grid: np.ndarray, row: int, column: int) -> bool:
    """Whether a grid has that cell."""
    return 0 <= row < grid.shape[0] and 0 <= column < grid.shape[1]


@kernel
def came_there(
    seen: np.ndarray, origin: tuple[float, float], sensor: tuple[float, float], end: np.ndarray, since: float
) -> bool:
    """Whether a ray from `sensor` to `end` (2,) hits what came there: where it ends, in all cells about it, and behind
    it rays passed after `since` (s). About a wall's cell they do not, at whatever angle they come.
    """
    dx, dy = end[0] - sensor[0], end[1] - sensor[1]
    length = max(math.hypot(dx, dy), 1e-6)
    for behind in (0.0, *BEHIND):
        row, column = cell_of(origin, end[0] + behind * dx / length, end[1] + behind * dy / length)
        about = ABOUT if behind == 0.0 else 0
        for r in range(row - about, row + about + 1):
            for c in range(column - about, column + about + 1):
                if not (is_within(seen, r, c) and seen[r, c] > since):
                    return False
    return True


@kernel
def mark(
    cells: Cells,
    origin: tuple[float, float],
    sensor: tuple[float, float],
    ends: np.ndarray,
    what: tuple[np.ndarray, float, float],
) -> None:
    """Call the cells on the rays from `sensor` to `ends` (n, 2) free, but those of hits hit. what: (which rays hit,
    stamp, s from which on a cell that was seen free has not changed unseen).
    """
    was_hit, stamp, since = what
    for i in range(len(ends)):  # before this sweep's rays change what was seen
        row, column = cell_of(origin, ends[i, 0], ends[i, 1])
        if was_hit[i] and is_within(cells.hit, row, column):
            if stamp - cells.hit[row, column] > GAP:
                cells.since[row, column] = stamp
                cells.came[row, column] = came_there(cells.seen, origin, sensor, ends[i], since)
            cells.hit[row, column] = stamp
            cells.x[row, column], cells.y[row, column] = ends[i, 0], ends[i, 1]
    for i in range(len(ends)):
        dx, dy = ends[i, 0] - sensor[0], ends[i, 1] - sensor[1]
        length = math.hypot(dx, dy)
        steps = int((length - SLACK) / (0.5 * CELL)) if length > SLACK else 0
        for k in range(steps + 1):
            share = k * 0.5 * CELL / length if length > 0.0 else 0.0
            row, column = cell_of(origin, sensor[0] + share * dx, sensor[1] + share * dy)
            if is_within(cells.free, row, column):
                cells.free[row, column] = cells.seen[row, column] = stamp
    for i in range(len(ends)):
        row, column = cell_of(origin, ends[i, 0], ends[i, 1])
        if was_hit[i] and is_within(cells.free, row, column):
            cells.free[row, column] = NEVER


@kernel
def spread(free: np.ndarray, there: np.ndarray, since: float, steps: int) -> None:
    """Cells that were not seen free after `since` (s) take their neighbours, cell by cell, so many times; but not where
    something is `there`.
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
                    if not is_within(free, r, c) or (before[r, c] <= since and not there[r, c]):
                        free[row, column] = NEVER
                        break


@kernel
def are_known(
    free: np.ndarray, there: np.ndarray, origin: tuple[float, float], points: np.ndarray, since: float
) -> np.ndarray:
    """Which `points` (n, 2) lie in cells that were seen free after `since` (s), or where something is `there`."""
    found = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        row, column = cell_of(origin, points[i, 0], points[i, 1])
        if is_within(free, row, column):
            found[i] = free[row, column] > since or there[row, column]
    return found


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    cells, points, there = nothing_seen(3), np.ones((1, 2)), np.zeros((3, 3), np.bool_)
    is_within(cells.free, *cell_of((0.0, 0.0), 1.0, 1.0))
    mark(cells, (0.0, 0.0), (0.1, 0.1), points, (np.ones(1, np.bool_), 1.0, 0.0))
    came_there(cells.seen, (0.0, 0.0), (0.1, 0.1), points[0], 0.0)
    spread(cells.free, there, 0.0, 1)
    are_known(cells.free, there, (0.0, 0.0), points, 0.0)
