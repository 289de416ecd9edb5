"""Planar geometry that every package shares: angles, poses, quaternions of a planar robot.

Frames follow REP-103: x forward, y left, yaw counter-clockwise, metres and radians. A pose is a tuple (x, y, yaw), with
names where it is a Pose2D. `sara_common.kernels` has the two wraps for compiled functions to call.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    import numpy as np

TWO_PI = 2.0 * math.pi
LEVEL = math.acos(1.0 - 1e-3)
"""rad by which a pose on the ground may tip the vertical: 2.6 deg, the limit of the C++ peer."""


class Quaternion(Protocol):
    """What has the fields of a geometry_msgs/Quaternion."""

    x: float
    y: float
    z: float
    w: float


def wrap(angle: float | np.ndarray) -> float | np.ndarray:
    """Return an angle (rad), a number or a numpy array of any shape, brought into [-pi, pi).

    pi itself becomes -pi, so that equal headings are equal numbers. An angle that lies within already may change in its
    last digits, for pi is added and taken away: see `wrap_exact`.
    """
    return (angle + math.pi) % TWO_PI - math.pi


def wrap_exact(angle: float) -> float:
    """Return an angle (rad) brought into [-pi, pi] without any rounding; NaN and infinity are given back.

    What lies within already keeps every bit; beyond, it is math.remainder(angle, 2 pi). For sums that are carried on
    from step to step (filters, integrators), where rounding would build up.
    """
    if -math.pi <= angle <= math.pi or not math.isfinite(angle):
        return angle
    rest = abs(angle) % TWO_PI  # not rounded, as it is where signs differ
    if rest > math.pi:
        rest -= TWO_PI
    return rest if angle > 0.0 else -rest


def compose(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    """Return the pose (x, y, yaw) `b`, given in the frame `a`, in the frame in which `a` is given."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrap(a[2] + b[2])


def inverse(a: Sequence[float]) -> tuple[float, float, float]:
    """Return the pose (x, y, yaw) of a's parent frame in the frame `a`: compose(a, inverse(a)) is the origin."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return -c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2]


def is_apart(a: Sequence[float], b: Sequence[float], metres: float, radians: float) -> bool:
    """Whether two poses (x, y, yaw) are at least so far apart, or turned against each other by at least so much."""
    return math.dist(a[:2], b[:2]) >= metres or abs(wrap_exact(b[2] - a[2])) >= radians


def between(
    a: Sequence[float], b: Sequence[float], share: float | np.ndarray
) -> tuple[float | np.ndarray, float | np.ndarray, float | np.ndarray]:
    """Return the pose (x, y, yaw) after a share of the way from a to b, turning the short way round; its yaw is not
    wrapped. share: 0 to 1, a number or an array.
    """
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * wrap(b[2] - a[2])


def advanced(x: float, y: float, yaw: float, v: float, w: float, dt: float) -> tuple[float, float, float]:
    """Return (x, y, yaw) after driving from there at v (m/s) and w (rad/s) for dt (s), exact on the arc."""
    dyaw = w * dt
    if abs(dyaw) < 1e-9:
        chord, heading = v * dt, yaw
    else:
        chord, heading = 2.0 * v / w * math.sin(0.5 * dyaw), yaw + 0.5 * dyaw
    return x + chord * math.cos(heading), y + chord * math.sin(heading), wrap(yaw + dyaw)


class Pose2D(NamedTuple):
    """A planar pose: x, y in metres and yaw in radians, in a frame the context names."""

    x: float
    y: float
    yaw: float

    def is_finite(self) -> bool:
        """True when no component is NaN or infinite."""
        return math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.yaw)

    def compose(self, other: Sequence[float]) -> Pose2D:
        """Return the pose ``other``, given in this pose's frame, in the frame of this pose."""
        return Pose2D(*compose(self, other))

    def inverse(self) -> Pose2D:
        """Return the pose that undoes this one: ``p.compose(p.inverse())`` is the origin."""
        return Pose2D(*inverse(self))

    def distance(self, other: Pose2D) -> float:
        """Return the distance between the two positions (m)."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def advance(self, v: float, w: float, dt: float) -> Pose2D:
        """Return the pose after driving at v (m/s) and w (rad/s) for dt (s), exact on the arc."""
        return Pose2D(*advanced(self.x, self.y, self.yaw, v, w, dt))


def yaw_from_quaternion(x: float, y: float, z: float, w: float, tilt: float = LEVEL) -> float:
    """Return the yaw (rad) of a quaternion that stands for a planar rotation.

    Raises ValueError with the reason when the quaternion holds a NaN or infinity, is far from unit
    length (more than 10 %), or tips the vertical by more than ``tilt`` (rad).
    """
    if not all(math.isfinite(q) for q in (x, y, z, w)):
        raise ValueError('the orientation holds a NaN or an infinity')
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(norm - 1.0) > 0.1:
        raise ValueError(f'the orientation is not a unit quaternion (its length is {norm:.3g})')
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    if 2.0 * (x * x + y * y) > 1.0 - math.cos(tilt):
        raise ValueError('the orientation is not a rotation about the vertical')
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def yaw_of(q: Quaternion) -> float:
    """Return the yaw (rad) of a quaternion of unit length, which is not checked."""
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))


def quaternion_from_yaw(yaw: float) -> tuple[float, float, float, float]:
    """Return (x, y, z, w) of the rotation by ``yaw`` (rad) about the vertical."""
    return 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)
