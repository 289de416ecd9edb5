"""Turning in place onto a heading without hunting, on a base that answers late and turns no slower than a minimum.

Speeds are those of base_local_planner's rotate-to-goal: as fast as the angle that is left, no slower than the minimum,
no faster than the maximum, within the acceleration and what it can stop from. What is added: the turn ends early by the
angle the base still coasts, which is learned from every stop (before the first it ends where the tolerance begins, as
the peer's do always); an angle smaller than that is turned in a pulse; and nothing is decided again until the base has
come to rest.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sara_common.planar import wrap

SETTLE = 0.3
"""Seconds of standing, commanded and measured, until a stop counts."""
GIVE_UP = 1.5
"""Seconds after which a stop counts although the measured speed does not fall (odometry that shakes)."""
FIRST_GUESS, LONGEST_COAST = 0.1, 0.6
"""Seconds that the base goes on at the last rate: least before a stop has been seen, and most."""


@dataclass(frozen=True)
class TurnLimits:
    """Speeds (rad/s) and acceleration (rad/s2) of turns in place; stopped: speed below which the base stands."""

    slowest: float
    fastest: float
    acceleration: float
    stopped: float


class Rates(NamedTuple):
    """Turn rates (rad/s): measured, and commanded last."""

    measured: float
    last: float


class InPlaceTurn:
    """One turn onto a heading. ``coast`` (s): how long the base goes on at the last rate; learned, kept for good."""

    def __init__(self):
        self.coast = FIRST_GUESS
        self._learned = False
        self.begin()

    def begin(self) -> None:
        """Start a new turn."""
        self._sense = 0.0
        self._pulse = None
        self._stopped_at = None
        self._rate_at_stop = 0.0

    def rate(
        self, t: float, dt: float, error: float, rates: Rates, limits: TurnLimits, tolerance: float
    ) -> float | None:
        """Return the rate (rad/s) to command, or None once the base rests within ``tolerance`` (rad) of the heading.

        error: heading wanted minus heading (rad).
        """
        last = rates.last
        if self._stopped_at is not None:
            if not self._rests(t, rates, limits):
                return 0.0
            self._learn(error)
            if abs(error) <= tolerance:
                return None
            self._sense, self._stopped_at, self._pulse = 0.0, None, None
        if self._sense == 0.0:
            if abs(error) <= tolerance and abs(last) == 0.0:
                return self._stop(t, last)
            self._sense = math.copysign(1.0, error)
            self._pulse = abs(error) if abs(error) < 2.0 * limits.slowest * max(self.coast, dt) else None
        left = self._sense * error
        if left < -2.6:  # near half a turn: noise must not swap the side
            left += 2.0 * math.pi
        if self._pulse is not None:
            self._pulse -= abs(last) * dt
            if last != 0.0 and self._pulse < 0.5 * limits.slowest * dt:
                return self._stop(t, last)
        else:
            if not self._learned and last != 0.0:
                self.coast = min(max(FIRST_GUESS, tolerance / abs(last)), LONGEST_COAST)
            if left <= abs(last) * self.coast:
                return self._stop(t, last)
        speed = min(
            max(left, limits.slowest),
            limits.fastest,
            abs(last) + limits.acceleration * dt,
            math.sqrt(2.0 * limits.acceleration * max(left, 0.0)),
        )
        return self._sense * min(max(speed, limits.slowest), limits.fastest)

    def _stop(self, t, last):
        self._stopped_at, self._rate_at_stop = t, 0.0 if self._pulse is not None else last
        return 0.0

    def _rests(self, t, rates, limits):
        if rates.last != 0.0:
            self._stopped_at = t
        waited = t - self._stopped_at
        return waited >= GIVE_UP or (waited >= SETTLE and abs(rates.measured) <= limits.stopped)

    def _learn(self, error):
        """Correct ``coast`` by what the stop missed the heading by."""
        if self._rate_at_stop:
            missed = wrap(error) / self._rate_at_stop
            self.coast = min(max(self.coast - missed, 0.0), LONGEST_COAST)
            self._learned = True
        self._rate_at_stop = 0.0
