"""Angles, quaternions and rigid transforms, small and without numpy where a call costs more than the sum.

Quaternions are (x, y, z, w) and of unit length; roll, pitch, yaw are the fixed-axis angles of REP-103
(R = Rz(yaw) Ry(pitch) Rx(roll)). A Transform `target_from_source` takes coordinates in `source` to coordinates in
`target`, as tf2's lookup_transform(target, source) does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """a x b of two 3-vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """The unit quaternion of roll, pitch, yaw (rad)."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def rpy_from_quaternion(q: Sequence[float]) -> Vector:
    """Roll, pitch, yaw (rad) of a unit quaternion; with the nose straight up or down all of the turn is in roll."""
    x, y, z, w = q
    sin_pitch = 2.0 * (w * y - x * z)
    if abs(sin_pitch) >= 1.0:
        pitch = math.copysign(math.pi / 2, sin_pitch)
        return 2.0 * math.atan2(x, w), pitch, 0.0
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, math.asin(sin_pitch), yaw


def yaw_from_quaternion(q: Sequence[float]) -> float:
    """The yaw alone of rpy_from_quaternion."""
    x, y, z, w = q
    if abs(2.0 * (w * y - x * z)) >= 1.0:
        return 0.0
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def normalised(q: Sequence[float]) -> Quaternion:
    """The quaternion at unit length; raises ValueError for one of (nearly) no length or not finite."""
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if not math.isfinite(length) or length < 1e-6:
        raise ValueError(f'a quaternion of length {length:g} stands for no rotation')
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


def multiply(a: Sequence[float], b: Sequence[float]) -> Quaternion:
    """The rotation b followed by the rotation a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(q: Sequence[float], v: Sequence[float]) -> Vector:
    """The 3-vector v turned by the unit quaternion q: v + 2 w (u x v) + 2 u x (u x v)."""
    ux, uy, uz, w = q
    vx, vy, vz = v
    tx, ty, tz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return (
        vx + 2.0 * (w * tx + (uy * tz - uz * ty)),
        vy + 2.0 * (w * ty + (uz * tx - ux * tz)),
        vz + 2.0 * (w * tz + (ux * ty - uy * tx)),
    )


def rotation_matrix(q: Sequence[float]) -> np.ndarray:
    """The (3, 3) matrix of a unit quaternion."""
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class _Rigid(NamedTuple):
    translation: Vector = (0.0, 0.0, 0.0)
    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)


class Transform(_Rigid):
    """A rigid transform: rotate by `rotation` (x, y, z, w), then add `translation` (m)."""

    @classmethod
    def from_xyz_rpy(
        cls, x: float = 0.0, y: float = 0.0, z: float = 0.0, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
    ) -> Transform:
        return cls((float(x), float(y), float(z)), quaternion_from_rpy(roll, pitch, yaw))

    @cached_property
    def rpy(self) -> Vector:
        """Roll, pitch, yaw in rad."""
        return rpy_from_quaternion(self.rotation)

    @property
    def yaw(self) -> float:
        """Yaw alone in rad."""
        return yaw_from_quaternion(self.rotation)

    @cached_property
    def turn_of_yaw(self) -> Quaternion:
        """The turn by its yaw alone."""
        return quaternion_from_rpy(0.0, 0.0, self.yaw)

    @cached_property
    def is_identity(self) -> bool:
        return self.rotation[3] in (1.0, -1.0) and self.translation == (0.0, 0.0, 0.0)

    def __matmul__(self, other: Transform) -> Transform:
        """a_from_b @ b_from_c = a_from_c."""
        return Transform(self.apply(other.translation), multiply(self.rotation, other.rotation))

    def apply(self, point: Sequence[float]) -> Vector:
        """The point's coordinates in the target frame."""
        r = rotate(self.rotation, point)
        t = self.translation
        return (r[0] + t[0], r[1] + t[1], r[2] + t[2])

    def inverse(self) -> Transform:
        """The way back; computed once."""
        return self._inverse

    @cached_property
    def _inverse(self):
        x, y, z, w = self.rotation
        q = (-x, -y, -z, w)
        t = rotate(q, self.translation)
        return Transform((-t[0], -t[1], -t[2]), q)

    def interpolate(self, other: Transform, ratio: float) -> Transform:
        """Between self (ratio 0) and other (1): straight in translation, along the great circle in rotation."""
        t = tuple(a + ratio * (b - a) for a, b in zip(self.translation, other.translation))
        p, q = self.rotation, other.rotation
        cosine = sum(a * b for a, b in zip(p, q))
        if cosine < 0.0:
            q, cosine = tuple(-c for c in q), -cosine
        if cosine > 1.0 - 1e-12:
            return Transform(t, q if ratio > 0.5 else p)
        angle = math.acos(cosine)
        a, b = math.sin((1.0 - ratio) * angle), math.sin(ratio * angle)
        return Transform(t, normalised(tuple(a * i + b * j for i, j in zip(p, q))))


IDENTITY = Transform()
