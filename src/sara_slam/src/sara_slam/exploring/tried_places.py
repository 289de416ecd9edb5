"""Poses that a robot has been sent to, to which it need not be sent again."""

from __future__ import annotations

import math

import numpy as np

from sara_common.planar import Pose2D, wrap

SAME_M, SAME_RAD = 0.3, 0.4
"""Between two poses that are about the same."""


class TriedPlaces:
    """Those that it has reached, and those that it has not."""

    def __init__(self) -> None:
        self._tried: list[tuple[Pose2D, bool, float]] = []  # whether it was reached; rad about it

    def add(self, pose: Pose2D, reached: bool, turned: bool = False) -> None:
        """The robot need not be sent to a pose; turned: nor to that place with another heading."""
        self._tried.append((pose, reached, math.inf if turned else SAME_RAD))

    def clear(self) -> None:
        """Forget all."""
        self._tried.clear()

    def clear_unreached(self) -> None:
        """Forget those that it has not reached."""
        self._tried = [entry for entry in self._tried if entry[1]]

    def hold(self, poses: np.ndarray) -> np.ndarray:
        """(n,) whether poses (n, 3) are about the same as one of them."""
        found = np.zeros(len(poses), bool)
        for pose, _, turn in self._tried:
            off = np.hypot(poses[:, 0] - pose.x, poses[:, 1] - pose.y)
            found |= (off < SAME_M) & (np.abs(wrap(poses[:, 2] - pose.yaw)) < turn)
        return found
