"""What a range sensor with a wide cone would hear at any place of a map, worked out once; compiled by numba.

The forward model of S. Thrun, "Learning occupancy grid maps with forward sensor models", 2003: the nearest surface in
the cone that sends its echo back is heard. A smooth wall does so only up to a steepest angle between its normal and the
cone's axis (J. Leonard, H. Durrant-Whyte, "Directed Sonar Sensing for Mobile Robot Navigation", 1992, chapter 2);
of a ray that meets a steeper one nothing is heard.

A reading is then as likely as the beam model of S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, section
6.3, says: heard as expected, with an error; shorter, for people stand about; no echo, for it was lost; anything at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.grids import distances
from sara_localization.particles import field
from sara_localization.particles.field import Placement, to_cells
from sara_localization.ranges import map_echo
from sara_localization.ranges.range_data import BeamModel, RangeMap

HEADINGS = 72
"""Directions for which echoes are worked out, all round."""
BINS = 250
"""Of equal length, for expected and measured ranges."""
SILENT, UNHEARD_OF = 254, 255
"""Codes of what is expected where no echo is, and where the map does not say."""
NEAR, FAR, READINGS = BINS, BINS + 1, BINS + 2
"""Bins of readings nearer than a sensor can measure, and of no echo; how many bins there are."""
STEEPEST = math.radians(60.0)
"""Between a wall's normal and the cone's axis."""
AT_ONCE = 200
"""Cells that are worked out without a break, 2 ms or so."""
MOST_CELLS = 2_000_000
"""Free cells of a map that is searched, at 72 bytes each."""
NORMAL_REACH = 4
"""Cells to the nearest wall up to which its direction is known."""


class EchoTable(NamedTuple):
    """codes: uint8 (free cells, HEADINGS), what is expected; rows: int32 (rows, columns) of the map's cells, which row
    of the codes, -1 where the map has no free cell; place: of the grid; bin: m.
    """

    codes: np.ndarray
    rows: np.ndarray
    place: Placement
    bin: float


@kernel
def _fill(cells, normals, free, limits, codes):
    """Work out the codes of the free cells (flat indices). normals: float32 (rows, columns), the direction of the wall
    near a cell, rad, NaN far from walls; limits: (cells, half a cone in directions, steepest angle, cells in a bin).
    """
    limit, half, steepest, cells_in_bin = limits
    columns = cells.shape[1]
    gap = 2.0 * math.pi / HEADINGS
    reach, wall, what = np.empty(HEADINGS), np.empty(HEADINGS), np.empty(HEADINGS, np.int64)
    for i in range(len(free)):
        row, column = free[i] // columns, free[i] % columns
        for k in range(HEADINGS):
            reach[k], what[k], r, c = map_echo.walk(cells, column + 0.5, row + 0.5, k * gap, limit)
            wall[k] = normals[r, c] if what[k] == map_echo.OCCUPIED else math.nan
        for k in range(HEADINGS):
            best, nearest = math.inf, map_echo.FREE
            for j in range(k - half, k + half + 1):
                at = j % HEADINGS
                if reach[at] < best:
                    steep = abs((wall[at] - k * gap + math.pi) % (2.0 * math.pi) - math.pi)
                    if steep > steepest:  # false where it is NaN
                        continue
                    best, nearest = reach[at], what[at]
            if best == math.inf:
                codes[i, k] = SILENT
            elif nearest == map_echo.UNKNOWN:
                codes[i, k] = UNHEARD_OF
            else:
                codes[i, k] = min(int(best / cells_in_bin), BINS - 1)


def make(map_: RangeMap, field_of_view: float, limit: float, pause: Callable[[], None] = lambda: None) -> EchoTable:
    """Of sensors with a full cone (rad) that hear up to `limit` (m). pause: called after every AT_ONCE cells."""
    free = field.free_cells(map_)
    rows = np.full(map_.cells.shape, -1, np.int32)
    rows.ravel()[free] = np.arange(len(free), dtype=np.int32)
    codes = np.empty((len(free), HEADINGS), np.uint8)
    half = int(round(0.5 * field_of_view / (2.0 * math.pi) * HEADINGS))
    size = map_.resolution
    normals, limits = _normals(map_), (limit / size, half, STEEPEST, limit / BINS / size)
    for first in range(0, len(free), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        _fill(map_.cells, normals, free[part], limits, codes[part])
        pause()
    return EchoTable(codes, rows, Placement.of(map_), limit / BINS)


def _normals(map_):
    """float32 (rows, columns): towards the nearest wall, rad, NaN farther than NORMAL_REACH cells: down the slope of
    the distance to it, after Sobel.
    """
    squares = field.squares_of(map_, NORMAL_REACH)
    far = np.pad(np.sqrt(squares), 1, mode='edge')
    down = far[:-2] + 2.0 * far[1:-1] + far[2:]
    along = far[:, :-2] + 2.0 * far[:, 1:-1] + far[:, 2:]
    slope_x, slope_y = down[:, 2:] - down[:, :-2], along[2:] - along[:-2]
    known = (squares <= NORMAL_REACH**2) & ((slope_x != 0.0) | (slope_y != 0.0))
    return np.where(known, np.arctan2(-slope_y, -slope_x), np.nan).astype(np.float32)


def logarithms(model: BeamModel, limit: float, least: float) -> np.ndarray:
    """float64 (256, READINGS): of the probability of a bin of readings where a code is expected. limit, least: m that
    sensors hear at most and at least.
    """
    width = limit / BINS
    middles = (np.arange(BINS) + 0.5) * width
    total = model.hit + model.short + model.lost + model.random
    table = np.full((256, READINGS), model.random / BINS)
    for code in range(BINS):
        hit = np.exp(-0.5 * ((middles - middles[code]) / model.sigma) ** 2)
        table[code, :BINS] += model.hit * hit / hit.sum()
        table[code, : code + 1] += model.short / (code + 1)
        table[code, FAR] += model.lost
    table[SILENT, :BINS] += model.short / BINS
    table[SILENT, FAR] += model.hit + model.lost
    near = middles < max(least, width)  # one bin at the least
    table[:, NEAR] = table[:, :BINS][:, near].sum(axis=1)
    table[UNHEARD_OF] = total / READINGS
    return np.log(table / total)


def bin_of(table: EchoTable, distance: float, least: float) -> int:
    """The bin of a reading (m, REP-117), which is no NaN."""
    if distance < least:
        return NEAR
    return FAR if distance >= table.bin * BINS else min(int(distance / table.bin), BINS - 1)


@kernel
def add_logarithms(
    table: EchoTable, logs: np.ndarray, poses: np.ndarray, readings: np.ndarray, sums: np.ndarray
) -> None:
    """Add to `sums` (n,) the logarithms of how likely readings (k, 4) are at poses (n, 3) of the robot in the map (x,
    y, yaw). A reading: the sensor in the robot (x, y, yaw), and its bin.
    """
    rows, columns = table.rows.shape
    turned = math.atan2(table.place.sine, table.place.cosine)
    to_heading = HEADINGS / (2.0 * math.pi)
    for i in range(len(poses)):
        x, y, yaw = poses[i, 0], poses[i, 1], poses[i, 2]
        c, s = math.cos(yaw), math.sin(yaw)
        for k in range(len(readings)):
            mx, my = readings[k, 0], readings[k, 1]
            u, v = to_cells(table.place, x + c * mx - s * my, y + s * mx + c * my)
            column, row = int(math.floor(u)), int(math.floor(v))
            code = 0  # in a wall
            if 0 <= row < rows and 0 <= column < columns:
                at = table.rows[row, column]
                if at >= 0:
                    heading = int(math.floor((yaw + readings[k, 2] - turned) * to_heading + 0.5)) % HEADINGS
                    code = int(table.codes[at, heading])
            sums[i] += logs[code, int(readings[k, 3])]


def is_marked(table: EchoTable, marks: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """bool (n,): whether poses (n, 3) in the map are on marked cells, bool (rows, columns) of the table's map."""
    dx, dy = (poses[:, :2] - (table.place.x, table.place.y)).T / table.place.resolution
    columns = np.floor(table.place.cosine * dx + table.place.sine * dy)
    rows = np.floor(table.place.cosine * dy - table.place.sine * dx)
    inside = (rows >= 0) & (rows < marks.shape[0]) & (columns >= 0) & (columns < marks.shape[1])
    found = np.zeros(len(poses), np.bool_)
    found[inside] = marks[rows[inside].astype(np.int64), columns[inside].astype(np.int64)]
    return found


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    distances.warm()
    cells = np.zeros((3, 3), np.uint8)
    cells[0, 0] = map_echo.OCCUPIED
    table = make(RangeMap(cells, 1.0), 0.5, 1.0)
    add_logarithms(table, np.zeros((256, READINGS)), np.zeros((1, 3)), np.zeros((1, 4)), np.zeros(1))
