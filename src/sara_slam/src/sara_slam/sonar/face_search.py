"""A flat thing beside a robot that its newest readings to that side touch, and that comes nearer as it drives."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

LEAST, SHORTEST = 3, 0.12
"""Readings, and m along it that their sensors must be apart."""
WITHIN = 0.025
"""m that readings may be off the line."""
ITERATIONS, TINY = 5, 1e-6
"""Of the fit, which converges by the square; m2 by which readings differ along the line if they tell its angle."""
STEEPEST, FLATTEST = 0.6, 0.05
"""m that it comes nearer by a metre of way: more is heard ahead, less is beside."""


class Face(NamedTuple):
    """In the frame of the newest sensor, the way that is driven its x axis, where it looks its y axis: whether that way
    is to the left of where it looks (1.0) or to the right (-1.0), y of the line at x 0, m per m that it comes nearer,
    and x of where its perpendicular meets it, m.
    """

    way: float
    y: float
    slope: float
    foot: float


def face(readings: np.ndarray, yaw: float, toward: float) -> Face | None:
    """Of readings (n, 4), the newest last: x, y and axis of the sensor (m, rad), m. yaw: of the robot, which drives
    ahead (toward 1.0) or astern (-1.0).
    """
    if len(readings) < LEAST:
        return None
    x, y, axis, _ = readings[-1]
    way = math.copysign(1.0, toward * math.sin(yaw - axis))
    c, s = math.cos(axis), math.sin(axis)
    dx, dy, ranges = readings[:, 0] - x, readings[:, 1] - y, readings[:, 3]
    ahead, aside = way * (c * dy - s * dx), c * dx + s * dy
    normal = 0.5 * math.pi  # of the line, cos(normal) ahead + sin(normal) aside = away
    for _ in range(ITERATIONS):
        c, s = math.cos(normal), math.sin(normal)
        touched, along = ranges + c * ahead + s * aside, c * aside - s * ahead
        spread, away = along - along.mean(), float(touched.mean())
        weight = float((spread * spread).sum())
        if weight < TINY:
            return None
        normal -= float((touched * spread).sum()) / weight
    slope = math.inf if s <= 0.0 else c / s
    if np.ptp(along) < SHORTEST or np.abs(touched - away).max() > WITHIN or not FLATTEST <= slope <= STEEPEST:
        return None
    return Face(way, away / s, slope, c * away)


def points(found: Face, sensor: tuple[float, float, float], spacing: float, end: float) -> np.ndarray:
    """(n, 2) m of a Face, from its foot on to `end`, m along the way from the sensor (x, y, axis)."""
    x, y, axis = sensor
    ahead = np.arange(found.foot, end, spacing)
    aside, along = found.y - found.slope * ahead, found.way * ahead
    c, s = math.cos(axis), math.sin(axis)
    return np.column_stack((x - s * along + c * aside, y + c * along + s * aside))
