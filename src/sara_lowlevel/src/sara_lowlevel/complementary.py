"""Complementary filter: angles from integrated rates, with roll and pitch drawn to what gravity says.

Thesis eq. 2.11 to 2.16: roll = atan2(ay, hypot(ax, az)), pitch = atan2(-ax, hypot(ay, az)), and
angle = A (angle + rate dt) + (1 - A) angle_of_gravity. Yaw has no reference: it is integrated alone.
"""

from __future__ import annotations

from math import atan2, degrees, hypot


class ComplementaryFilter:
    """`roll`, `pitch`, `yaw` in degrees; yaw grows without wrapping."""

    def __init__(self, weight: float, period: float):
        """`weight`: A, between 0 and 1. `period`: s between samples."""
        self.weight, self.period = weight, period
        self.roll = self.pitch = self.yaw = 0.0
        self._started = False

    def update(self, accel: tuple[float, float, float], rate: tuple[float, float, float]) -> None:
        """`accel`: specific force x, y, z in any unit; `rate`: x, y, z in deg/s. The first sample sets roll and pitch."""
        ax, ay, az = accel
        roll = degrees(atan2(ay, hypot(ax, az)))
        pitch = degrees(atan2(-ax, hypot(ay, az)))
        if not self._started:
            self.roll, self.pitch, self._started = roll, pitch, True
            return
        weight, dt = self.weight, self.period
        self.roll = weight * (self.roll + rate[0] * dt) + (1.0 - weight) * roll
        self.pitch = weight * (self.pitch + rate[1] * dt) + (1.0 - weight) * pitch
        self.yaw += rate[2] * dt
