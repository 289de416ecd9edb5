"""The shape of a range reading's cone on a grid: which cells it reaches; compiled by numba."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.grids.grid import Grid

WIDE = 1.5
"""rad; half a field of view from which on the sides of a cone bound nothing."""


class Reading(NamedTuple):
    """One reading."""

    x: float
    """m; the sensor in the grid's frame."""
    y: float
    yaw: float
    """rad."""
    distance: float
    """m."""
    half: float
    """rad; half the field of view."""
    clear: bool
    """The cone is empty up to ``distance`` and a little beyond, where an echo from there would have marked."""


class Cone(NamedTuple):
    """What is worked out once of a reading for all cells of its cone; no arrays, so that it costs little to pass on."""

    x: float
    """m; the sensor in the grid's frame."""
    y: float
    cosine: float
    """Of the yaw."""
    sine: float
    distance: float
    """m measured."""
    half: float
    """rad; half the field of view."""
    slope: float
    """Its tangent; inf where that is wide."""
    clear: bool
    """Empty; see Reading."""
    band: float
    """m before and beyond the distance within which an echo marks."""
    length: float
    """m."""
    beam: float
    """m aside of the axis that belong to the cone, however narrow it is."""
    axis_column: int
    """Of the cell on the axis at the distance; -1 in a clear cone."""
    axis_row: int
    triangle: tuple[int, int, int, int, int, int, float]
    """See ``triangle_of``."""


@kernel
def cone_of(grid: Grid, reading: Reading, inflate_cone: float) -> Cone:
    """Return the Cone of a reading; ``inflate_cone`` as of range_sensor_layer."""
    distance, half, resolution = reading.distance, reading.half, grid.resolution
    band, beam = max(resolution * distance, 0.71 * resolution), 0.71 * resolution
    c, s = math.cos(reading.yaw), math.sin(reading.yaw)
    slope = math.tan(half) if half < WIDE else np.inf
    column = int(math.floor((reading.x + distance * c - grid.origin_x) / resolution))
    row = int(math.floor((reading.y + distance * s - grid.origin_y) / resolution))
    if reading.clear:
        column = row = -1
    triangle, length = triangle_of(grid, reading, inflate_cone), distance + band
    return Cone(
        reading.x, reading.y, c, s, distance, half, slope, reading.clear, band, length, beam, column, row, triangle
    )


@kernel
def off_axis(cone: Cone, along: float, aside: float, on_axis: bool) -> float:
    """Return the angle of a cell off the axis as a share of half the cone; more than 1 outside the cone.

    along, aside: m from the sensor. on_axis: it is the cell on the axis at the distance, which always belongs to it.
    """
    if on_axis:
        return 0.0
    in_beam = along > 0.0 and abs(aside) <= cone.beam
    if cone.half < WIDE and not in_beam and abs(aside) > cone.slope * along:
        return 2.0
    if along * along + aside * aside >= cone.length * cone.length:
        return 2.0
    return 0.0 if in_beam else abs(math.atan2(aside, along)) / cone.half


@kernel
def corners_around(cone: Cone) -> np.ndarray:
    """Return four corners (4, 2), m from the sensor along the grid's axes, around a cone and its beam.

    Corners at infinity where the cone is so wide that they say nothing.
    """
    corners = np.empty((4, 2))
    if cone.half >= WIDE:
        corners[:] = np.inf
        return corners
    c, s = cone.cosine, cone.sine
    thick, length = cone.beam + 1e-6, cone.length + 1e-6
    wide = max(cone.slope * length, thick) + 1e-6
    for k in range(4):
        along = -1e-6 if k == 0 or k == 3 else length
        aside = (thick if along < 0.0 else wide) * (1.0 if k < 2 else -1.0)
        corners[k, 0], corners[k, 1] = c * along - s * aside, s * along + c * aside
    return corners


