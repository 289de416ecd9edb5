"""What a range reading says of the cells in its cone: the probabilities of range_sensor_layer, compiled by numba.

The inverse sensor model is that of range_sensor_layer (Lu, navigation_layers): evidence falls with the angle off the
axis, as 1 - (theta / half)^2, and with the distance, as 1 - (1 + tanh(2 (d - phi))) / 2; a cell is likely free before
the echo and occupied around it, and Bayes' rule joins that with what was known. Where ours differs is said in
docs/costmaps.md.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap

AXIS = 233.0 / 254.0
"""Least probability that the cell on the axis at the measured range has before the rule is applied."""
FREE_EVIDENCE = 0.3
"""Least weight of a reading, on the axis, for the cells before its echo, however far they are."""
SURELY = 0.9
"""Share of the cone's width within which nothing can be without being heard."""


@kernel
def apply_all(
    grid,
    seen_at,
    free_at,
    origin_x,
    origin_y,
    resolution,
    phi,
    inflate_cone,
    clear_below,
    mark_above,
    t,
    free_since,
    readings,
):
    """Take readings, in their order, as ``apply`` does; returns the window (x0, y0, xn, yn) around their cones, and
    those of their changes that are not empty, int64 (k, 4).

    readings: float64 (n, 6), x, y, yaw, distance, half, and 1.0 for clear.
    """
    height, width = grid.shape
    around, changes, kept = (width, height, 0, 0), np.empty((len(readings), 4), np.int64), 0
    for i in range(len(readings)):
        r = readings[i]
        cone, changed = apply(
            grid,
            seen_at,
            free_at,
            origin_x,
            origin_y,
            resolution,
            r[0],
            r[1],
            r[2],
            r[3],
            r[4],
            phi,
            inflate_cone,
            r[5] != 0.0,
            clear_below,
            mark_above,
            t,
            free_since,
        )
        if cone[0] < cone[2]:
            around = min(around[0], cone[0]), min(around[1], cone[1]), max(around[2], cone[2]), max(around[3], cone[3])
        if changed[0] < changed[2]:
            changes[kept, 0], changes[kept, 1], changes[kept, 2], changes[kept, 3] = changed
            kept += 1
    return around, changes[:kept].copy()


