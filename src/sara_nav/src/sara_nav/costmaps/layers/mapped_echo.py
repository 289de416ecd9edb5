"""Which echoes of a range sensor the map explains already: those tell of nothing new.

An echo lies somewhere on an arc: as far from the sensor as was measured, anywhere in its cone. Where something of the
map is within a tolerance of that arc, that is what echoed. Walls that the beam meets too steeply throw it away from the
sensor and explain nothing; their direction is that of the occupied cells about a place, the axis of greatest variance.
Wherever a wall ends or has a corner, it echoes. Compiled by numba.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.costmaps.layers.cone_shape import sector_window
from sara_nav.grids.grid import LETHAL, Grid

REACH = 3
"""Cells about a place, on each side, that a wall's direction is taken from."""
END = 0.75
"""A wall ends where the middle of those cells is further than this (cells) along it from the place."""
LONG = 1.5
"""Cells whose greatest variance (cells squared) is less are a post, not a wall."""
SLENDER = 0.5
"""Cells whose lesser variance is more than this share of the greater are no wall with a direction."""


class Mapped(NamedTuple):
    """The map that may explain echoes, and how nearly it must."""

    costs: np.ndarray
    """uint8 (h, w), 254 occupied."""
    grid: Grid
    frame: tuple[float, float, float]
    """x, y, yaw (m, rad) of the readings' frame in the map's."""
    tolerance: float
    """m between the arc of an echo and what explains it."""
    cos_steepest: float
    """Cosine of the greatest angle between the axis and a wall's normal at which the wall echoes."""


@kernel
def explained(mapped: Mapped, readings: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return for each reading whether a Mapped explains its echo, bool (n,).

    readings: float64 (n, 6), x, y, yaw, distance, half the cone, and not 0.0 for no echo. near: bool (n,), the echo is
    at the distance or nearer.
    """
    costs, tolerance, cos_steepest = mapped.costs, mapped.tolerance, mapped.cos_steepest
    origin_x, origin_y, resolution = mapped.grid
    frame_x, frame_y, frame_yaw = mapped.frame
    height, width = costs.shape
    result = np.zeros(len(readings), np.bool_)
    c, s = math.cos(frame_yaw), math.sin(frame_yaw)
    for i in range(len(readings)):
        r = readings[i]
        if r[5] != 0.0:
            continue
        x, y = frame_x + c * r[0] - s * r[1], frame_y + s * r[0] + c * r[1]
        yaw, distance, half = frame_yaw + r[2], r[3], r[4]
        # As far from the sensor as the arc or, with ``near``, no farther: nothing else can be within the tolerance of
        # it.
        nearest, farthest = (
            (0.0 if near[i] else max(distance - tolerance - 1e-9, 0.0)) ** 2,
            (distance + tolerance + 1e-9) ** 2,
        )
        x0, y0, xn, yn = sector_window((x, y, yaw), distance, half, mapped.grid)
        more = int(tolerance / resolution) + 2
        x0, y0, xn, yn = x0 - more, y0 - more, xn + more, yn + more
        for row in range(max(y0, 0), min(yn, height)):
            dy = origin_y + (row + 0.5) * resolution - y
            for column in range(max(x0, 0), min(xn, width)):
                if costs[row, column] != LETHAL:
                    continue
                dx = origin_x + (column + 0.5) * resolution - x
                if not nearest <= dx * dx + dy * dy <= farthest:
                    continue
                if _gap(dx, dy, yaw, half, distance, near[i]) <= tolerance and _echoes(
                    costs, column, row, math.cos(yaw), math.sin(yaw), cos_steepest
                ):
                    result[i] = True
                    break
            if result[i]:
                break
    return result


@kernel
def explain(mapped: Mapped, readings: np.ndarray, near: np.ndarray) -> None:
    """Turn each echo that the map explains into an empty cone up to where that may be, in the readings themselves;
    arguments as of ``explained``.
    """
    known = explained(mapped, readings, near)
    for i in range(len(readings)):
        if known[i]:
            readings[i, 3] -= mapped.tolerance
            readings[i, 5] = 1.0


@kernel
def of_some_length(readings: np.ndarray) -> np.ndarray:
    """Return the readings (n, 6) whose distance is above 0; those given where that is all of them."""
    kept = np.empty_like(readings)
    count = 0
    for i in range(len(readings)):
        if readings[i, 3] > 0.0:
            kept[count] = readings[i]
            count += 1
    return readings if count == len(readings) else kept[:count]


@kernel
def _gap(dx, dy, yaw, half, distance, near):
    """Return how far (m) a point, seen from the sensor, is from the arc, or with ``near`` from the sector within it."""
    along, aside = math.cos(yaw) * dx + math.sin(yaw) * dy, abs(math.cos(yaw) * dy - math.sin(yaw) * dx)
    far = math.hypot(along, aside)
    if math.atan2(aside, along) <= half:
        return max(far - distance, 0.0) if near else abs(far - distance)
    on_side = distance
    if near:  # the nearest place on the sector's side
        on_side = min(max(along * math.cos(half) + aside * math.sin(half), 0.0), distance)
    return math.hypot(along - on_side * math.cos(half), aside - on_side * math.sin(half))


@kernel
def _echoes(costs, column, row, axis_x, axis_y, cos_steepest):
    """True unless the occupied cell (column, row) is part of a wall whose normal is too far from the axis."""
    if cos_steepest <= 1e-9:
        return True
    height, width = costs.shape
    n = sx = sy = sxx = syy = sxy = 0.0
    for v in range(max(row - REACH, 0), min(row + REACH + 1, height)):
        for u in range(max(column - REACH, 0), min(column + REACH + 1, width)):
            if costs[v, u] == LETHAL:
                dx, dy = float(u - column), float(v - row)
                n, sx, sy, sxx, syy, sxy = n + 1.0, sx + dx, sy + dy, sxx + dx * dx, syy + dy * dy, sxy + dx * dy
    sx, sy = sx / n, sy / n
    sxx, syy, sxy = sxx / n - sx * sx, syy / n - sy * sy, sxy / n - sx * sy
    mean, spread = 0.5 * (sxx + syy), math.hypot(0.5 * (sxx - syy), sxy)
    if mean + spread < LONG or mean - spread > SLENDER * (mean + spread):
        return True
    angle = 0.5 * math.atan2(2.0 * sxy, sxx - syy)  # of the wall
    if abs(sx * math.cos(angle) + sy * math.sin(angle)) > END:
        return True
    return abs(axis_y * math.cos(angle) - axis_x * math.sin(angle)) >= cos_steepest


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    mapped = Mapped(np.zeros((3, 3), np.uint8), Grid(0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.1, 0.5)
    explained(mapped, np.zeros((1, 6)), np.zeros(1, np.bool_))
    explain(mapped, np.zeros((1, 6)), np.zeros(1, np.bool_))
    of_some_length(np.zeros((1, 6)))
