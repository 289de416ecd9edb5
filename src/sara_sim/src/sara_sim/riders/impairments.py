"""What gets between a rider's wish and the stick: each takes a Rider and is one.

Tremor of 3 to 6 Hz, jerks, a slow reaction, a side that is neglected, and four switches instead of a stick. All luck is
drawn from a seed, so that a seed and the same poses give the same stick.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sara_sim.riders.stick import CENTRED, Delayed, Rider, Stick

WAVES = 3  # of different frequencies, on each axis: so many make a tremor that swells and fades
PUSHED = 0.1  # of full deflection: less is not asked for


class Impairment:
    """A rider whose stick is another's, changed."""

    def __init__(self, rider: Rider) -> None:
        self._rider = rider

    @property
    def arrived(self) -> bool:
        """See Rider."""
        return self._rider.arrived

    def stick(self, t: float, pose: Sequence[float]) -> Stick:
        """See Rider."""
        wanted = self._rider.stick(t, pose)
        return CENTRED if self.arrived else self._changed(t, wanted)

    def _changed(self, t, wanted):
        """The Stick at t (s) of somebody who wants another."""
        raise NotImplementedError


class Tremor(Impairment):
    """A hand that shakes while it holds the stick. size: of full deflection, at most. band: Hz."""

    def __init__(self, rider: Rider, seed: int, size: float = 0.6, band: tuple[float, float] = (3.0, 6.0)) -> None:
        super().__init__(rider)
        random = np.random.default_rng([seed, 1])
        self._rates = 2.0 * math.pi * random.uniform(*band, (2, WAVES))
        self._phases = random.uniform(0.0, 2.0 * math.pi, (2, WAVES))
        self._size = size / WAVES

    def _changed(self, t, wanted):
        if wanted == CENTRED:
            return CENTRED
        left, forward = self._size * np.sin(self._rates * t + self._phases).sum(axis=1)
        return Stick.within(wanted.left + float(left), wanted.forward + float(forward))


class Jerks(Impairment):
    """Sudden pushes of the stick in any direction. every: s between two on average. lasts: s. size: of full
    deflection.
    """

    def __init__(self, rider: Rider, seed: int, every: float = 3.0, lasts: float = 0.4, size: float = 1.2) -> None:
        super().__init__(rider)
        self._random = np.random.default_rng([seed, 2])
        self._every, self._lasts, self._size = every, lasts, size
        self._begin, self._push = None, CENTRED

    def _draw(self, after):
        """The next push begins some time after another."""
        self._begin = after + float(self._random.exponential(self._every))
        angle = float(self._random.uniform(-math.pi, math.pi))
        self._push = Stick(self._size * math.sin(angle), self._size * math.cos(angle))

    def _changed(self, t, wanted):
        if self._begin is None:
            self._draw(t)
        while t >= self._begin + self._lasts:
            self._draw(self._begin + self._lasts)
        if t < self._begin:
            return wanted
        return Stick.within(wanted.left + self._push.left, wanted.forward + self._push.forward)


class Late(Impairment):
    """Does what was wanted `delay` s ago."""

    def __init__(self, rider: Rider, delay: float = 0.4) -> None:
        super().__init__(rider)
        self._wanted = Delayed(delay)

    def _changed(self, t, wanted):
        return self._wanted.pass_on(t, wanted, until_then=CENTRED)


class OneSided(Impairment):
    """Neglects one side: drifts to it all the time, and turns away from it less than there is need for, since nothing
    is seen there. side: 1 to neglect the left, -1 the right; 0: drawn. bias: of full deflection, while moving. seen:
    share of turning away from that side that is done.
    """

    def __init__(self, rider: Rider, seed: int, side: int = 0, bias: float = 0.18, seen: float = 0.7) -> None:
        super().__init__(rider)
        self.side = side or (1 if np.random.default_rng([seed, 3]).random() < 0.5 else -1)
        self._bias, self._seen = bias, seen

    def _changed(self, t, wanted):
        if wanted.forward <= PUSHED:  # turning in place, backing off, or at rest
            return wanted
        left = wanted.left if wanted.left * self.side > 0.0 else self._seen * wanted.left
        return Stick.within(left + self.side * self._bias, wanted.forward)


class FourDirections(Impairment):
    """Has four switches, or a straw to sip and puff: ahead, back, left or right, one at a time, and decides once in a
    `period` (s). drive, turn: what a switch counts as, of full deflection. turns_from: of full deflection, from which
    turn wanted on it is turned first.
    """

    def __init__(
        self, rider: Rider, period: float = 1.0, drive: float = 0.7, turn: float = 0.6, turns_from: float = 0.3
    ) -> None:
        super().__init__(rider)
        self._period, self._drive, self._turn, self._turns_from = period, drive, turn, turns_from
        self._next, self._held = -math.inf, CENTRED

    def _changed(self, t, wanted):
        if t >= self._next - 1e-9:
            self._next, self._held = t + self._period, self._decide(wanted)
        return self._held

    def _decide(self, wanted):
        if abs(wanted.left) >= self._turns_from:
            return Stick(math.copysign(self._turn, wanted.left), 0.0)
        if abs(wanted.forward) > PUSHED:
            return Stick(0.0, math.copysign(self._drive, wanted.forward))
        return CENTRED