@kernel
def apply(
    grid,
    seen_at,
    free_at,
    origin_x,
    origin_y,
    resolution,
    x,
    y,
    yaw,
    distance,
    half,
    phi,
    inflate_cone,
    clear,
    clear_below,
    mark_above,
    t,
    free_since,
):
    """Take one reading into the probabilities; returns two windows (x0, y0, xn, yn): that of the cone, and that of the
    cells that went over a threshold.

    grid: float32 (h, w), 0.5 unknown; seen_at: float64 (h, w), when a cell was last held for occupied (s). x, y, yaw:
    sensor in the grid's frame; distance: m; half: half the field of view (rad). clear: the cone is empty up to
    ``distance`` and a little beyond, where an echo from there would have marked. Probabilities keep off 0 and 1, so
    that no cell is ever beyond change.
    free_at: float64 (h, w), when a cell was last seen free (s); those seen since ``free_since`` are not what echoes, as
    long as there are others on the arc. A free_at of other size is not kept, and carves nothing.
    """
    height, width = grid.shape
    band = max(resolution * distance, 0.71 * resolution)
    length = distance + band
    x0, y0, xn, yn = sector_window(x, y, yaw, length, half, origin_x, origin_y, resolution)
    x0, y0, xn, yn = max(0, x0), max(0, y0), min(width, xn), min(height, yn)
    if xn <= x0 or yn <= y0:
        return (0, 0, 0, 0), (0, 0, 0, 0)
    low, high = 0.5 * min(clear_below, 0.2), 1.0 - 0.25 * (1.0 - mark_above)
    # A cell that is surely free stays so before the echo, wherever it is in the cone: most cells are, and need no more.
    surely_free, quiet = np.float32(low), (length if clear else max(distance - 2.0 * band, 0.0)) ** 2
    changed = (width, height, 0, 0)
    c, s = math.cos(yaw), math.sin(yaw)
    axis_column = int(math.floor((x + distance * c - origin_x) / resolution))
    axis_row = int(math.floor((y + distance * s - origin_y) / resolution))
    ox, oy = math.floor((x - origin_x) / resolution), math.floor((y - origin_y) / resolution)
    side = 1.2 * distance
    ax = math.floor((x + math.cos(yaw - half) * side - origin_x) / resolution)
    ay = math.floor((y + math.sin(yaw - half) * side - origin_y) / resolution)
    bx = math.floor((x + math.cos(yaw + half) * side - origin_x) / resolution)
    by = math.floor((y + math.sin(yaw + half) * side - origin_y) / resolution)
    slack = -inflate_cone * abs((ax * (by - oy) + bx * (oy - ay) + ox * (ay - by)) / 2.0)
    slope = math.tan(half) if half < 1.5 else np.inf
    keep = free_at.shape == grid.shape
    carve = (
        keep
        and not clear
        and _others(
            free_at, x0, y0, xn, yn, x, y, c, s, distance, band, half, origin_x, origin_y, resolution, free_since
        )
    )
    corners = _around(c, s, length, half, slope, 0.71 * resolution)
    from_sensor = np.empty(xn - x0)  # m along the grid's rows, of each column
    for column in range(x0, xn):
        from_sensor[column - x0] = origin_x + (column + 0.5) * resolution - x
    for row in range(y0, yn):
        dy = origin_y + (row + 0.5) * resolution - y
        least, most = _reach(corners, dy)
        first = x0 if least == -np.inf else max(x0, int(math.floor((x + least - origin_x) / resolution - 1.0)))
        last = xn if most == np.inf else min(xn, int(math.ceil((x + most - origin_x) / resolution + 1.0)))
        for column in range(first, last):
            dx = from_sensor[column - x0]
            if grid[row, column] <= surely_free and dx * dx + dy * dy < quiet:
                if keep:
                    along, aside = c * dx + s * dy, abs(c * dy - s * dx)
                    if along > 0.0 and aside <= slope * SURELY * along:
                        free_at[row, column] = t
                continue
            along, aside = c * dx + s * dy, -s * dx + c * dy
            on_axis = not clear and column == axis_column and row == axis_row
            in_beam = along > 0.0 and abs(aside) <= 0.71 * resolution  # however narrow the cone is
            if not on_axis:
                if half < 1.5 and not in_beam and abs(aside) > slope * along:
                    continue
                if along * along + aside * aside >= length * length:
                    continue
            if inflate_cone < 1.0 and not (
                _turn(ax, ay, bx, by, column, row) >= slack
                and _turn(bx, by, ox, oy, column, row) >= slack
                and _turn(ox, oy, ax, ay, column, row) >= slack
            ):
                continue
            off = 0.0 if in_beam or on_axis else abs(math.atan2(aside, along)) / half
            if off > 1.0:
                continue
            before = grid[row, column]
            p = before
            if on_axis:
                p = max(p, AXIS)
            away = math.hypot(along, aside)
            evidence = 0.0 if clear else _model(away, distance, band, off, phi)
            if carve and (evidence > 0.5 or on_axis) and free_at[row, column] >= free_since:
                continue
            if keep and off <= SURELY and (clear or away < distance - 2.0 * band):
                free_at[row, column] = t
            p = min(max(evidence * p / (evidence * p + (1.0 - evidence) * (1.0 - p)), low), high)
            grid[row, column] = p
            after = grid[row, column]
            if (before > mark_above) != (after > mark_above) or (before < clear_below) != (after < clear_below):
                changed = (
                    min(changed[0], column),
                    min(changed[1], row),
                    max(changed[2], column + 1),
                    max(changed[3], row + 1),
                )
            if evidence > 0.5 or on_axis:
                seen_at[row, column] = t
    return (x0, y0, xn, yn), changed


