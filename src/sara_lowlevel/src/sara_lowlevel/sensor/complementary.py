"""Complementary filter: angles from integrated rates, with roll and pitch drawn to what gravity says.

Thesis eq. 2.11 to 2.16: roll = atan2(ay, hypot(ax, az)), pitch = atan2(-ax, hypot(ay, az)), and
angle = A (angle + rate dt) + (1 - A) angle_of_gravity. Yaw has no reference: it is integrated alone.
"""

from __future__ import annotations

from math import atan2, degrees, hypot

_TO_DEGREES = degrees(1.0)


class ComplementaryFilter:
    """`roll`, `pitch`, `yaw` in degrees; yaw grows without wrapping."""

    def __init__(self, weight: float, period: float) -> None:
        """`weight`: A, between 0 and 1. `period`: s between samples, where `update` gets no dt."""
        self.weight, self.period = weight, period
        self.roll = self.pitch = self.yaw = 0.0
        self._started = False

    def restart(self) -> None:
        """After a gap: the next sample sets roll and pitch anew; yaw stays."""
        self._started = False

    def update(
        self, accel: tuple[float, float, float], rate: tuple[float, float, float], dt: float | None = None
    ) -> None:
        """`accel`: specific force x, y, z in any unit; `rate`: x, y, z in deg/s; `dt`: s since the last sample. The
        first sets roll and pitch.
        """
        ax, ay, az = accel
        gx, gy, gz = rate
        roll = atan2(ay, hypot(ax, az)) * _TO_DEGREES
        pitch = atan2(-ax, hypot(ay, az)) * _TO_DEGREES
        if not self._started:
            self.roll, self.pitch, self._started = roll, pitch, True
            return
        if dt is None:
            dt = self.period
        weight = self.weight
        self.roll = weight * (self.roll + gx * dt) + (1.0 - weight) * roll
        self.pitch = weight * (self.pitch + gy * dt) + (1.0 - weight) * pitch
        self.yaw += gz * dt
