"""Yaw from the calibrated yaw rate, over the real time between frames.

The rate is corrected first, k (gz - offset) (thesis 3.3 and table 4.11), and that corrected rate is both integrated and
given out; so a yaw that is set from outside is not scaled by k. A frame holds the mean rate of the turn that ended with
it, hence the turned angle grows by rate x dt exactly; what a lost frame would have said is taken as the mean of its
neighbours.

Yaw is kept as (yaw at a moment, angle turned since): a yaw given for any moment, past, present or between two frames,
is exact.
"""

from __future__ import annotations

import math
from collections import deque

from sara_common.planar import wrap_exact

HISTORY = 512  # knots kept so that a yaw given for a past moment can be carried to now: 25 s of the fastest frames


class YawIntegrator:
    """Integrates a yaw rate; set() gives the yaw at a moment, past or present.

    period: s between frames (may be changed). max_gap: s. gain: factor on the rate (may be changed; what was turned
    before keeps the gain of its time). `gaps` counts the waits of more than 1.5 periods, `long_gaps` those of more than
    max_gap, whose turn is unknown and taken as none. `turned` is the angle turned since the beginning, rad, without the
    gain, not wrapped.
    """

    def __init__(self, period: float, max_gap: float, yaw: float = 0.0, gain: float = 1.0) -> None:
        self.period = period
        self.max_gap = max_gap
        self.gain = gain
        self.turned = 0.0
        self.gaps = 0
        self.long_gaps = 0
        self._stamp = None
        self._rate = 0.0
        self._angle = 0.0  # with the gain, not wrapped
        self._knots = deque(maxlen=HISTORY)  # (stamp, angle); linear in between
        self._given = wrap_exact(yaw)  # the yaw when the angle was _zero
        self._zero = 0.0  # None while the moment of the given yaw is still to come
        self._given_at = -math.inf

    @property
    def stamp(self) -> float | None:
        """Of the newest frame, s; None before the first."""
        return self._stamp

    @property
    def yaw(self) -> float:
        """The yaw at the newest frame (or, where that is later, at the last set()), rad."""
        return self._given if self._zero is None else wrap_exact(self._given + self._angle - self._zero)

    @property
    def pending(self) -> bool:
        """Whether the moment of the last set() is still to come."""
        return self._zero is None

    def add(self, stamp: float, rate: float) -> bool:
        """Take the mean rate (rad/s, without the gain) of the turn that ends at stamp (s).

        Returns False if the frame repeats the last one, which leaves yaw alone, or is not newer than the last set().
        A clock that went back is a new beginning, in which the frame speaks for its period; nothing is integrated over
        a jump of more than max_gap.
        """
        if self._stamp is None or stamp < self._stamp:
            goes_on = self._stamp is not None and self._stamp - stamp <= self.max_gap
            self._begin(stamp, rate)
            if goes_on:
                self._turn(stamp, rate * self.period)
            return self._zero is not None
        dt = stamp - self._stamp
        if dt == 0.0:
            return False
        if dt > 1.5 * self.period:
            dt = self._bridge(stamp, dt, rate)
        self._turn(stamp, rate * dt)
        self._stamp, self._rate = stamp, rate
        if self._zero is None:
            if stamp <= self._given_at:
                return False
            self._zero = self._angle_at(self._given_at)
        return True

    def set(self, yaw: float, stamp: float) -> None:
        """The yaw was `yaw` (rad) at `stamp` (s): what was turned since then is kept, and older frames are ignored."""
        self._given, self._given_at = wrap_exact(yaw), stamp
        newest = self._stamp
        self._zero = None if newest is None or stamp > newest else self._angle_at(stamp)

    def _begin(self, stamp, rate):
        if self._stamp is not None or self._given_at <= stamp:
            self._given, self._zero, self._given_at = self.yaw, self._angle, -math.inf
        self._knots.clear()
        self._knots.append((stamp, self._angle))
        self._stamp, self._rate = stamp, rate

    def _bridge(self, stamp, dt, rate):
        """Account for lost frames; returns the time (s) that the frame itself speaks for."""
        self.gaps += 1
        if dt > self.max_gap:
            self.long_gaps += 1
            self._turn(stamp - self.period, 0.0)
        else:
            self._turn(stamp - self.period, 0.5 * (rate + self._rate) * (dt - self.period))
        return self.period

    def _turn(self, stamp, angle):
        self.turned += angle
        self._angle += self.gain * angle
        self._knots.append((stamp, self._angle))

    def _angle_at(self, stamp):
        """Before the oldest knot, the oldest is the best there is."""
        later_stamp, later = self._knots[-1]
        if stamp >= later_stamp:
            return later
        for knot_stamp, angle in reversed(self._knots):
            if knot_stamp <= stamp:
                return angle + (stamp - knot_stamp) / (later_stamp - knot_stamp) * (later - angle)
            later_stamp, later = knot_stamp, angle
        return later
