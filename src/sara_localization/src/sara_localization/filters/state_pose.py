"""The pose in a filter's state and rigid transforms one after the other, compiled: what the output does with them 50
times a second.

The equations are those of geometry.py, which has them for all else; the tests hold the two together.
"""

from __future__ import annotations

from functools import cache
from math import cos, sin

import numpy as np

from ahead_of_time import kernel
from sara_localization.filters.motion_model import advance
from sara_localization.filters.state import POSE, SIZE, TWIST
from sara_localization.geometry.rigid import Transform

LONGEST = 0.5
"""Seconds by which a state is taken back at most: odometry that is older has ended."""


@kernel
def pose(x):
    """(translation, quaternion) of the state x (n,), n >= 6: x, y, z (m), roll, pitch, yaw (rad)."""
    cr, sr = cos(x[3] / 2), sin(x[3] / 2)
    cp, sp = cos(x[4] / 2), sin(x[4] / 2)
    cy, sy = cos(x[5] / 2), sin(x[5] / 2)
    return (x[0], x[1], x[2]), (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


@kernel
def join(t, q, u, r):
    """(translation, quaternion) of the transform (u, r) followed by (t, q)."""
    ax, ay, az, aw = q
    bx, by, bz, bw = r
    ux, uy, uz = u
    tx, ty, tz = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
    turned = (
        ux + 2.0 * (aw * tx + (ay * tz - az * ty)),
        uy + 2.0 * (aw * ty + (az * tx - ax * tz)),
        uz + 2.0 * (aw * tz + (ax * ty - ay * tx)),
    )
    return (
        (turned[0] + t[0], turned[1] + t[1], turned[2] + t[2]),
        (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ),
    )


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


def earlier(x: np.ndarray, age: float) -> np.ndarray:
    """The state x (n,), n >= 15, as it was `age` s ago (LONGEST at most), by its own velocities."""
    x = x.copy()
    advance(x, -min(age, LONGEST))
    return x


def pose_earlier(pose: Transform, twist, age: float) -> Transform:
    """As `earlier`, of a pose with a twist (6,) along the robot's axes, m/s and rad/s; one that is not finite is taken
    for rest.
    """
    x, moving = np.zeros(SIZE), np.array(twist)
    x[POSE] = (*pose.translation, *pose.rpy)
    if np.isfinite(moving).all():
        x[TWIST] = moving
    return pose_of(earlier(x, age))


@cache
def warm() -> None:
    """Compile (or load from the cache) what is called, so that nothing compiles on the move."""
    x = np.zeros(SIZE)
    joined(earlier(x, 0.0), pose_of(x))
