"""Odometry of a differential drive from wheel positions, equal to that of the C++ diff_drive_controller.

The pose is integrated exactly along the arc of each interval (second-order Runge-Kutta where it is all but straight);
the speed is the mean of the last few intervals' speeds. Two things are done better on purpose: the first reading is
where counting begins, wherever the encoders stand, and an interval too short to divide by adds its motion to the next
one's speed.
"""

import math
from collections import deque
from typing import NamedTuple

SHORTEST_INTERVAL = 1e-4  # s
STRAIGHT = 1e-6  # rad turned in an interval: below it the arc's radius is not computed


class OdometryState(NamedTuple):
    """Pose in the odometry frame (m, rad, heading not wrapped) and speed in the body frame (m/s, rad/s) at `stamp` (s).

    The covariances are diagonals: x y z roll pitch yaw.
    """

    stamp: float
    x: float
    y: float
    heading: float
    linear: float
    angular: float
    pose_covariance: tuple = (0.0,) * 6
    twist_covariance: tuple = (0.0,) * 6


class Odometry:
    """wheel_separation, left_radius, right_radius: m. window: number of intervals whose speeds are averaged."""

    def __init__(self, wheel_separation: float, left_radius: float, right_radius: float, window: int = 10) -> None:
        self.wheel_separation = wheel_separation
        self.left_radius = left_radius
        self.right_radius = right_radius
        self.x = self.y = self.heading = 0.0
        self.linear = self.angular = 0.0
        self._speeds = deque(maxlen=window)
        self._wheels = None
        self._time = None
        self._pending = (0.0, 0.0)

    def start(self, left: float, right: float, time: float) -> None:
        """Count from these wheel positions (rad) and this time (s); the pose stays, the speed is forgotten."""
        self._wheels = (left, right)
        self._time = time
        self._pending = (0.0, 0.0)
        self._speeds.clear()
        self.linear = self.angular = 0.0

    def update(self, left: float, right: float, time: float) -> bool:
        """Wheel positions (rad) at `time` (s). True if the speed was renewed.

        The first call only starts counting. Where time went back, counting starts anew from this reading.
        """
        if self._wheels is None or time < self._time:
            self.start(left, right, time)
            return False
        left_distance = (left - self._wheels[0]) * self.left_radius
        right_distance = (right - self._wheels[1]) * self.right_radius
        self._wheels = (left, right)
        distance = 0.5 * (right_distance + left_distance)
        turn = (right_distance - left_distance) / self.wheel_separation
        self._integrate(distance, turn)
        distance, turn = distance + self._pending[0], turn + self._pending[1]
        dt = time - self._time
        if dt < SHORTEST_INTERVAL:
            self._pending = (distance, turn)
            return False
        self._pending = (0.0, 0.0)
        self._time = time
        self._speeds.append((distance / dt, turn / dt))
        self.linear, self.angular = (sum(speeds) / len(self._speeds) for speeds in zip(*self._speeds))
        return True

    def update_open_loop(self, linear: float, angular: float, time: float) -> bool:
        """The chair is taken to have moved with these speeds (m/s, rad/s) since the last call. True if it was not the
        first.

        Where time went back nothing moved.
        """
        before, self._time = self._time, time
        self.linear, self.angular = linear, angular
        if before is None or time < before:
            return False
        self._integrate(linear * (time - before), angular * (time - before))
        return True

    def rebase(self, left: float, right: float) -> None:
        """Count on from these wheel positions (rad): what lies between was not measured. Pose and speed stay."""
        self._wheels = (left, right)

    def _integrate(self, distance, turn):
        if abs(turn) < STRAIGHT:
            middle = self.heading + 0.5 * turn
            self.x += distance * math.cos(middle)
            self.y += distance * math.sin(middle)
            self.heading += turn
            return
        radius = distance / turn
        before, self.heading = self.heading, self.heading + turn
        self.x += radius * (math.sin(self.heading) - math.sin(before))
        self.y -= radius * (math.cos(self.heading) - math.cos(before))
