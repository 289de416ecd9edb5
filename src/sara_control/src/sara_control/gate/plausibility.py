"""Compares wheels and turn rate with the command and with each other: finds sensors that send wrong readings.

It takes the encoder frames and the IMU directly, not the odometry, so that it does not share an error there. Each wheel
is followed on its own counters (modulo 2^32, in the motor node's own time). A wheel that does not turn as commanded is
found by WheelWatch; a wheel that turns without a command, and an IMU that contradicts the wheels, by consecutive
readings.
"""

import math
from collections.abc import Sequence

from sara_control.gate.gate_config import PlausibilityConfig
from sara_control.gate.reasons import Reason
from sara_control.wheels.wheel_watch import WheelWatch

WRAP = 2**32
TICK = 1e-4  # s
RIGHT, LEFT = 0, 1
LAG = 0.1  # s, of the motors: the command passes it before it is compared


class _Wheel:
    """The last reading of one wheel, and the speed since the one before."""

    def __init__(self) -> None:
        self.steps = self.clock = None
        self.angle = 0.0
        self.speed = math.nan
        self.stamp = -math.inf


class Plausibility:
    """config: PlausibilityConfig. `fault`: Reason or None. `dropped`: {kind: how often}. `encoder_stamp`: the
    older of the two wheels' newest stamps, s. `imu_frozen`: whether the newest reading of the IMU was no estimate.
    `speed`: the faster wheel's, m/s, NaN before both are known. `rolled`: (stamp, m that the wheels' mean has rolled)
    of the newest readings.
    """

    def __init__(self, config: PlausibilityConfig) -> None:
        self.config = config
        self.dropped = {}
        self.imu_stamp, self.imu_frozen = -math.inf, False
        self.encoder_stamp, self.speed = -math.inf, math.nan
        self.rolled = -math.inf, 0.0
        self._wheels = _Wheel(), _Wheel()
        self._watch = WheelWatch(config.frozen_distance, (config.wheel_radius, config.wheel_radius))
        self._fresh = set()
        self._expected = [0.0, 0.0]
        self._commanded = False
        self._last = None
        self._runaway = self._contrary = 0
        self.fault = None

    @property
    def rolling(self) -> float:
        """The wheels' mean speed, m/s, forward positive; 0 before both are known."""
        right, left = self._wheels
        mean = 0.5 * (right.speed + left.speed) * self.config.wheel_radius
        return 0.0 if math.isnan(mean) else mean

    def _follow(self, wheel, speed, stamp):
        """A _Wheel turned at a speed (rad/s) at stamp (s)."""
        wheel.speed, wheel.stamp = speed, stamp
        right, left = self._wheels
        self.encoder_stamp = min(right.stamp, left.stamp)
        if not math.isnan(right.speed + left.speed):
            self.speed = max(abs(right.speed) * self.config.wheel_radius, abs(left.speed) * self.config.wheel_radius)

    def on_command(self, t: float, v: float, w: float, obeyed: bool) -> None:
        """From t (s) on (v, w) is commanded; obeyed: whether the chair obeys. At rest a fault is cleared."""
        dt = 0.0 if self._last is None else min(max(t - self._last, 0.0), 0.1)
        self._last = t
        half = 0.5 * w * self.config.wheel_separation
        right, left = (v + half) / self.config.wheel_radius, (v - half) / self.config.wheel_radius
        gain, expected = 1.0 - math.exp(-dt / LAG), self._expected
        expected[RIGHT] += gain * (right - expected[RIGHT])
        expected[LEFT] += gain * (left - expected[LEFT])
        self._watch.on_command(left, right, t)
        if not obeyed or (v == w == 0.0 and not self.speed * 2.0 > self.config.runaway_speed):
            self._forget()
        self._commanded = obeyed

    def _forget(self):
        self._watch.reset()
        self._runaway = self._contrary = 0
        self.fault = None

    def on_encoder(self, stamp: float, index: int, steps: int, time_100us: int) -> bool:
        """Counters of wheel `index` (0 right, 1 left) received at stamp (s). False if they are dropped."""
        if index not in (RIGHT, LEFT):
            return self._drop('unknown wheel')
        wheel = self._wheels[index]
        if wheel.steps is None:
            wheel.steps, wheel.clock = steps, time_100us
            return True
        interval = _signed(time_100us - wheel.clock) * TICK
        angle = _signed(steps - wheel.steps) * math.tau / self.config.steps_per_turn
        if -1.0 < interval <= 0.0:
            return self._drop('encoder clock does not go on')
        wheel.steps, wheel.clock = steps, time_100us
        if interval < 0.0 or abs(angle) > self.config.max_wheel_speed * interval:
            return self._drop('encoder jumped')
        wheel.angle += angle
        self._follow(wheel, angle / interval, stamp)
        self._fresh.add(index)
        if len(self._fresh) == 2:
            self._fresh.clear()
            self._judge(stamp)
        return True

    def _judge(self, stamp):
        right, left = self._wheels
        self.rolled = stamp, 0.5 * self.config.wheel_radius * (right.angle + left.angle)
        if self._watch.on_wheels(left.angle, right.angle, stamp) and self._commanded:
            self.fault = self.fault or Reason.FROZEN
        limit = self.config.runaway_speed / self.config.wheel_radius
        away = any(_beyond(wheel.speed, expected) > limit for wheel, expected in zip(self._wheels, self._expected))
        self._runaway = self._runaway + 1 if away and self._commanded else 0
        if self._runaway >= self.config.runaway_readings:
            self.fault = self.fault or Reason.RUNAWAY

    def on_imu(self, stamp: float, rates: Sequence[float], frozen: bool = False) -> bool:
        """Angular velocity (3 x rad/s) measured at stamp (s); frozen: it is no estimate. False if it is dropped."""
        self.imu_frozen = frozen
        if frozen:
            self.imu_stamp = -math.inf
            return self._drop('turn sensor frozen')
        if not all(math.isfinite(rate) and abs(rate) <= self.config.max_turn_rate for rate in rates):
            return self._drop('turn rate not possible')
        self.imu_stamp = stamp
        right, left = self._wheels
        turn = (right.speed - left.speed) * self.config.wheel_radius / self.config.wheel_separation
        contrary = abs(rates[2] - turn) > self.config.turn_difference
        self._contrary = self._contrary + 1 if contrary and self._commanded else 0
        if self._contrary >= self.config.turn_readings:
            self.fault = self.fault or Reason.TURN
        return True

    def _drop(self, kind):
        self.dropped[kind] = self.dropped.get(kind, 0) + 1
        return False


def _beyond(speed, expected):
    """How far a wheel is faster than it should be, or turns the other way, rad/s; slower is no danger."""
    along = speed if expected >= 0.0 else -speed
    return max(along - abs(expected), -along)


def _signed(difference):
    """A difference of two counters that wrap at 2^32, the short way round."""
    return (difference + WRAP // 2) % WRAP - WRAP // 2
