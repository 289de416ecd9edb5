"""Roll and pitch for levelling the magnetic field: a complementary filter of seconds.

The sensor node's own angles follow the accelerometer within 0.1 s, so that setting off at 0.5 m/s2 tilts them by 3 deg,
and a field that dips by 60 deg is then levelled 5 deg wrong. Here the gyroscope carries the angles, and gravity, which
such pushes do not shift on average, draws them near over `TIME`:

    angle' = rate + (angle of gravity - angle) / TIME,
    roll of gravity = atan2(ay, az), pitch of gravity = atan2(-ax, |ay, az|)

In the first seconds TIME is what has passed, so that the angles are means.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin, tan

TIME = 10.0
"""s."""
STEEPEST = 1.0
"""rad: no floor is steeper, and the equations end at a right angle."""


class Tilt:
    """`roll`, `pitch`: rad."""

    def __init__(self, lean: tuple[float, ...] = (0.0, 0.0)) -> None:
        """lean: rad/s about x and y that the gyroscope shows for each rad/s of a level turn."""
        self._lean = lean
        self.roll = self.pitch = 0.0
        self._stamp: float | None = None
        self._known = 0.0

    def add(self, stamp: float, rates: tuple[float, float, float], force: tuple[float, float, float]) -> None:
        """rates: rad/s, force: the accelerations, m/s2, x forward, y left, z up. Begins anew after a second's gap, or
        when the clock went back.
        """
        ax, ay, az = force
        gravity_roll, gravity_pitch = atan2(ay, az), atan2(-ax, hypot(ay, az))
        dt = None if self._stamp is None else stamp - self._stamp
        self._stamp = stamp
        if dt is None or not 0.0 <= dt <= 1.0:
            self.roll, self.pitch, self._known = _flat(gravity_roll), _flat(gravity_pitch), 0.0
            return
        if dt == 0.0:
            return
        self._known = min(self._known + dt, TIME)
        x, y, z = rates
        x, y = x - self._lean[0] * z, y - self._lean[1] * z
        sr, cr = sin(self.roll), cos(self.roll)
        roll_rate, pitch_rate = x + (sr * y + cr * z) * tan(self.pitch), cr * y - sr * z
        share = dt / (self._known + dt)
        self.roll = _flat(self.roll + roll_rate * dt + share * (gravity_roll - self.roll))
        self.pitch = _flat(self.pitch + pitch_rate * dt + share * (gravity_pitch - self.pitch))

    def levelled(self, field: tuple[float, float, float]) -> tuple[float, float, float]:
        """A vector along the robot's axes, turned so that z is the vertical: Ry(pitch) Rx(roll)."""
        x, y, z = field
        sr, cr, sp, cp = sin(self.roll), cos(self.roll), sin(self.pitch), cos(self.pitch)
        y, z = cr * y - sr * z, sr * y + cr * z
        return cp * x + sp * z, y, -sp * x + cp * z


def _flat(angle: float) -> float:
    return min(max(angle, -STEEPEST), STEEPEST)
