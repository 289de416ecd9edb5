"""How to bend back onto a path: how the curvature that is driven is to change, so that all errors die out in path
length.

In the path's length s the offset e, the heading error h and the error k of the curvature obey e' = sin h, h' = k, and
the robot chooses k' (Samson 1995, Control of chained systems; Kanayama et al. 1990, A stable tracking control method).
With k' = -3/l k - 3/l^2 (h + atan(e / 3l)) all three die out as exp(-s/l), without overshooting, at every speed alike;
far off it heads for the path by no more than STEEPEST. Choosing the change, not the curvature, keeps the turn rate's
acceleration small by itself: what limits it afterwards would delay it, and a delay makes it weave. Compiled, for a look
at the way to rest takes it dozens of times a cycle.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ahead_of_time import kernel

STEEPEST = 0.6
"""The steepest heading (rad) towards the path."""


class Deviation(NamedTuple):
    """How far a robot is off its path: offset (m, left positive) and heading less the path's (rad)."""

    offset: float
    heading: float


class Bend(NamedTuple):
    """A path's curvature (1/m) where the robot is, and its change (1/m2)."""

    curvature: float
    change: float


@kernel
def heading(offset: float, length: float) -> float:
    """Return the heading (rad) against the path's that leads back onto it from an offset (m, left positive); length
    (m): in which errors die out.
    """
    return -max(-STEEPEST, min(STEEPEST, math.atan(offset / (3.0 * length))))


@kernel
def next_curvature(curvature: float, distance: float, off: Deviation, bend: Bend, law: tuple[float, float]) -> float:
    """Return the curvature (1/m) after a distance (m) of driving at one now.

    off: a Deviation. bend: a Bend. law: (length m as above, sharpest 1/m, which the curvature keeps to).
    """
    length, sharpest = law
    beside = 1.0 - min(max(bend.curvature * off.offset, -0.5), 0.5)
    wanted = bend.curvature * math.cos(off.heading) / beside
    faster = (
        bend.change
        - 3.0 / length * (curvature - wanted)
        - 3.0 / (length * length) * (off.heading - heading(off.offset, length))
    )
    return max(-sharpest, min(sharpest, curvature + faster * distance))


@dataclass(frozen=True)
class TrackingLaw:
    """``length`` (m) in which errors die out; ``time`` (s) times the speed, where that is longer, for the robot answers
    late. ``sharpest`` (1/m): curvature beyond that is not asked for.
    """

    length: float
    time: float
    sharpest: float = 4.0

    def reach(self, speed: float) -> float:
        """Return the length (m) at a speed (m/s)."""
        return max(self.length, self.time * abs(speed))

    def at(self, speed: float) -> tuple[float, float]:
        """Return (length, sharpest) for ``next_curvature`` at a speed (m/s)."""
        return float(self.reach(speed)), float(self.sharpest)

    def heading(self, offset: float, speed: float) -> float:
        """Return the heading (rad) against the path's that leads back onto it from an offset (m, left positive)."""
        return heading(offset, float(self.reach(speed)))

    def curvature(self, off: Deviation, bend: Bend, speed: float) -> float:
        """Return the curvature (1/m) to set out with from rest, where it may be chosen freely; the errors' own change
        is then a third of what it will be.
        """
        wanted = bend.curvature + (self.heading(off.offset, speed) - off.heading) / self.reach(speed)
        return max(-self.sharpest, min(self.sharpest, wanted))

    def next_curvature(self, curvature: float, distance: float, off: Deviation, bend: Bend, speed: float) -> float:
        """Return the curvature (1/m) after a distance (m) of driving at one now, at a speed (m/s)."""
        return next_curvature(curvature, distance, off, bend, self.at(speed))


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    next_curvature(0.0, 0.01, Deviation(0.0, heading(0.0, 1.0)), Bend(0.0, 0.0), (1.0, 4.0))
