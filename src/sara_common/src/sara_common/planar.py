"""Planar geometry shared by the navigation modules: angles, poses, quaternions of a planar robot.

Frames follow REP-103: x forward, y left, yaw counter-clockwise, metres and radians.
"""

import math
from typing import NamedTuple

TWO_PI = 2.0 * math.pi


def wrap(angle):
    """Return ``angle`` (rad) brought into [-pi, pi)."""
    return (angle + math.pi) % TWO_PI - math.pi


class Pose2D(NamedTuple):
    """A planar pose: x, y in metres and yaw in radians, in a frame the context names."""

    x: float
    y: float
    yaw: float

    def is_finite(self):
        """True when no component is NaN or infinite."""
        return math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.yaw)

    def compose(self, other):
        """Return the pose ``other``, given in this pose's frame, in the frame of this pose."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2D(
            self.x + c * other.x - s * other.y, self.y + s * other.x + c * other.y, wrap(self.yaw + other.yaw)
        )

    def inverse(self):
        """Return the pose that undoes this one: ``p.compose(p.inverse())`` is the origin."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2D(-c * self.x - s * self.y, s * self.x - c * self.y, wrap(-self.yaw))

    def distance(self, other):
        """Return the distance between the two positions (m)."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def advance(self, v, w, dt):
        """Return the pose after driving at v (m/s) and w (rad/s) for dt (s), exact on the arc."""
        return Pose2D(*advanced(self.x, self.y, self.yaw, v, w, dt))


def advanced(x, y, yaw, v, w, dt):
    """Return (x, y, yaw) after driving from there at v (m/s) and w (rad/s) for dt (s), exact on the arc."""
    dyaw = w * dt
    if abs(dyaw) < 1e-9:
        chord, heading = v * dt, yaw
    else:
        chord, heading = 2.0 * v / w * math.sin(0.5 * dyaw), yaw + 0.5 * dyaw
    return x + chord * math.cos(heading), y + chord * math.sin(heading), wrap(yaw + dyaw)


def yaw_from_quaternion(x, y, z, w):
    """Return the yaw (rad) of a quaternion that stands for a planar rotation.

    Raises ValueError with the reason when the quaternion holds a NaN or infinity, is far from unit
    length (more than 10 %), or tips the vertical by more than 2.6 deg, the limit of the C++ peer.
    """
    if not all(math.isfinite(q) for q in (x, y, z, w)):
        raise ValueError('the orientation holds a NaN or an infinity')
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(norm - 1.0) > 0.1:
        raise ValueError(f'the orientation is not a unit quaternion (its length is {norm:.3g})')
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    if abs(1.0 - 2.0 * (x * x + y * y) - 1.0) > 1e-3:
        raise ValueError('the orientation is not a rotation about the vertical')
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def quaternion_from_yaw(yaw):
    """Return (x, y, z, w) of the rotation by ``yaw`` (rad) about the vertical."""
    return 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)
