"""How to bend back onto a path: how the curvature that is driven is to change, so that all errors die out in path length.

In the path's length s the offset e, the heading error h and the error k of the curvature obey e' = sin h, h' = k, and the robot chooses k'
(Samson 1995, Control of chained systems; Kanayama et al. 1990, A stable tracking control method). With
k' = -3/l k - 3/l^2 (h + atan(e / 3l)) all three die out as exp(-s/l), without overshooting, at every speed alike; far off it heads for the
path by no more than STEEPEST. Choosing the change, not the curvature, keeps the turn rate's acceleration small by itself: what limits it
afterwards would delay it, and a delay makes it weave.
"""
import math
from dataclasses import dataclass

STEEPEST = 0.6
"""The steepest heading (rad) towards the path."""


@dataclass(frozen=True)
class TrackingLaw:
    """``length`` (m) in which errors die out; ``time`` (s) times the speed, where that is longer, for the robot answers late.
    ``sharpest`` (1/m): curvature beyond that is not asked for."""

    length: float
    time: float
    sharpest: float = 4.0

    def reach(self, speed):
        """Return the length (m) at a speed (m/s)."""
        return max(self.length, self.time * abs(speed))

    def heading(self, offset, speed):
        """Return the heading (rad) against the path's that leads back onto it from an offset (m, left positive)."""
        return -max(-STEEPEST, min(STEEPEST, math.atan(offset / (3.0 * self.reach(speed)))))

    def curvature(self, offset, heading_error, path_curvature, speed):
        """Return the curvature (1/m) to set out with from rest, where it may be chosen freely; the errors' own change is then a third
        of what it will be. heading_error (rad), path_curvature (1/m) where the robot is."""
        return self._held(path_curvature + (self.heading(offset, speed) - heading_error) / self.reach(speed))

    def next_curvature(self, curvature, way, offset, heading_error, path, speed):
        """Return the curvature (1/m) after ``way`` (m) of driving at one now.

        path: (curvature 1/m, its change 1/m2) of the path where the robot is; offset, heading_error: the robot's there (m, rad).
        """
        length = self.reach(speed)
        beside = 1.0 - min(max(path[0] * offset, -0.5), 0.5)
        wanted = path[0] * math.cos(heading_error) / beside
        change = path[1] - 3.0 / length * (curvature - wanted) - 3.0 / length ** 2 * (heading_error - self.heading(offset, speed))
        return self._held(curvature + change * way)

    def _held(self, curvature):
        return max(-self.sharpest, min(self.sharpest, curvature))
