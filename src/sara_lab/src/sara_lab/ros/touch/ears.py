"""What the chair is told and does while a page drives it."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from sara_common.planar import yaw_of
from sara_control.gate.comfort import Profile
from sara_lab.fuzz.touch.rest import REST, Rest, rest_after

STILL_S = 0.5


class Ears:
    """What the chair is told and does, each [(when by the monotonic clock, m/s)]: the page's commands, the gate's
    output, the true speed. `clock`: [(when, s of the simulator's clock)]. `begin_ahead`: whether
    `start` (x, y in m) lies ahead.
    """

    def __init__(self, start: Sequence[float]) -> None:
        self._start = start
        self.begin_ahead = True
        self.forget()
        self._ears = [
            rospy.Subscriber('/cmd_vel/touch', Twist, lambda m: self._hear(self.touched, m.linear.x), tcp_nodelay=True),
            rospy.Subscriber(
                '/diff_drive_controller/cmd_vel',
                Twist,
                lambda m: self._hear(self.commanded, m.linear.x),
                tcp_nodelay=True,
            ),
            rospy.Subscriber('/ground_truth', Odometry, self._on_truth, tcp_nodelay=True),
        ]

    def forget(self) -> None:
        """Listen anew."""
        self.touched: list[tuple[float, float]] = []
        self.commanded: list[tuple[float, float]] = []
        self.true: list[tuple[float, float]] = []
        self.clock: list[tuple[float, float]] = []

    @staticmethod
    def _hear(series, speed):
        series.append((time.monotonic(), speed))

    def _on_truth(self, message):
        pose = message.pose.pose
        yaw = yaw_of(pose.orientation)
        dx, dy = self._start[0] - pose.position.x, self._start[1] - pose.position.y
        self.begin_ahead = dx * math.cos(yaw) + dy * math.sin(yaw) >= 0.0
        self._hear(self.clock, message.header.stamp.to_sec())
        self._hear(self.true, message.twist.twist.linear.x)

    def rest_after(self, zero: float, profile: Profile) -> Rest:
        """How the chair came to rest after a zero, on the simulator's clock: a busy machine makes it slow."""
        when, stamps = np.array(self.clock).T

        def simulated(series: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
            return [(float(np.interp(t, when, stamps)), v) for t, v in list(series)]

        at = float(np.interp(zero, when, stamps))
        return rest_after(at, simulated(self.commanded), simulated(self.true), profile)

    @property
    def still(self) -> bool:
        """Whether the chair has been at rest for STILL_S."""
        lately = [abs(v) for t, v in list(self.true) if t > time.monotonic() - STILL_S]
        return len(lately) > 5 and max(lately) < REST
