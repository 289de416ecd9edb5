"""What a range reading says of the cells in its cone: the probabilities of range_sensor_layer, compiled by numba.

The inverse sensor model is that of range_sensor_layer (Lu, navigation_layers): evidence falls with the angle off the
axis, as 1 - (theta / half)^2, and with the distance, as 1 - (1 + tanh(2 (d - phi))) / 2; a cell is likely free before
the echo and occupied around it, and Bayes' rule joins that with what was known. Where ours differs is said in
docs/costmaps.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.costmaps.layers import cone_shape
from sara_nav.costmaps.layers.cone_shape import (
    Reading,
    columns_within,
    cone_of,
    corners_around,
    is_within,
    off_axis,
    sector_window,
)
from sara_nav.grids.grid import FREE, LETHAL, UNKNOWN, Grid
from sara_nav.grids.windows import Window, grown

AXIS = 233.0 / 254.0
"""Least probability that the cell on the axis at the measured range has before the rule is applied."""
FREE_EVIDENCE = 0.3
"""Least weight of a reading, on the axis, for the cells before its echo, however far they are."""
SURELY = 0.9
"""Share of the cone's width within which nothing can be without being heard."""


class Belief(NamedTuple):
    """What a layer holds of its cells."""

    grid: np.ndarray
    """float32 (h, w): probability of an obstacle, 0.5 unknown."""
    seen_at: np.ndarray
    """float64 (h, w): when a cell was last held for occupied, s."""
    free_at: np.ndarray
    """float64 (h, w): when a cell was last seen free, s; of other size where that is not kept."""


class Model(NamedTuple):
    """The inverse sensor model and the thresholds; see RangeSensorConfig."""

    phi: float
    """m at which evidence has fallen to a half."""
    inflate_cone: float
    clear_below: float
    """Probability below which a cell is free."""
    mark_above: float
    """Probability above which a cell is occupied."""


class When(NamedTuple):
    """Times of a reading, s."""

    t: float
    free_since: float
    """Cells seen free since then are not what echoes, as long as there are others on the arc; inf: any may be."""


@kernel
def apply_all(belief: Belief, grid: Grid, model: Model, when: When, readings: np.ndarray) -> tuple[Window, np.ndarray]:
    """Take readings, in their order, as ``apply`` does; returns the window (x0, y0, xn, yn) around their cones, and
    those of their changes that are not empty, int64 (k, 4).

    readings: float64 (n, 6), x, y, yaw, distance, half, and 1.0 for clear.
    """
    height, width = belief.grid.shape
    around, changes, kept = (width, height, 0, 0), np.empty((len(readings), 4), np.int64), 0
    for i in range(len(readings)):
        r = readings[i]
        cone, changed = apply(belief, grid, model, when, Reading(r[0], r[1], r[2], r[3], r[4], r[5] != 0.0))
        if cone[0] < cone[2]:
            around = min(around[0], cone[0]), min(around[1], cone[1]), max(around[2], cone[2]), max(around[3], cone[3])
        if changed[0] < changed[2]:
            changes[kept, 0], changes[kept, 1], changes[kept, 2], changes[kept, 3] = changed
            kept += 1
    return around, changes[:kept].copy()


@kernel
def apply(belief: Belief, grid: Grid, model: Model, when: When, reading: Reading) -> tuple[Window, Window]:
    """Take one reading into the probabilities; returns two windows (x0, y0, xn, yn): that of the cone, and that of the
    cells that went over a threshold.
    """
    cone = cone_of(grid, reading, model.inflate_cone)
    height, width = belief.grid.shape
    x0, y0, xn, yn = sector_window((cone.x, cone.y, reading.yaw), cone.length, cone.half, grid)
    window = max(0, x0), max(0, y0), min(width, xn), min(height, yn)
    if window[2] <= window[0] or window[3] <= window[1]:
        return (0, 0, 0, 0), (0, 0, 0, 0)
    kept = belief.free_at.shape == belief.grid.shape
    if cone.clear or not kept or not _others(belief.free_at, window, grid, cone, when.free_since):
        when = When(when.t, np.inf)
    return window, _take(belief, grid, model, when, cone, window)


