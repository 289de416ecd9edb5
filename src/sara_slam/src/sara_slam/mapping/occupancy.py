"""The map of key scans at their poses: how often rays went through each cell and how often they ended there.

A cell is occupied where the share of rays that ended there exceeds a threshold (gmapping's `occ_thresh`), free where
rays went through, unknown where none came. The map is drawn anew when the poses move; while they stay, further scans
are added to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap
from sara_slam.mapping.key_scan import KeyScan
from sara_slam.matching.surfaces import placed

STEP = 64
"""Cells by which the map grows."""
MOVED = 0.25
"""Cells that a pose may have moved, and rad that it may have turned times 100 cells, before the map is drawn anew."""
MOST_CELLS = 100_000_000
"""Of a map: 400 MB are counted in."""


@kernel
def count_rays(
    ended: np.ndarray, passed: np.ndarray, origin: tuple[float, float], ends: np.ndarray, echo: np.ndarray
) -> None:
    """Add rays to the counts (rows, columns; uint16): from an origin to their ends (n, 2), in cells, all within the
    grid; echo (n,): which of them end at something. Each cell that a ray crosses is counted once (Amanatides and Woo
    1987).
    """
    for k in range(len(ends)):
        x, y, x1, y1 = origin[0], origin[1], ends[k, 0], ends[k, 1]
        dx, dy = x1 - x, y1 - y
        j, i, j1, i1 = int(math.floor(x)), int(math.floor(y)), int(math.floor(x1)), int(math.floor(y1))
        right, up = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
        wide, high = (abs(1.0 / dx) if dx else 1e30), (abs(1.0 / dy) if dy else 1e30)
        next_x = (j + (dx > 0.0) - x) / dx if dx else 1e30
        next_y = (i + (dy > 0.0) - y) / dy if dy else 1e30
        for _ in range(abs(j1 - j) + abs(i1 - i)):
            passed[i, j] = min(passed[i, j] + 1, 65535)
            if next_x < next_y:
                j, next_x = j + right, next_x + wide
            else:
                i, next_y = i + up, next_y + high
        if echo[k]:
            ended[i1, j1] = min(ended[i1, j1] + 1, 65535)
        else:
            passed[i1, j1] = min(passed[i1, j1] + 1, 65535)


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    counts = np.zeros((2, 2), np.uint16)
    count_rays(counts, counts.copy(), (0.5, 0.5), np.ones((1, 2)), np.ones(1, bool))


class Occupancy:
    """resolution: m per cell; threshold: share of the rays through a cell that end there from which on it is occupied;
    least: (x0, y0, x1, y1), m: what the map covers at least. `left_out`: how many scans are not on it, for it would
    have more than MOST_CELLS.
    """

    def __init__(self, resolution: float, threshold: float, least: Sequence[float] = (0.0, 0.0, 0.0, 0.0)):
        warm()
        self.resolution, self.threshold, self.least = resolution, threshold, least
        self._forget()

    def _forget(self):
        x0, y0, x1, y1 = (v / self.resolution for v in self.least)
        self._first = np.array((math.floor(x0), math.floor(y0)))  # column, row of the lower left cell
        shape = max(1, math.ceil(y1) - int(self._first[1])), max(1, math.ceil(x1) - int(self._first[0]))
        self._ended, self._passed = np.zeros(shape, np.uint16), np.zeros(shape, np.uint16)
        self._drawn, self.left_out = np.empty((0, 3)), 0

    def draw(self, scans: Sequence[KeyScan], poses: Sequence[Sequence[float]]) -> GridMap:
        """The map of scans at their poses (x, y, yaw), of which those that are drawn already may have moved."""
        poses = np.array(poses, float).reshape(-1, 3)
        before = self._drawn
        off = np.abs(poses[: len(before)] - before) * (1.0 / self.resolution, 1.0 / self.resolution, 100.0)
        if len(poses) < len(before) or (off > MOVED).any():
            self._forget()
        for scan, pose in zip(scans[len(self._drawn) :], poses[len(self._drawn) :]):
            self._add(scan, pose)
        self._drawn = np.concatenate((self._drawn, poses[len(self._drawn) :]))
        return self._map()

    def _add(self, scan, pose):
        cells = placed(np.vstack((scan.origin, scan.ends)).astype(float), pose) / self.resolution
        if not self._covers(np.floor(cells.min(0)).astype(int), np.floor(cells.max(0)).astype(int)):
            self.left_out += 1
            return
        cells -= self._first
        origin = float(cells[0, 0]), float(cells[0, 1])
        count_rays(self._ended, self._passed, origin, np.ascontiguousarray(cells[1:]), scan.echo)

    def _covers(self, low, high):
        """Grow, so that the cells from `low` to `high` (column, row) are there; False where they would be too many."""
        rows, columns = self._ended.shape
        before = np.maximum(self._first - low, 0)
        after = np.maximum(high + 1 - self._first - (columns, rows), 0)
        if before.any() or after.any():
            before, after = (STEP * -(-cells // STEP) for cells in (before, after))
            if math.prod((before + after + (columns, rows)).tolist()) > MOST_CELLS:
                return False
            widths = (before[1], after[1]), (before[0], after[0])
            self._ended, self._passed = np.pad(self._ended, widths), np.pad(self._passed, widths)
            self._first = self._first - before
        return True

    def _map(self):
        rows, columns = self._ended.shape
        ended = self._ended.astype(float)
        seen = ended + self._passed
        data = np.full((rows, columns), UNKNOWN, np.int8)
        data[seen > 0] = FREE
        data[ended > self.threshold * seen] = OCCUPIED
        r = self.resolution
        return GridMap(data, GridGeometry(columns, rows, r, float(self._first[0]) * r, float(self._first[1]) * r))
