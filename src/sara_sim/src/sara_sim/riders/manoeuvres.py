"""Riders who back up, turn in place, hold the stick, and do one thing after the other."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sara_common.planar import wrap
from sara_sim.riders.driving import GENTLE, Manner
from sara_sim.riders.impairments import Impairment
from sara_sim.riders.stick import CENTRED, Delayed, Rider, Stick

FACED = 0.05  # rad off the wanted heading: so near it they let go
EARLY = 0.3  # s that a turn in place goes on after the stick was centred, as the rider knows it
PAUSE = 1.0  # s between two manoeuvres, in which the chair comes to rest


class Holder:
    """Holds the stick as it is."""

    arrived = False

    def __init__(self, stick: Stick) -> None:
        self._stick = stick

    def stick(self, _t: float, _pose: object) -> Stick:
        """See Rider."""
        return self._stick


class Astern(Impairment):
    """Drives backwards as `rider` would drive forwards whose front were the chair's rear."""

    def stick(self, t: float, pose: Sequence[float]) -> Stick:
        """See Rider."""
        wanted = self._rider.stick(t, (pose[0], pose[1], wrap(pose[2] + math.pi)))
        return Stick(wanted.left, -wanted.forward)


class Turner:
    """Turns in place to the heading `yaw` (rad), the short way. manner: Manner."""

    def __init__(self, yaw: float, manner: Manner = Manner()) -> None:
        self._yaw, self._manner, self.arrived = yaw, manner, False
        self._seen, self._first, self._before = Delayed(manner.reaction), None, None

    def stick(self, t: float, pose: Sequence[float]) -> Stick:
        """See Rider."""
        self._first = self._first or (t, pose[2])
        seen_at, yaw = self._seen.pass_on(t, (t, pose[2]), until_then=self._first)
        before, self._before = self._before or (seen_at, yaw), (seen_at, yaw)
        rate = wrap(yaw - before[1]) / (seen_at - before[0]) if seen_at > before[0] else 0.0
        off = wrap(self._yaw - yaw)
        left = wrap(off - rate * (self._manner.reaction + EARLY))
        if abs(off) > math.pi - FACED:  # straight behind: either way is the short one
            left = off
        self.arrived = self.arrived or abs(left) < FACED
        if self.arrived:
            return CENTRED
        return Stick(math.copysign(self._manner.turning * min(1.0, GENTLE + abs(left)), left), 0.0)


class InTurn:
    """Does what several riders do, one after the other, with a PAUSE between."""

    def __init__(self, riders: Sequence[Rider]) -> None:
        self._riders, self._since, self.arrived = list(riders), None, False

    def stick(self, t: float, pose: Sequence[float]) -> Stick:
        """See Rider."""
        if self._since is not None and t - self._since < PAUSE:
            return CENTRED
        while self._riders:
            wanted = self._riders[0].stick(t, pose)
            if not self._riders[0].arrived:
                return wanted
            del self._riders[0]
            if self._riders:
                self._since = t
                return CENTRED
        self.arrived = True
        return CENTRED
