"""What a laser scanner or a depth camera saw, as points in a costmap's frame: pure data for the obstacle layer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

INF_MARGIN = 1e-4
"""How much nearer than range_max (m) a reading of +Inf is taken to be where ``inf_is_valid``; the peer's value."""


class ObservationError(ValueError):
    """A scan or cloud makes no sense; the message says why."""


@dataclass(frozen=True)
class Observation:
    """Points that one ``source`` saw at ``stamp`` (s): ``origin`` (x, y, z) of the sensor and ``points`` (n, 3), both
    in the costmap's global frame, m."""

    source: str
    stamp: float
    origin: tuple
    points: np.ndarray


def scan_points(
    ranges: Sequence[float],
    angle_min: float,
    angle_increment: float,
    range_min: float,
    range_max: float,
    inf_is_valid: bool = False,
) -> np.ndarray:
    """Return the points (n, 3) of a laser scan in its own frame, z = 0; raises ObservationError. As scan_rays."""
    return scan_rays(ranges, (angle_min, angle_increment), (range_min, range_max), inf_is_valid)[0]


def scan_rays(
    ranges: Sequence[float], angles: tuple[float, float], limits: tuple[float, float], inf_is_valid: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (n, 3) of a laser scan in its own frame, z = 0, and the indices (n,) of their rays; raises
    ObservationError. angles: (angle_min, angle_increment), rad; limits: (range_min, range_max), m.

    Readings are kept from range_min up to but not at range_max. ``inf_is_valid``: +Inf is a reading just short of
    range_max, so that it clears; other readings that are no numbers are left out.
    """
    (angle_min, angle_increment), (range_min, range_max) = angles, limits
    if not all(map(math.isfinite, (*angles, *limits))) or range_max <= range_min:
        raise ObservationError(
            f'the scan has angle_min {angle_min!r}, angle_increment {angle_increment!r}, range_min {range_min!r}, '
            f'range_max {range_max!r}'
        )
    distance = np.array(ranges, dtype=np.float64).reshape(-1)
    if inf_is_valid:
        distance[distance == np.inf] = range_max - INF_MARGIN
    with np.errstate(invalid='ignore', over='ignore'):
        angle = np.fmod(angle_min + angle_increment * np.arange(len(distance)), 2.0 * math.pi)
        good = (distance >= range_min) & (distance < range_max) & np.isfinite(angle)
    distance, angle = distance[good], angle[good]
    points = np.column_stack([distance * np.cos(angle), distance * np.sin(angle), np.zeros(len(distance))])
    return points, np.flatnonzero(good)


class CloudLayout(NamedTuple):
    """How the points of a sensor_msgs/PointCloud2 are packed; sizes and steps of its message, in points and bytes.

    fields: {name: (offset in bytes, datatype)}, x, y and z each FLOAT32 (7) or FLOAT64 (8).
    """

    width: int
    height: int
    point_step: int
    row_step: int
    fields: dict
    big_endian: bool = False


def cloud_points(data: bytes, layout: CloudLayout) -> np.ndarray:
    """Return the points (n, 3) of a packed cloud in its own frame; raises ObservationError."""
    width, height, point_step, row_step, fields, big_endian = layout
    formats = {7: 'f4', 8: 'f8'}
    missing = [name for name in 'xyz' if name not in fields or fields[name][1] not in formats]
    if missing:
        raise ObservationError('the cloud has no field {} of 32 or 64 bit floats'.format(', '.join(missing)))
    sizes = [fields[name][0] + int(formats[fields[name][1]][1]) for name in 'xyz']
    if width * height == 0:
        return np.zeros((0, 3))
    if (
        point_step < max(sizes)
        or row_step < width * point_step
        or len(data) < row_step * (height - 1) + width * point_step
    ):
        raise ObservationError(
            f'the cloud of {width} x {height} points of {point_step} bytes, rows of {row_step}, holds {len(data)} bytes'
        )
    kind = np.dtype(
        {
            'names': list('xyz'),
            'offsets': [fields[name][0] for name in 'xyz'],
            'itemsize': point_step,
            'formats': [('>' if big_endian else '<') + formats[fields[name][1]] for name in 'xyz'],
        }
    )
    cells = np.ndarray((height, width), kind, data, strides=(row_step, point_step))
    return np.column_stack([cells[name].reshape(-1).astype(np.float64) for name in 'xyz'])


def transformed(points: np.ndarray, translation: Sequence[float], rotation: Sequence[float]) -> np.ndarray:
    """Return points (n, 3) after a rotation by a unit quaternion (x, y, z, w) and a translation (3,);
    ObservationError.
    """
    q = np.array(rotation, dtype=np.float64)
    t = np.array(translation, dtype=np.float64)
    length = float(np.sqrt(q @ q))
    if not np.isfinite(t).all() or not abs(length - 1.0) <= 0.1:
        raise ObservationError(f'the transform {tuple(translation)}, {tuple(rotation)} is not one')
    x, y, z, w = q / length
    r = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return np.asarray(points, dtype=np.float64).reshape(-1, 3) @ r.T + t
