"""A flat thing beside a robot that its newest readings to that side touch, and that comes nearer as it drives."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_control.zones.tangents import tangent

LEAST, SHORTEST = 3, 0.12
"""Readings, and m along it that their sensors must be apart."""
WITHIN = 0.025
"""m that readings may be off the line."""
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
    x, y, axis, _ = readings[-1].tolist()
    found = tangent(readings[:, [0, 1, 3]].tolist(), axis)
    if found is None or max(map(abs, found.off)) > WITHIN:
        return None
    line, way = found.line, math.copysign(1.0, toward * math.sin(yaw - axis))
    c, s = math.cos(line.normal), math.sin(line.normal)
    if np.ptp(c * readings[:, 1] - s * readings[:, 0]) < SHORTEST:
        return None
    nearer, square = way * math.sin(line.normal - axis), math.cos(line.normal - axis)
    slope, away = nearer / square if square > 0.0 else math.inf, line.distance(x, y)
    if not FLATTEST <= slope <= STEEPEST:
        return None
    return Face(way, away / square, slope, nearer * away)


def points(found: Face, sensor: tuple[float, float, float], spacing: float, end: float) -> np.ndarray:
    """(n, 2) m of a Face, from its foot on to `end`, m along the way from the sensor (x, y, axis)."""
    x, y, axis = sensor
    ahead = np.arange(found.foot, end, spacing)
    aside, along = found.y - found.slope * ahead, found.way * ahead
    c, s = math.cos(axis), math.sin(axis)
    return np.column_stack((x - s * along + c * aside, y + c * along + s * aside))
