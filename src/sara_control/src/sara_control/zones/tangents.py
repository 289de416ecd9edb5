"""The line that ranges tell of: what is flat touches the circles about the places where a sensor measured them (J.
Leonard, H. Durrant-Whyte, Directed sonar sensing for mobile robot navigation, 1992).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

ITERATIONS = 4  # of the fit, which converges by the square
LEAST = 1e-6  # m2: the sum of squares along the line by which circles tell its angle


class Line(NamedTuple):
    """cos(normal) x + sin(normal) y = away; normal, rad: towards it from where it was measured."""

    normal: float
    away: float

    def distance(self, x: float, y: float) -> float:
        """m from a place to the line."""
        return self.away - math.cos(self.normal) * x - math.sin(self.normal) * y


class Tangent(NamedTuple):
    """A Line, and how far (m) each circle was off it before the last step of the fit."""

    line: Line
    off: list[float]


def tangent(circles: Sequence[tuple[float, float, float]], normal: float) -> Tangent | None:
    """The line beyond circles (x, y, radius; m) that touches them best, by least squares from a normal (rad) on; None
    where they do not tell its angle.
    """
    n = len(circles)
    x, y, r = (sum(circle[k] for circle in circles) / n for k in range(3))
    for _ in range(ITERATIONS):
        c, s = math.cos(normal), math.sin(normal)
        off = [(r - q[2]) + c * (x - q[0]) + s * (y - q[1]) for q in circles]
        slopes = [c * (y - q[1]) - s * (x - q[0]) for q in circles]
        weight = sum(slope * slope for slope in slopes)
        if weight < LEAST:
            return None
        normal -= sum(a * b for a, b in zip(off, slopes)) / weight
    return Tangent(Line(normal, r + math.cos(normal) * x + math.sin(normal) * y), off)
