"""The compass: magnetic fields, rates and wheels in, corrected fields and a heading out.

A field takes part in the heading only where it is the earth's: by its strength, by its dip, and by what the gyroscope
says of the yaw. Otherwise the heading goes on by the gyroscope, and its variance grows.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

from canserial.calibration.iron import Iron
from canserial.reader.compass_config import CompassConfig
from canserial.reader.heading_filter import HeadingFilter, effort
from canserial.reader.readings import LEFT, RIGHT, FieldReading, HeadingReading, ImuReading
from canserial.reader.tilt import Tilt

LONGEST_STEP = 1.0
"""s; a gap of the gyroscope beyond it is the reader's to account for."""
LONGEST_AHEAD = 0.2
"""s between a field and the rates before it."""
CLEAR, BEGINNING = 10, 20
"""Undisturbed fields in a row, until fields count after a disturbed one, and at rest, until there is a heading."""
WHEEL_SILENT = 0.5
"""s without a wheel's counter after which its motor counts as idle."""


class Compass:
    """iron: the chair's, None before it was calibrated. drop: called with (kind, stamp) for a field that is left out.

    `filter`: HeadingFilter, None without a calibration. `clear`: whether the newest field was the earth's.
    `clear_stamp`: s, of the last one that was, None before the first. `efforts`: of the right and left motor, -1..1.
    """

    def __init__(
        self,
        config: CompassConfig,
        iron: Iron | None,
        gain: float,
        per_step: float,
        drop: Callable[[str, float], object],
    ) -> None:
        """gain: of the rates; per_step: rad that a wheel turns for a step of its counter."""
        self.config, self._per_step, self._drop, self._gain = config, per_step, drop, gain
        self.iron = iron
        self.clear_stamp: float | None = None
        self._averaged = 0  # fields in the mean, while they are few
        self._turned, self._sum = 0.0, 0j  # rad by the gyroscope; of the last fields, turned back by it
        self._imu: ImuReading | None = None
        self._wheels: dict = {}
        self._speeds = dict.fromkeys((RIGHT, LEFT), (0.0, -math.inf))  # rad/s, s
        self._still = False
        self._mean_at = 0.0
        self._odometer = self._rolled_before = 0.0  # rad of the wheels: in all, and at the last rates
        self._contradicts_since: float | None = None

    @property
    def iron(self) -> Iron | None:
        """The calibration; setting it begins the heading anew."""
        return self._iron

    @iron.setter
    def iron(self, iron: Iron | None) -> None:
        self._iron = iron
        self.tilt = Tilt() if iron is None else Tilt(iron.lean)
        self._run, self._mean, self.clear = 0, None, False
        self.filter = None if iron is None else HeadingFilter(iron, self.config, self._gain)

    def set_gain(self, gain: float) -> None:
        """The rates have another gain from now on; the heading begins anew."""
        self._gain, self.iron = gain, self._iron

    @property
    def waits(self) -> bool:
        """Whether it is calibrated and there is no heading yet."""
        return self.filter is not None and not self.filter.started

    @property
    def efforts(self) -> tuple[float, float]:
        now = -math.inf if self._imu is None else self._imu.stamp
        known = self._speeds[RIGHT], self._speeds[LEFT]
        right, left = (speed if now - stamp <= WHEEL_SILENT else 0.0 for speed, stamp in known)
        return effort(right), effort(left)

    def on_wheel(self, stamp: float, wheel: int, steps: int, restarted: bool) -> None:
        """A counter that is believed."""
        known = self._wheels.get(wheel)
        self._wheels[wheel] = stamp, steps
        if known is None or restarted or not 0.0 < stamp - known[0] <= LONGEST_STEP:
            return
        turned = ((steps - known[1] + 2**31) % 2**32 - 2**31) * self._per_step
        self._speeds[wheel] = turned / (stamp - known[0]), stamp
        self._odometer += 0.5 * abs(turned)

    def on_imu(self, reading: ImuReading, still: bool) -> HeadingReading | None:
        """Rates and accelerations; still: the robot stands. The heading at their time, None before there is one."""
        before, self._imu, self._still = self._imu, reading, still
        if reading.frozen:
            return None
        self.tilt.add(reading.stamp, reading.angular_velocity, reading.linear_acceleration)
        rolled, self._rolled_before = self._odometer - self._rolled_before, self._odometer
        heading, (x, y, z) = self.filter, reading.angular_velocity
        dt = 0.0 if before is None else min(max(reading.stamp - before.stamp, 0.0), LONGEST_STEP)
        self._turned += z * dt
        if heading is None or not heading.started:
            return None
        if reading.unseen:
            self._mean, self._run = None, 0  # the gyroscope does not turn back what it missed
        heading.predict(dt, z, rolled, still, reading.unseen)
        return HeadingReading(
            reading.stamp,
            self.tilt.roll,
            self.tilt.pitch,
            heading.yaw,
            (x, y, heading.rate(z)),
            reading.linear_acceleration,
            heading.yaw_variance,
        )

    def on_field(self, stamp: float, measured: tuple[float, float, float]) -> FieldReading:
        """A field as the chip measured it, uT."""
        if self._iron is None:
            return FieldReading(stamp, measured, False)
        field = self._iron.corrected(measured)
        if self._imu is not None and 0.0 <= stamp - self._imu.stamp <= LONGEST_STEP and not self._imu.frozen:
            self._judge(stamp, self.tilt.levelled(field))
        return FieldReading(stamp, field, True)

    def _judge(self, stamp, level):
        """Left out, or learned from."""
        heading, iron, efforts = self.filter, self._iron, self.efforts
        x, y, z = (float(value - added) for value, added in zip(level, heading.added(efforts)))
        flat = math.hypot(x, y)
        stronger, steeper = math.hypot(flat, z) - iron.total, math.atan2(-z, flat) - iron.dip
        seen = stronger**2 + (iron.total * steeper) ** 2
        ahead = self._ahead(stamp)
        turned = cmath.rect(1.0, self._turned + ahead)
        if not self._is_earths(stronger, steeper) or not self._is_steady(complex(x, y) * turned):
            self.clear, self._run = False, 0
            self._drop('compass_disturbed', stamp)
            return
        self._run += 1
        self._sum = (0j if self._run == 1 else self._sum) + complex(*level[:2]) * turned
        if not heading.started and not self._still:
            self._run = 0
        if self._run < (CLEAR if heading.started else BEGINNING):
            return
        if not heading.started:
            mean = self._sum / self._run * cmath.rect(1.0, -self._turned)
            heading.begin((mean.real, mean.imag, z), seen)
        elif not heading.correct(level, ahead, efforts, seen):
            self._contradict(stamp, level, seen)
            return
        self.clear, self.clear_stamp, self._contradicts_since = True, stamp, None

    def _is_earths(self, stronger, steeper):
        """By its strength (uT beyond the earth's) and dip (rad beyond)."""
        config = self.config
        return abs(stronger) <= config.compass_norm_tolerance and abs(steeper) <= config.compass_dip_tolerance

    def _is_steady(self, field):
        """By the mean over the last metres, both turned back by the gyroscope: near steel it changes on the way."""
        rolled, self._mean_at = self._odometer - self._mean_at, self._odometer
        if self._mean is None or not self.filter.started and self._run == 0:
            self._mean, self._averaged = field, 0
        steady = abs(field - self._mean) <= self.config.compass_steady_tolerance
        self._averaged += 1
        share = max(rolled / self.config.compass_steady_roll, 1.0 / self._averaged if self._averaged <= CLEAR else 0.0)
        self._mean += min(share, 1.0) * (field - self._mean)
        return steady

    def _ahead(self, stamp):
        """rad turned since the last rates."""
        return self._imu.angular_velocity[2] * min(stamp - self._imu.stamp, LONGEST_AHEAD)

    def _contradict(self, stamp, level, seen):
        """The gyroscope is believed, but not for ever."""
        self.clear, self._run = False, 0
        self._drop('compass_contradicts', stamp)
        if self._contradicts_since is None:
            self._contradicts_since = self._odometer
        elif self._odometer - self._contradicts_since > self.config.compass_restart_roll:
            self._contradicts_since = None
            self._drop('compass_restarts', stamp)
            self.filter.begin(level, seen)
