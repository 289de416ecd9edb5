"""Where the robot was in the world frame over the last seconds."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import NamedTuple

from sara_localization.fake import true_pose
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.inputs.data import OdometryData

MEMORY = 10.0
"""s."""
BRIDGED = 1.0
"""s beyond the first or last pose that are bridged at its speed."""
LARGEST = 1e9
"""m from the origin of the world."""


class Pose(NamedTuple):
    """The robot's pose in the world frame, and its twist along its own axes, m/s and rad/s."""

    stamp: float
    pose: Transform
    linear: tuple[float, ...]
    angular: tuple[float, ...]

    def at(self, stamp: float) -> Transform:
        """The pose at another time (s), as if the robot went on at its speed."""
        dt = stamp - self.stamp
        turn = quaternion_from_rpy(*(w * dt for w in self.angular))
        return self.pose @ Transform(tuple(v * dt for v in self.linear), turn)


class Track:
    """Poses by their stamps, oldest first, MEMORY seconds of them."""

    def __init__(self):
        self._stamps: list[float] = []
        self._poses: list[Pose] = []

    @property
    def newest(self) -> Pose | None:
        return self._poses[-1] if self._poses else None

    def clear(self) -> None:
        self._stamps.clear()
        self._poses.clear()

    def add(self, data: OdometryData) -> str:
        """Take a pose; returns '' or why it is not taken."""
        pose = true_pose(data.position, data.orientation)
        if pose is None or not max(map(abs, pose.translation)) <= LARGEST:
            return 'it holds what is no pose'
        if not (math.isfinite(data.stamp) and data.stamp > 0.0):
            return 'it has no time stamp'
        if self._stamps and data.stamp <= self._stamps[-1]:
            return 'it is not newer than the one before'
        moving = all(math.isfinite(v) and abs(v) <= LARGEST for v in (*data.linear, *data.angular))
        linear, angular = (data.linear, data.angular) if moving else ((0.0,) * 3, (0.0,) * 3)
        self._stamps.append(float(data.stamp))
        self._poses.append(Pose(data.stamp, pose, tuple(linear), tuple(angular)))
        expired = bisect_left(self._stamps, data.stamp - MEMORY)
        if expired > 64:  # many at a time
            del self._stamps[:expired], self._poses[:expired]
        return ''

    def covers(self, stamp: float) -> bool:
        """Whether there are poses before and after the stamp (s)."""
        return bool(self._stamps) and self._stamps[0] <= stamp <= self._stamps[-1]

    def ahead(self, stamp: float) -> float:
        """By how much (s) a stamp is newer than all poses (infinite where there are none); negative: it is not."""
        return stamp - self._stamps[-1] if self._stamps else math.inf

    def at(self, stamp: float) -> Transform | None:
        """The pose at a time (s): between two poses, or from the nearest one at its speed for BRIDGED s; else None."""
        if not self._stamps:
            return None
        k = bisect_left(self._stamps, stamp)
        if k < len(self._stamps) and self._stamps[k] == stamp:
            return self._poses[k].pose
        if 0 < k < len(self._stamps):
            before, after = self._poses[k - 1], self._poses[k]
            return before.pose.interpolate(after.pose, (stamp - before.stamp) / (after.stamp - before.stamp))
        nearest = self._poses[0 if k == 0 else -1]
        return nearest.at(stamp) if abs(stamp - nearest.stamp) <= BRIDGED else None