@kernel
def row_reach(corners: np.ndarray, y: float) -> tuple[float, float]:
    """Return the least and the greatest x of a convex outline's (k, 2) points at y: the one above the other where it
    has none there, without bounds where its corners say nothing.
    """
    if corners[0, 0] == np.inf:
        return -np.inf, np.inf
    least, most = 1e9, -1e9
    for k in range(len(corners)):
        ax, ay, bx, by = corners[k - 1, 0], corners[k - 1, 1], corners[k, 0], corners[k, 1]
        if min(ay, by) <= y <= max(ay, by):
            x = ax if ay == by else ax + (y - ay) / (by - ay) * (bx - ax)
            least, most = min(least, x), max(most, x)
            if ay == by:
                least, most = min(least, bx), max(most, bx)
    return least, most


@kernel
def columns_within(corners: np.ndarray, cone: Cone, grid: Grid, dy: float, columns: tuple[int, int]) -> tuple[int, int]:
    """Return those of the columns (first, one after the last) that a row ``dy`` (m) off the sensor may share with the
    corners' outline.
    """
    first, last = columns
    least, most = row_reach(corners, dy)
    if least != -np.inf:
        first = max(first, int(math.floor((cone.x + least - grid.origin_x) / grid.resolution - 1.0)))
    if most != np.inf:
        last = min(last, int(math.ceil((cone.x + most - grid.origin_x) / grid.resolution + 1.0)))
    return first, last


@kernel
def triangle_of(grid: Grid, reading: Reading, inflate_cone: float) -> tuple[int, int, int, int, int, int, float]:
    """Return the triangle, in cells, that range_sensor_layer narrows a cone to: (ax, ay, bx, by, ox, oy, slack)."""
    x, y, yaw, half, resolution = reading.x, reading.y, reading.yaw, reading.half, grid.resolution
    ox, oy = math.floor((x - grid.origin_x) / resolution), math.floor((y - grid.origin_y) / resolution)
    side = 1.2 * reading.distance
    ax = math.floor((x + math.cos(yaw - half) * side - grid.origin_x) / resolution)
    ay = math.floor((y + math.sin(yaw - half) * side - grid.origin_y) / resolution)
    bx = math.floor((x + math.cos(yaw + half) * side - grid.origin_x) / resolution)
    by = math.floor((y + math.sin(yaw + half) * side - grid.origin_y) / resolution)
    slack = -inflate_cone * abs((ax * (by - oy) + bx * (oy - ay) + ox * (ay - by)) / 2.0)
    return ax, ay, bx, by, ox, oy, slack


@kernel
def is_within(triangle: tuple[int, int, int, int, int, int, float], column: int, row: int) -> bool:
    """True for a cell within a triangle of ``triangle_of``."""
    ax, ay, bx, by, ox, oy, slack = triangle
    return (
        (bx - ax) * (row - ay) - (by - ay) * (column - ax) >= slack
        and (ox - bx) * (row - by) - (oy - by) * (column - bx) >= slack
        and (ax - ox) * (row - oy) - (ay - oy) * (column - ox) >= slack
    )


@kernel
def sector_window(pose: tuple[float, float, float], length: float, half: float, grid: Grid) -> tuple:
    """Return the window (x0, y0, xn, yn) of a Grid's cells around a sector of a circle, not cut to the grid.

    pose: x, y, yaw (m, rad). length: m. half: rad to either side of the yaw.
    """
    x, y, yaw = pose
    origin_x, origin_y, resolution = grid
    low_x = high_x = x
    low_y = high_y = y
    for k in range(7):  # the sides and the axis, and where the circle is furthest along the grid's axes
        if k < 3:
            angle = yaw + (k - 1) * half
        else:
            angle = (k - 3) * 0.5 * math.pi
            if abs(wrap(angle - yaw)) > half:
                continue
        px, py = x + length * math.cos(angle), y + length * math.sin(angle)
        low_x, high_x = min(low_x, px), max(high_x, px)
        low_y, high_y = min(low_y, py), max(high_y, py)
    return (
        int(math.floor((low_x - origin_x) / resolution)),
        int(math.floor((low_y - origin_y) / resolution)),
        int(math.floor((high_x - origin_x) / resolution)) + 1,
        int(math.floor((high_y - origin_y) / resolution)) + 1,
    )


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    sector_window((1.0, 1.0, 0.0), 1.0, 0.5, Grid(0.0, 0.0, 1.0))
