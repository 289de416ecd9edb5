"""What lost readings cost: variances to add to the odometry's.

A wheel may change its speed by `acceleration` (m/s2 at the rim) between two readings. So
- of a time T without knowledge a wheel's way is unknown by |v| T + a T^2 / 2: position and heading are that uncertain
for good;
- an interval T that readings were missing in has its way measured, but not its shape: sideways d a T^2 / (4
separation);
- its mean speed is that of half an interval ago: a T / 2 off at most, as a uniform deviation (a T / 2)^2 / 3.
The two wheels err independently: sigma^2 of the way is half that of a wheel, that of the turn twice that /
separation^2.
"""

import math
from collections import deque


class LossUncertainty:
    """separation: m. acceleration: m/s2. window: intervals in the mean of the speed.

    `pose`: variances of x, y (m2), heading (rad2); `twist`: of the speed ((m/s)2) and the turn rate ((rad/s)2).
    """

    def __init__(self, separation: float, acceleration: float, window: int) -> None:
        self.separation = separation
        self.acceleration = acceleration
        self.pose = (0.0, 0.0, 0.0)
        self._speeds = deque(maxlen=window)

    @property
    def twist(self) -> tuple:
        """The mean over the window."""
        if not self._speeds:
            return 0.0, 0.0
        wheel = sum(self._speeds) / len(self._speeds)
        return 0.5 * wheel, 2.0 * wheel / self.separation**2

    def on_interval(self, heading: float, distance: float, interval: float | None, missed: float) -> None:
        """An interval of which the way (m) is known; `missed` (s) of it had no readings."""
        a = self.acceleration
        self._speeds.append((0.5 * a * interval) ** 2 / 3.0 if missed > 0.0 else 0.0)
        if missed > 0.0:
            side = distance * a * interval**2 / (4.0 * self.separation)
            self._add(heading + 0.5 * math.pi, side * side, 0.0)

    def on_unmeasured(self, heading: float, left: float, right: float, seconds: float) -> None:
        """So long nothing is known of wheels that ran at left, right (m/s)."""
        half = 0.5 * self.acceleration * seconds * seconds
        self.on_lost_way(heading, abs(left) * seconds + half, abs(right) * seconds + half)
        self._speeds.append((self.acceleration * seconds) ** 2 / 3.0)

    def on_lost_way(self, heading: float, left: float, right: float) -> None:
        """The wheels may have made this way (m, standard deviations) without its being measured."""
        total = left * left + right * right
        self._add(heading, 0.25 * total, total / self.separation**2)

    def _add(self, direction, along, turn):
        x, y, yaw = self.pose
        c, s = math.cos(direction), math.sin(direction)
        self.pose = x + along * c * c, y + along * s * s, yaw + turn