@kernel
def _take(belief, grid, model, when, cone, window):
    """Take a Cone into the cells of a window; returns the window of those that went over a threshold."""
    cells, seen_at, free_at = belief
    x0, y0, xn, yn = window
    changed, keep = (xn, yn, x0, y0), free_at.shape == cells.shape
    low, high = 0.5 * min(model.clear_below, 0.2), 1.0 - 0.25 * (1.0 - model.mark_above)  # none is beyond change
    # A cell that is surely free stays so before the echo, wherever it is in the cone: most cells are, and need no more.
    before_echo = cone.distance - 2.0 * cone.band
    surely_free, quiet = np.float32(low), (cone.length if cone.clear else max(before_echo, 0.0)) ** 2
    corners = corners_around(cone)
    for row in range(y0, yn):
        dy = grid.origin_y + (row + 0.5) * grid.resolution - cone.y
        first, last = columns_within(corners, cone, grid, dy, (x0, xn))
        for column in range(first, last):
            dx = grid.origin_x + (column + 0.5) * grid.resolution - cone.x
            along, aside = cone.cosine * dx + cone.sine * dy, cone.cosine * dy - cone.sine * dx
            before = cells[row, column]
            if before <= surely_free and dx * dx + dy * dy < quiet:
                if keep and along > 0.0 and abs(aside) <= cone.slope * SURELY * along:
                    free_at[row, column] = when.t
                continue
            on_axis = column == cone.axis_column and row == cone.axis_row
            off = off_axis(cone, along, aside, on_axis)
            if off > 1.0 or (model.inflate_cone < 1.0 and not is_within(cone.triangle, column, row)):
                continue
            away = math.hypot(along, aside)
            evidence = 0.0 if cone.clear else _model(away, cone.distance, cone.band, off, model.phi)
            echoes = evidence > 0.5 or on_axis
            if echoes and keep and free_at[row, column] >= when.free_since:
                continue
            if keep and off <= SURELY and (cone.clear or away < before_echo):
                free_at[row, column] = when.t
            p = max(before, AXIS) if on_axis else before
            cells[row, column] = min(max(evidence * p / (evidence * p + (1.0 - evidence) * (1.0 - p)), low), high)
            if _crosses(model, before, cells[row, column]):
                changed = grown(changed, column, row)
            if echoes:
                seen_at[row, column] = when.t
    return changed


@kernel
def _crosses(model, before, after):
    """True where a probability went over a threshold."""
    marked, cleared = model.mark_above, model.clear_below
    return (before > marked) != (after > marked) or (before < cleared) != (after < cleared)


@kernel
def _others(free_at, window, grid, cone, free_since):
    """True when there are cells on the arc of an echo that were not seen free since a time (s)."""
    x0, y0, xn, yn = window
    c, s = cone.cosine, cone.sine
    for row in range(y0, yn):
        dy = grid.origin_y + (row + 0.5) * grid.resolution - cone.y
        for column in range(x0, xn):
            if free_at[row, column] < free_since:
                dx = grid.origin_x + (column + 0.5) * grid.resolution - cone.x
                along, aside = c * dx + s * dy, abs(c * dy - s * dx)
                off_arc = abs(math.hypot(along, aside) - cone.distance)
                if off_arc < cone.band and math.atan2(aside, along) <= SURELY * cone.half:
                    return True
    return False


@kernel
def _model(d, distance, band, off, phi):
    """Return the probability that a cell at distance d, ``off`` of half the cone aside, is occupied."""
    across = 1.0 - off * off
    weight = across * (1.0 - (1.0 + math.tanh(2.0 * (d - phi))) / 2.0)
    before = d - (distance - 2.0 * band)
    if before < band:
        weight = max(weight, across * FREE_EVIDENCE)
        if before < 0.0:
            return 0.5 * (1.0 - weight)
        return 0.5 * weight * (before / band) ** 2 + 0.5 * (1.0 - weight)
    if d < distance + band:
        return 0.5 + weight * (0.5 - 0.5 * ((distance - d) / band) ** 2)
    return 0.5


@kernel
def forget(grid: np.ndarray, seen_at: np.ndarray, window: Window, before: float) -> tuple[Window, Window]:
    """Make unknown again what was last held for occupied before a time (s), in a window.

    Returns (window that changed, window that still holds something likely occupied), each x0, y0, xn, yn.
    """
    x0, y0, xn, yn = window
    changed = left = (xn, yn, x0, y0)
    for row in range(y0, yn):
        for column in range(x0, xn):
            if grid[row, column] > 0.5:
                if seen_at[row, column] < before:
                    grid[row, column] = 0.5
                    changed = grown(changed, column, row)
                else:
                    left = grown(left, column, row)
    return changed, left


@kernel
def write(grid: np.ndarray, costs: np.ndarray, window: Window, clear_below: float, mark_above: float) -> None:
    """Write a window's costs: 254 above, 0 below the thresholds; a known cost is never lowered."""
    x0, y0, xn, yn = window
    for row in range(y0, yn):
        for column in range(x0, xn):
            p = grid[row, column]
            if p > mark_above:
                costs[row, column] = LETHAL
            elif p < clear_below and costs[row, column] == UNKNOWN:
                costs[row, column] = FREE


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    grid, seen_at = np.full((3, 3), 0.5, np.float32), np.zeros((3, 3))
    belief, model = Belief(grid, seen_at, seen_at.copy()), Model(1.2, 1.0, 0.2, 0.8)
    apply_all(belief, Grid(0.0, 0.0, 1.0), model, When(0.0, -1.0), np.array([[0.5, 0.5, 0.0, 1.0, 0.5, 0.0]]))
    cone_shape.warm()
    forget(grid, seen_at, (0, 0, 3, 3), 1.0)
    write(grid, np.zeros((3, 3), np.uint8), (0, 0, 3, 3), 0.2, 0.8)
