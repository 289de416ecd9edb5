"""The pose in a filter's state, and the state and poses as they were a moment ago."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sara_localization.filters.motion_model import advance
from sara_localization.filters.state import POSE, SIZE, TWIST
from sara_localization.geometry.rigid import Transform

LONGEST = 0.5
"""Seconds by which a state is taken back at most: odometry that is older has ended."""


def pose_of(x: np.ndarray) -> Transform:
    """The pose of the state x (n,), n >= 6, in the world's frame."""
    return Transform.from_xyz_rpy(*x[POSE].tolist())


def earlier(x: np.ndarray, age: float) -> np.ndarray:
    """The state x (n,), n >= 15, as it was `age` s ago (LONGEST at most), by its own velocities."""
    x = x.copy()
    advance(x, -min(age, LONGEST))
    return x


def pose_earlier(pose: Transform, twist: Sequence[float], age: float) -> Transform:
    """As `earlier`, of a pose with a twist (6,) along the robot's axes, m/s and rad/s; one that is not finite is taken
    for rest.
    """
    x, moving = np.zeros(SIZE), np.array(twist)
    x[POSE] = (*pose.translation, *pose.rpy)
    if np.isfinite(moving).all():
        x[TWIST] = moving
    return pose_of(earlier(x, age))
