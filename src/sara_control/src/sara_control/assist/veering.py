"""Riders with a switch for each direction, pressed one at a time: who turns on the way veers, where room is short.

So drive chairs that are steered by sip and puff, whose command to drive is latched while they are steered.
"""

from __future__ import annotations

import math

SHARE = 0.6
"""Of the turn rate asked for that a robot veers with: a switch is pressed for longer than a small bend needs."""
SLOW = 0.04
"""m/s; a wish for less is one to turn in place."""


class Veering:
    """Remembers how a rider drove."""

    def __init__(self) -> None:
        self.stop()

    def stop(self) -> None:
        """The rider commands no more."""
        self._v, self._at = 0.0, -math.inf

    def wish(self, t: float, v: float, w: float, lasts: float) -> tuple[float, float]:
        """What (v m/s, w rad/s) means, asked for at t (s): a turn in place within `lasts` s of driving is a bend."""
        if abs(v) >= SLOW:
            self._v, self._at = v, t
        elif w != 0.0 and 0.0 <= t - self._at <= lasts:
            return self._v, SHARE * w
        return v, w
