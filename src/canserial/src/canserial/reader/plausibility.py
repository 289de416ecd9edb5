"""What a frame says against what can be: values that do not change though they must, and counters that jump.

One-shot nonsense is dropped and forgotten; what stays, such as the counters of a motor node that was started anew, is
believed when the next frame bears it out.
"""

from __future__ import annotations

import math

STUCK_FRAMES = 10  # fewer equal frames prove nothing, however long they took
OLD = 1.0  # s; a clock that went back by less repeats an old frame, by more was started anew
CLOCK_TOLERANCE = 1.0  # s between a node's own clock and the reception; adapters hold frames back in bursts
CLOCK_DRIFT = 1e-3  # of the time since the last frame: quartz and its temperature, with a wide margin
GRAVITY = 9.81  # m/s2
GRAVITY_TIME = 1.0  # s of rest over which the norm of the acceleration is averaged

CLOCK_STUCK, CLOCK_JUMPED, JUMPED = 'encoder_clock_stuck', 'encoder_clock_jumped', 'encoder_jumped'


class StuckValue:
    """Says whether a value that carries noise has been the same to the last bit for longer than `limit` s.

    The MPU6050's rates, means over 0.2 s, have a sigma of 0.073 deg/s or more (thesis table 4.5). In tenths of deg/s
    two consecutive triplets at rest are equal with a probability of at most 0.09, so ten in a row come by chance once
    in 10^9 turns and the 25 of 5 s never; in hundredths, and for accelerations and angles, equality is far rarer still.
    """

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self._value = None
        self._since = 0.0
        self._count = 0

    def add(self, stamp: float, value: object) -> bool:
        """Take a value (any that compares); True while it is stuck."""
        if value != self._value or stamp < self._since:
            self._value, self._since, self._count = value, stamp, 1
            return False
        self._count += 1
        return self._count > STUCK_FRAMES and stamp - self._since > self.limit


class FrozenImu:
    """Says whether the IMU's data registers stand still: all six axes equal to the last bit in `frames` frames in a
    row; 0: never.

    Three values of a noise of standard deviation s, rounded to steps of q, are equal with a probability of
    q^2 / (2 pi sqrt(3) s^2). Accelerations come in thousandths of m/s2, with an s of at least 0.0576, 0.0365 and 0.0476
    (thesis table 4.1): 3e-5, 7e-5 and 4e-5, all three 8e-14. In tenths of deg/s all rates may be equal by 0.09 (see
    StuckValue), so a living sensor at rest is called frozen once in 10^14 frames: in fast mode once in 10^5 years.

    A rate counts with an acceleration of its own, and half a period after the last that did: a frame that came twice
    is no proof, one that was lost none to the contrary. `since`: s, from when on the values may be old.
    """

    def __init__(self, frames: int) -> None:
        self.frames = frames
        self.since = 0.0
        self._count, self._counted = 0, -math.inf
        self._gyro = self._acceleration = None

    @property
    def frozen(self) -> bool:
        """Whether it is."""
        return 0 < self.frames <= self._count

    def add(self, stamp: float, gyro: tuple, acceleration: tuple | None, period: float) -> bool:
        """Take the rates of a frame, and the accelerations that came since the last one, None if none did; period: s
        between frames. True while the IMU is frozen.
        """
        known = self._acceleration
        same = gyro == self._gyro and (acceleration == known or None in (acceleration, known))
        if not same or stamp < self._counted:
            self._gyro, self._acceleration = gyro, None
            self._count, self._counted = 0, -math.inf
            self.since = stamp - 2.0 * period  # its own turn, and the one in which the registers came to stand
        if acceleration is not None and stamp - self._counted >= 0.5 * period:
            self._acceleration = acceleration
            self._count, self._counted = self._count + 1, stamp
        return self.frozen


class EncoderGuard:
    """Checks one wheel's counters (modulo 2^32) against its fastest speed, by the motor node's own clock.

    fastest: steps/s. slack: steps that are always allowed. `restarts` counts the jumps that the next frame bore out.
    """

    def __init__(self, fastest: float, slack: int) -> None:
        self._per_tick = fastest * 1e-4
        self._slack = slack
        self._last = None
        self._candidate = None
        self.restarts = 0

    def check(self, stamp: float, steps: int, clock: int) -> str | None:
        """None if the counters (steps, 100 us) received at stamp (s) are believed, else the kind of fault."""
        new = (stamp, steps, clock)
        if self._last is None:
            self._last = new
            return None
        fault = self._fault(self._last, new)
        if fault is None:
            self._last, self._candidate = new, None
        elif fault is not CLOCK_STUCK:
            if self._candidate is not None and self._fault(self._candidate, new) is None:
                self._last, self._candidate = new, None
                self.restarts += 1
                return None
            self._candidate = new
        return fault

    def _fault(self, old, new):
        ticks = _signed(new[2] - old[2])
        own, received = ticks * 1e-4, new[0] - old[0]
        if abs(own - received) > CLOCK_TOLERANCE + CLOCK_DRIFT * abs(received):
            return CLOCK_STUCK if ticks == 0 else CLOCK_JUMPED
        if ticks <= 0:
            return CLOCK_STUCK
        return JUMPED if abs(_signed(new[1] - old[1])) > self._per_tick * ticks + self._slack else None


class GravityWatch:
    """At rest an accelerometer shows gravity: says whether the mean norm over a second of rest was within `tolerance`
    m/s2.

    The verdict holds until the next second of rest.
    """

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.plausible = True
        self._restart()

    def add(self, stamp: float, acceleration: tuple[float, float, float], still: bool) -> bool:
        """Take an acceleration (3 x m/s2) and whether the chair stands; returns the verdict."""
        if not still or stamp < self._since:
            self._restart()
            return self.plausible
        if not self._count:
            self._since = stamp
        x, y, z = acceleration
        self._sum += math.sqrt(x * x + y * y + z * z)
        self._count += 1
        if stamp - self._since >= GRAVITY_TIME:
            self.plausible = abs(self._sum / self._count - GRAVITY) <= self.tolerance
            self._restart()
        return self.plausible

    def _restart(self):
        self._sum, self._count, self._since = 0.0, 0, -math.inf


def _signed(difference):
    return (difference + 2**31) % 2**32 - 2**31
