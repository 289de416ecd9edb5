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

from ahead_of_time import kernel

STEEPEST = 0.6
"""The steepest heading (rad) towards the path."""


@kernel
def heading(offset, length):
    """Return the heading (rad) against the path's that leads back onto it from an offset (m, left positive); length
    (m): in which errors die out.
    """
    return -max(-STEEPEST, min(STEEPEST, math.atan(offset / (3.0 * length))))


@kernel
def next_curvature(curvature, way, offset, heading_error, bend, change, length, sharpest):
    """Return the curvature (1/m), ``sharpest`` at most, after ``way`` (m) of driving at one now.

    offset (m), heading_error (rad): the robot's; bend (1/m), change (1/m2): curvature of the path there, and its
    change; length (m): as above.
    """
    beside = 1.0 - min(max(bend * offset, -0.5), 0.5)
    wanted = bend * math.cos(heading_error) / beside
    faster = (
        change
        - 3.0 / length * (curvature - wanted)
        - 3.0 / (length * length) * (heading_error - heading(offset, length))
    )
    return max(-sharpest, min(sharpest, curvature + faster * way))


@dataclass(frozen=True)
class TrackingLaw:
    """``length`` (m) in which errors die out; ``time`` (s) times the speed, where that is longer, for the robot answers
    late.
    ``sharpest`` (1/m): curvature beyond that is not asked for.
    """

    length: float
    time: float
    sharpest: float = 4.0

    def reach(self, speed):
        """Return the length (m) at a speed (m/s)."""
        return max(self.length, self.time * abs(speed))

    def heading(self, offset, speed):
        """Return the heading (rad) against the path's that leads back onto it from an offset (m, left positive)."""
        return heading(offset, float(self.reach(speed)))

    def curvature(self, offset, heading_error, path_curvature, speed):
        """Return the curvature (1/m) to set out with from rest, where it may be chosen freely; the errors' own change
        is then a third of what it will be. heading_error (rad), path_curvature (1/m) where the robot is.
        """
        wanted = path_curvature + (self.heading(offset, speed) - heading_error) / self.reach(speed)
        return max(-self.sharpest, min(self.sharpest, wanted))

    def next_curvature(self, curvature, way, offset, heading_error, path, speed):
        """Return what the function ``next_curvature`` does at a speed (m/s); path: (bend, change)."""
        return next_curvature(
            curvature, way, offset, heading_error, *path, float(self.reach(speed)), float(self.sharpest)
        )


def warm():
    """Compile, or load from the cache, the kernels for the types they are called with."""
    next_curvature(0.0, 0.01, 0.0, heading(0.0, 1.0), 0.0, 0.0, 1.0, 4.0)
