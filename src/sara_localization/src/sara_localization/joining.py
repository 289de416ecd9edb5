"""The pose in a filter's state and rigid transforms one after the other, compiled: what the output does with them 50 times a second.

The equations are those of geometry.py, which has them for all else; the tests hold the two together.
"""
from __future__ import annotations

from functools import lru_cache
from math import cos, sin

import numpy as np
from ahead_of_time import kernel

from .geometry import Transform
from .state import SIZE


@kernel
def pose(x):
    """(translation, quaternion) of the state x (n,), n >= 6: x, y, z (m), roll, pitch, yaw (rad)."""
    cr, sr = cos(x[3] / 2), sin(x[3] / 2)
    cp, sp = cos(x[4] / 2), sin(x[4] / 2)
    cy, sy = cos(x[5] / 2), sin(x[5] / 2)
    return (x[0], x[1], x[2]), (sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy)


@kernel
def join(t, q, u, r):
    """(translation, quaternion) of the transform (u, r) followed by (t, q)."""
    ax, ay, az, aw = q
    bx, by, bz, bw = r
    ux, uy, uz = u
    tx, ty, tz = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
    turned = (ux + 2.0 * (aw * tx + (ay * tz - az * ty)), uy + 2.0 * (aw * ty + (az * tx - ax * tz)), uz + 2.0 * (aw * tz + (ax * ty - ay * tx)))
    return ((turned[0] + t[0], turned[1] + t[1], turned[2] + t[2]),
            (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
             aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz))


@kernel
def placed(x, u, r):
    """(translation, quaternion) of the pose in the state x (n,), n >= 6, after the transform (u, r)."""
    t, q = pose(x)
    return join(t, q, u, r)


def pose_of(x: np.ndarray) -> Transform:
    """The pose of the state x (n,) in the world's frame."""
    return Transform(*pose(x))


def joined(x: np.ndarray, b: Transform) -> Transform:
    """pose_of(x) @ b."""
    return Transform(*placed(x, *b))


@lru_cache(maxsize=None)
def warm() -> None:
    """Compile (or load from the cache) what is called, so that nothing compiles on the move."""
    x = np.zeros(SIZE)
    joined(x, pose_of(x))
