"""Planar poses as (x, y, yaw) tuples: composition (REP-103: radians, counter-clockwise)."""

import math

from sara_common.planar import wrap


def compose(a, b):
    """The pose `b`, given in the frame `a`, in the frame in which `a` is given."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrap(a[2] + b[2])


def inverse(a):
    """The pose of a's parent frame in the frame `a`."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return -c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2]


def yaw_of(q):
    """Yaw of a quaternion with fields x, y, z, w."""
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
