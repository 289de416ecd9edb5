"""SARA's drive on the CAN bus: encoder frames to wheel positions, wheel speeds to command frames, and the handshake.

Both counters of an encoder frame (steps and 100 us) wrap at 2^32. The two wheels' frames belong together when the motor
node read them at the same time; a wheel whose partner was lost waits for the next pair. The command has a coarse
resolution (16 mm/s at the rim): it is rounded, and what rounding left over is carried to the next command, so that the
mean is right.
"""

import math
from collections import Counter

from canserial.dbc.bus import BusDescription
from canserial.dbc.modes import ASSISTED, DRIVE, HELP, PC, STOP, has_assisted
from canserial.reader.readings import EncoderReading
from sara_common.config import ConfigError
from sara_control.wheels.base import WheelPositions
from sara_control.wheels.config import ControllerConfig

WRAP = 2**32
TICK = 1e-4  # s
RIGHT, LEFT = 0, 1


class CanBase:
    """bus: canserial.dbc.bus.BusDescription. max_wheel_speed: rad/s, faster is not believed. period: s between two
    readings. assists: whether the PC helps who drives by the chair's joystick, on a bus that has this mode.

    `counters` counts what was dropped and what was lost, by kind.
    """

    PAIR_TOLERANCE = 0.005  # s
    STALE = 1.0  # s; a clock that went back by less repeats an old frame, by more was started anew

    def __init__(
        self,
        bus: BusDescription,
        steps_per_turn: int,
        max_wheel_speed: float = 20.0,
        period: float = 0.1,
        assists: bool = False,
    ) -> None:
        self._bus = bus
        self._radians = math.tau / steps_per_turn
        self._max_wheel_speed = max_wheel_speed
        self._period = period
        self._resolution = bus.resolution('WHEEL_COMMAND', 'left'), bus.resolution('WHEEL_COMMAND', 'right')
        self._rest = [0.0, 0.0]
        self._waiting = {}
        self._newest = {}
        self._last = None
        self._steps = (0, 0)
        self._unmeasured = 0.0
        self.mode = None
        self._assists, self._switched = assists and has_assisted(bus), False
        self.counters = Counter()

    @classmethod
    def from_config(cls, bus: BusDescription, config: ControllerConfig, assists: bool = False) -> 'CanBase':
        """With the settings of a ControllerConfig. Raises ConfigError where it does not know the encoders."""
        if not config.steps_per_turn:
            raise ConfigError('steps_per_turn is missing: encoder edges of a wheel turn')
        return cls(bus, config.steps_per_turn, config.max_wheel_speed, config.encoder_period, assists)

    @property
    def may_drive(self) -> bool:
        """Whether the motor node takes commands from the PC."""
        return self.mode == PC or self._assists and self.mode == ASSISTED

    def on_mode(self, mode: int) -> None:
        """The motor node reports who drives (modoPC)."""
        self.mode = mode

    def on_switch(self, mode: int) -> None:
        """The joystick node reports what its switch says (modo)."""
        self._switched = mode == ASSISTED

    def on_encoder(self, reading: EncoderReading) -> WheelPositions | None:
        """Takes an EncoderReading; returns WheelPositions when it completes a pair, else None."""
        if reading.wheel not in (RIGHT, LEFT):
            self.counters['unknown_wheel'] += 1
            return None
        if not self._is_newer(reading):
            self.counters['repeated'] += 1
            return None
        self._newest[reading.wheel] = reading.time_100us
        self._waiting[reading.wheel] = reading
        partner = self._waiting.get(1 - reading.wheel)
        if partner is None:
            return None
        apart = _signed(reading.time_100us - partner.time_100us) * TICK
        if abs(apart) > self.PAIR_TOLERANCE:
            # One of the two lost its partner; the newer one may still get its own.
            self.counters['without_partner'] += 1
            return None
        self._waiting.clear()
        return self._on_pair(self._pair(reading, partner))

    def _is_newer(self, reading):
        newest = self._newest.get(reading.wheel)
        return newest is None or not -self.STALE < _signed(reading.time_100us - newest) * TICK <= 0.0

    @staticmethod
    def _pair(one, other):
        right, left = (one, other) if one.wheel == RIGHT else (other, one)
        return left.steps, right.steps, right.time_100us, max(left.stamp, right.stamp)

    def _on_pair(self, pair):
        left, right, clock, stamp = pair
        last, self._last = self._last, pair
        if last is None:
            return WheelPositions(0.0, 0.0, stamp, 0.0)
        interval = _signed(clock - last[2]) * TICK
        # Repeated frames never come here: the motor node started anew, its counters too.
        if interval <= 0.0 or 0.0 <= stamp - last[3] < interval - self.STALE:
            self.counters['clock_restarted'] += 1
            self._unmeasured += max(0.0, stamp - last[3])
            return None
        moved = _signed(left - last[0]), _signed(right - last[1])
        if max(map(abs, moved)) * self._radians > self._max_wheel_speed * interval:
            self.counters['implausible_steps'] += 1
            moved = (0, 0)
            self._unmeasured += interval
            interval = 0.0
        lost = max(0, round(interval / self._period) - 1)
        if lost:
            self.counters['readings_lost'] += lost
        self._steps = (self._steps[0] + moved[0], self._steps[1] + moved[1])
        unmeasured, self._unmeasured = self._unmeasured, 0.0
        return WheelPositions(
            self._steps[0] * self._radians,
            self._steps[1] * self._radians,
            stamp,
            interval,
            lost * self._period,
            unmeasured,
        )

    def command(self, left: float, right: float) -> object:
        """The frame that commands these wheel speeds (rad/s); a stop that asks for control while the PC has none."""
        if not (math.isfinite(left) and math.isfinite(right)):
            self.counters['command_not_finite'] += 1
            left = right = 0.0
        if not self.may_drive:
            return self._stop(HELP if self._assists and self._switched else STOP)
        # Beyond what a frame can carry both wheels slow down together: the arc stays.
        left_step, right_step = self._resolution
        fastest = max(abs(left) / (127.0 * left_step), abs(right) / (127.0 * right_step))
        if fastest > 1.0:
            left, right = left / fastest, right / fastest
            self.counters['command_too_fast'] += 1
        return self._bus.encode('WHEEL_COMMAND', left=self._round(0, left), right=self._round(1, right), mode=DRIVE)

    def stop(self) -> object:
        """The frame that stops both wheels at once."""
        return self._stop(STOP)

    def _stop(self, mode):
        self._rest = [0.0, 0.0]
        return self._bus.encode('WHEEL_COMMAND', left=0.0, right=0.0, mode=mode)

    def _round(self, index, speed):
        """The speed as a multiple of the resolution; the remainder is kept for the next time, but not across a stop."""
        if speed == 0.0:
            self._rest[index] = 0.0
            return 0.0
        step = self._resolution[index]
        wanted = min(max(speed / step + self._rest[index], -128.0), 127.0)
        raw = round(wanted)
        self._rest[index] = wanted - raw
        return raw * step


def _signed(difference):
    """A difference of two counters that wrap at 2^32, the short way round."""
    return (difference + WRAP // 2) % WRAP - WRAP // 2
