"""Madgwick's orientation filter without a magnetometer.

S. Madgwick, "An efficient orientation filter for inertial and inertial/magnetic sensor arrays" (2010), section 3: the
rate of change of the quaternion from the gyroscope, less beta times the normalised gradient of f(q) = q* (0,0,0,1) q -
a (eq. 20, 25, 26, 33). Plain floats, for it runs a hundred times a second on a small computer.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2, cos, degrees, hypot, sin, sqrt


class MadgwickFilter:
    """`q`: (w, x, y, z), from the chair's axes to level ones. `roll`, `pitch`, `yaw` (Tait-Bryan z-y-x) in degrees, yaw
    in [-180, 180].
    """

    def __init__(self, beta: float, q: tuple[float, float, float, float] | None = None) -> None:
        """`beta`: rad/s, how fast gravity corrects. `q`: where to start; from the first acceleration, with yaw 0, if
        None.
        """
        self.beta = beta
        self.q = q
        self._yaw_kept = 0.0

    def restart(self) -> None:
        """After a gap: tilt is taken from the next acceleration, yaw stays."""
        if self.q is not None:
            self._yaw_kept = atan2(*self._yaw_terms())
            self.q = None

    def update(self, accel: Sequence[float], gyro: Sequence[float], dt: float) -> None:
        """Take a sample: specific force (x, y, z) in any unit, rates (x, y, z) in rad/s, `dt` s after the last one.

        Without a direction of gravity (0, 0, 0) only the rates count.
        """
        (ax, ay, az), (gx, gy, gz) = accel, gyro
        if self.q is None:
            self._from_gravity(ax, ay, az)
            return
        w, x, y, z = self.q
        dw = 0.5 * (-x * gx - y * gy - z * gz)
        dx = 0.5 * (w * gx + y * gz - z * gy)
        dy = 0.5 * (w * gy - x * gz + z * gx)
        dz = 0.5 * (w * gz + x * gy - y * gx)
        norm = sqrt(ax * ax + ay * ay + az * az)
        if norm > 0.0:
            f1 = 2.0 * (x * z - w * y) - ax / norm
            f2 = 2.0 * (w * x + y * z) - ay / norm
            f3 = 1.0 - 2.0 * (x * x + y * y) - az / norm
            sw = x * f2 - y * f1
            sx = z * f1 + w * f2 - 2.0 * x * f3
            sy = z * f2 - w * f1 - 2.0 * y * f3
            sz = x * f1 + y * f2
            length = sqrt(sw * sw + sx * sx + sy * sy + sz * sz)
            if length > 0.0:
                step = self.beta / length
                dw -= step * sw
                dx -= step * sx
                dy -= step * sy
                dz -= step * sz
        w += dw * dt
        x += dx * dt
        y += dy * dt
        z += dz * dt
        norm = 1.0 / sqrt(w * w + x * x + y * y + z * z)
        self.q = (w * norm, x * norm, y * norm, z * norm)

    @property
    def roll(self) -> float:
        """About x, degrees."""
        w, x, y, z = self.q or (1.0, 0.0, 0.0, 0.0)
        return degrees(atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)))

    @property
    def pitch(self) -> float:
        """About y, degrees, in [-90, 90]."""
        w, x, y, z = self.q or (1.0, 0.0, 0.0, 0.0)
        return degrees(asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0)))

    @property
    def yaw(self) -> float:
        """About z, degrees."""
        return degrees(atan2(*self._yaw_terms()))

    def _yaw_terms(self) -> tuple[float, float]:
        w, x, y, z = self.q or (1.0, 0.0, 0.0, 0.0)
        return 2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)

    def _from_gravity(self, ax: float, ay: float, az: float) -> None:
        """Roll and pitch from the measured force, the yaw kept; nothing to go by without a force."""
        if ax or ay or az:
            self.q = _quaternion(atan2(ay, az), atan2(-ax, hypot(ay, az)), self._yaw_kept)


def _quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """(w, x, y, z) of yaw, then pitch, then roll, rad."""
    cr, sr, cp, sp, cy, sy = cos(roll / 2), sin(roll / 2), cos(pitch / 2), sin(pitch / 2), cos(yaw / 2), sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
