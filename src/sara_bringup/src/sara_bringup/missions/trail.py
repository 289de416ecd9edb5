"""The ways a drive leaves behind it: as it was fused, as it truly was, and as the wheels alone would have it."""

import math
from collections import deque

from sara_common.planar import compose, inverse


class Trail:
    """Poses (x, y, yaw), m and rad, at least `step` m or `turn` rad apart; the oldest go when there are more than
    `longest`.
    """

    def __init__(self, step: float = 0.05, turn: float = 0.2, longest: int = 4000) -> None:
        self.step, self.turn = step, turn
        self.poses = deque(maxlen=longest)
        self.changed = False

    def add(self, pose: tuple[float, float, float]) -> None:
        """Keep a pose, if it is finite and far enough from the newest one. `changed` says that something was kept;
        whoever shows it takes that back.
        """
        if not all(map(math.isfinite, pose)):
            return
        if self.poses:
            x, y, yaw = self.poses[-1]
            if (
                math.hypot(pose[0] - x, pose[1] - y) < self.step
                and abs(math.remainder(pose[2] - yaw, 2.0 * math.pi)) < self.turn
            ):
                return
        self.poses.append(tuple(pose))
        self.changed = True

    def clear(self) -> None:
        """Forget everything."""
        self.poses.clear()
        self.changed = True


class WheelsAlone:
    """Where the chair would be if nobody corrected its odometry: what was odometry since the start, put at the start's
    pose in the map.
    """

    def __init__(self, start: tuple[float, float, float]) -> None:
        self._start = start
        self._first = None

    def restart(self, start: tuple[float, float, float]) -> None:
        """From here on, at (x, y, yaw) in the map."""
        self._start, self._first = start, None

    def pose(self, odometry: tuple[float, float, float]) -> tuple[float, float, float]:
        """(x, y, yaw) in the map of odometry's (x, y, yaw)."""
        if self._first is None:
            self._first = inverse(odometry)
        return compose(self._start, compose(self._first, odometry))
