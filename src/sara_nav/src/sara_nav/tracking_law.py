"""How much to bend towards a path: the curvature of the path itself, and a correction that brings the robot back onto it.

In the path's length the offset e and the heading error h obey e' = sin h, h' = curvature - path's (Samson 1995, Control of chained
systems; Kanayama et al. 1990, A stable tracking control method). With  -(2/l) (h + atan(e / 2l))  both die out as exp(-s/l) (1 + s/l),
critically damped, at every speed alike; far off it turns towards the path by no more than STEEPEST.
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
        return -max(-STEEPEST, min(STEEPEST, math.atan(offset / (2.0 * self.reach(speed)))))

    def curvature(self, offset, heading_error, path_curvature, speed):
        """Return the curvature (1/m) to drive; heading_error (rad), path_curvature (1/m) where the robot is."""
        beside = 1.0 - min(max(path_curvature * offset, -0.5), 0.5)
        ahead = path_curvature * math.cos(heading_error) / beside
        back = 2.0 / self.reach(speed) * (self.heading(offset, speed) - heading_error)
        return max(-self.sharpest, min(self.sharpest, ahead + back))

