"""The way a robot came by: its poses of the last metres, so that it can go back where it surely fits."""

from __future__ import annotations

import math
from collections import deque

from sara_common.planar import Pose2D, wrap

STEP, TURN = 0.05, 0.1
"""A pose is kept that is so far (m) or so much turned (rad) from the one before."""
JUMP = 1.0
"""A robot that is further (m) than this from where it was a control cycle ago was put there: it knows no way back."""


class Track:
    """Poses (Pose2D, local costmap's frame), the newest last. ``length``: m that are remembered."""

    def __init__(self, length: float = 5.0) -> None:
        self._poses = deque(maxlen=max(2, int(length / STEP)))
        self._seen = None

    def __len__(self) -> int:
        return len(self._poses)

    def keep(self, pose: Pose2D) -> None:
        """The robot is here now."""
        if self._seen is not None and pose.distance(self._seen) > JUMP:
            self.forget()
        self._seen = pose
        if (
            not self._poses
            or pose.distance(self._poses[-1]) >= STEP
            or abs(wrap(pose.yaw - self._poses[-1].yaw)) >= TURN
        ):
            self._poses.append(pose)

    def forget(self) -> None:
        """The robot did not come from there."""
        self._poses.clear()
        self._seen = None

    def back(self, pose: Pose2D, ahead: float) -> Pose2D | None:
        """Return the newest pose that is at least ``ahead`` (m) from a Pose2D, or None; what is newer is forgotten.

        So a robot that follows these poses goes back along its track, and never has it forward again.
        """
        self._seen = pose
        while self._poses and self._poses[-1].distance(pose) < ahead:
            self._poses.pop()
        return self._poses[-1] if self._poses else None

    def bearing(self, pose: Pose2D, ahead: float) -> float | None:
        """Return where the track goes back from a Pose2D: direction (rad, -pi..pi) of that pose off its own yaw, or
        None.
        """
        there = self.back(pose, ahead)
        return None if there is None else wrap(math.atan2(there.y - pose.y, there.x - pose.x) - pose.yaw)