@kernel
def _around(c, s, length, half, slope, thick):
    """Return four corners (4, 2), m from the sensor along the grid's axes, around a cone and a beam as thick as that on
    either side of its axis.

    Corners at infinity where the cone is so wide that they say nothing.
    """
    corners = np.empty((4, 2))
    if half >= 1.5:
        corners[:] = np.inf
        return corners
    thick, length = thick + 1e-6, length + 1e-6
    wide = max(slope * length, thick) + 1e-6
    for k in range(4):
        along = -1e-6 if k == 0 or k == 3 else length
        aside = (thick if along < 0.0 else wide) * (1.0 if k < 2 else -1.0)
        corners[k, 0], corners[k, 1] = c * along - s * aside, s * along + c * aside
    return corners


@kernel
def _reach(corners, y):
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
def _others(free_at, x0, y0, xn, yn, x, y, c, s, distance, band, half, origin_x, origin_y, resolution, free_since):
    """True when there are cells on the arc of an echo that were not seen free since a time (s)."""
    for row in range(y0, yn):
        dy = origin_y + (row + 0.5) * resolution - y
        for column in range(x0, xn):
            if free_at[row, column] < free_since:
                dx = origin_x + (column + 0.5) * resolution - x
                along, aside = c * dx + s * dy, abs(c * dy - s * dx)
                if abs(math.hypot(along, aside) - distance) < band and math.atan2(aside, along) <= SURELY * half:
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
def _turn(ax, ay, bx, by, cx, cy):
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


@kernel
def sector_window(x, y, yaw, length, half, origin_x, origin_y, resolution):
    """Return the window (x0, y0, xn, yn) of cells around a sector of a circle, not cut to the grid."""
    low_x = high_x = x
    low_y = high_y = y
    for k in range(6):
        if k < 2:
            angle = yaw - half if k == 0 else yaw + half
        else:
            angle = (k - 2) * 0.5 * math.pi
            off = abs(wrap(angle - yaw))
            if off > half:
                continue
        px, py = x + length * math.cos(angle), y + length * math.sin(angle)
        low_x, high_x = min(low_x, px), max(high_x, px)
        low_y, high_y = min(low_y, py), max(high_y, py)
    px, py = x + length * math.cos(yaw), y + length * math.sin(yaw)
    low_x, high_x = min(low_x, px), max(high_x, px)
    low_y, high_y = min(low_y, py), max(high_y, py)
    return (
        int(math.floor((low_x - origin_x) / resolution)),
        int(math.floor((low_y - origin_y) / resolution)),
        int(math.floor((high_x - origin_x) / resolution)) + 1,
        int(math.floor((high_y - origin_y) / resolution)) + 1,
    )


@kernel
def forget(grid, seen_at, x0, y0, xn, yn, before):
    """Make unknown again what was last held for occupied before a time (s).

    Returns (window that changed, window that still holds something likely occupied), each x0, y0, xn, yn.
    """
    changed = (xn, yn, x0, y0)
    left = (xn, yn, x0, y0)
    for row in range(y0, yn):
        for column in range(x0, xn):
            if grid[row, column] > 0.5:
                if seen_at[row, column] < before:
                    grid[row, column] = 0.5
                    changed = (
                        min(changed[0], column),
                        min(changed[1], row),
                        max(changed[2], column + 1),
                        max(changed[3], row + 1),
                    )
                else:
                    left = (min(left[0], column), min(left[1], row), max(left[2], column + 1), max(left[3], row + 1))
    return changed, left


@kernel
def write(grid, costs, x0, y0, xn, yn, clear_below, mark_above):
    """Write a window's costs: 254 above, 0 below the thresholds; a known cost is never lowered."""
    for row in range(y0, yn):
        for column in range(x0, xn):
            p = grid[row, column]
            if p > mark_above:
                costs[row, column] = 254
            elif p < clear_below and costs[row, column] == 255:
                costs[row, column] = 0


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    grid, seen_at = np.full((3, 3), 0.5, np.float32), np.zeros((3, 3))
    apply_all(
        grid,
        seen_at,
        seen_at.copy(),
        0.0,
        0.0,
        1.0,
        1.2,
        1.0,
        0.2,
        0.8,
        0.0,
        -1.0,
        np.array([[0.5, 0.5, 0.0, 1.0, 0.5, 0.0]]),
    )
    forget(grid, seen_at, 0, 0, 3, 3, 1.0)
    write(grid, np.zeros((3, 3), np.uint8), 0, 0, 3, 3, 0.2, 0.8)
