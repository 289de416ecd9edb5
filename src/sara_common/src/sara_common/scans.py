"""Sweeps of a laser scanner that moves: each ray's point is placed by where the scanner was at that ray's own time.

The scanner casts its rays one after the other, `time_increment` apart. The motion in a sweep is interpolated between
the poses at its first and last ray: straight for the place, evenly for the rotation, as laser_geometry's
transformLaserScanToPointCloud does with tf. Distances in m, angles in rad, quaternions (x, y, z, w).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Sweep(NamedTuple):
    """A sensor_msgs/LaserScan: `stamp` of its first ray, s; angles in rad; `time_increment` from ray to ray, s; ranges
    (n,) and their limits in m, as REP 117 has them.
    """

    stamp: float
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    range_min: float
    range_max: float
    ranges: np.ndarray

    @property
    def duration(self) -> float:
        """From the first ray to the last, s."""
        return self.time_increment * (len(self.ranges) - 1)

    @property
    def fault(self) -> str:
        """Why this is no scan, in a few words; empty where it is one."""
        numbers = self.stamp, self.angle_min, self.angle_max, self.angle_increment, self.time_increment
        if not all(map(math.isfinite, (*numbers, self.range_min, self.range_max))):
            return 'scan with numbers that are none'
        if self.angle_increment == 0.0 or self.time_increment < 0.0 or not 0.0 <= self.range_min < self.range_max:
            return 'scan without sense'
        if len(self.ranges) < 2:
            return 'scan without rays'
        if abs((self.angle_max - self.angle_min) / self.angle_increment + 1 - len(self.ranges)) > 1.5:
            return 'scan of a wrong size'
        return ''


class TransformError(ValueError):
    """A pose of a scanner that is none."""


def swept(points: np.ndarray, shares: np.ndarray, first: Sequence, last: Sequence) -> np.ndarray:
    """(n, 3) points in a fixed frame, of points (n, 3) in the scanner's own.

    `shares`: (n,) when each was seen, 0 at the sweep's first ray and 1 at its last. `first`, `last`: the scanner's
    (translation (3,), quaternion (4,)) in the fixed frame at those two times. Raises TransformError.
    """
    (begin, turn), (end, other) = _checked(*first), _checked(*last)
    points, shares = np.asarray(points, float).reshape(-1, 3), np.asarray(shares, float)[:, None]
    return _rotated(points, _between(turn, other, shares)) + begin + (end - begin) * shares


def shares_of(indices: np.ndarray, rays: int) -> np.ndarray:
    """(n,) which share of a sweep of so many rays is over when the rays of these indices are cast."""
    return np.asarray(indices, float) / max(rays - 1, 1)


def _checked(translation, rotation):
    translation, rotation = np.array(translation, float), np.array(rotation, float)
    length = float(np.sqrt(rotation @ rotation))
    if not np.isfinite(translation).all() or not abs(length - 1.0) <= 0.1:
        raise TransformError(f'the transform {tuple(translation)}, {tuple(rotation)} is not one')
    return translation, rotation / length


def _between(one, two, shares):
    """(n, 4) quaternions evenly between two, the short way round."""
    cosine = float(one @ two)
    if cosine < 0.0:
        two, cosine = -two, -cosine
    angle = float(np.arccos(min(cosine, 1.0)))
    if angle < 1e-9:
        return np.repeat(one[None], len(shares), 0)
    return (np.sin((1.0 - shares) * angle) * one + np.sin(shares * angle) * two) / np.sin(angle)


def _rotated(points, quaternions):
    """(n, 3) each point turned by its own quaternion (n, 4)."""
    axis, w = quaternions[:, :3], quaternions[:, 3:]
    across = 2.0 * np.cross(axis, points)
    return points + w * across + np.cross(axis, across)
