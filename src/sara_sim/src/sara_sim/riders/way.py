"""A way across a floor, to be followed."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sara_common.repeatable import directions

SPACING = 0.05  # m between the points that are kept
SEARCHED = 1.0  # m of way ahead among which the nearest point is looked for


class Way:
    """A line through points (x, y), m. `reached`: m of it that lie behind, which never grows less. `length`: m."""

    def __init__(self, points: Sequence[tuple[float, float]]) -> None:
        corners = np.array(points, float)
        steps = np.hypot(*np.diff(corners, axis=0).T)
        if len(corners) < 2 or not steps.all():
            raise ValueError(f'a way has two points or more, each another than the one before: {points!r}')
        ends = np.concatenate([[0.0], steps.cumsum()])
        self.length, self.reached = float(ends[-1]), 0.0
        self._s = np.append(np.arange(0.0, self.length, SPACING), self.length)
        self.points = np.column_stack([np.interp(self._s, ends, column) for column in corners.T])
        self._headings = np.unwrap(directions(np.gradient(self.points, axis=0)))

    def go_on(self, x: float, y: float) -> None:
        """Somebody is at (x, y), m: the nearest place within SEARCHED ahead is reached."""
        first = int(np.searchsorted(self._s, self.reached))
        last = int(np.searchsorted(self._s, self.reached + SEARCHED, 'right'))
        away = np.hypot(*(self.points[first:last] - (x, y)).T)
        self.reached = float(self._s[first + int(away.argmin())])

    def at(self, ahead: float) -> tuple[float, float]:
        """The place so far ahead of what is reached, m; the end, where that is nearer."""
        s = min(self.reached + ahead, self.length)
        return tuple(float(np.interp(s, self._s, column)) for column in self.points.T)

    def bend(self, ahead: float) -> float:
        """How much the way turns within so many m ahead, rad, to and fro added up."""
        first, last = np.searchsorted(self._s, (self.reached, self.reached + ahead))
        return float(np.abs(np.diff(self._headings[first : last + 1])).sum())

    @property
    def left(self) -> float:
        """m to the end."""
        return self.length - self.reached


def rounded(points: Sequence[tuple[float, float]], radius: float) -> list[tuple[float, float]]:
    """A line through points (x, y; m) whose corners are cut by curves that begin `radius` (m) before each, or in the
    middle of what is between two of them.
    """
    corners = np.array(points, float)
    found = [corners[0]]
    for before, here, after in zip(corners, corners[1:], corners[2:]):
        sides = []
        for other in (before, after):
            far = math.dist(here, other)
            sides.append(here + (other - here) * min(radius, 0.5 * far) / far)
        share = np.linspace(0.0, 1.0, 9)[:, None]
        found += list((1 - share) ** 2 * sides[0] + 2 * share * (1 - share) * here + share**2 * sides[1])
    found.append(corners[-1])
    kept = [found[0]]
    for point in found[1:]:
        if math.dist(point, kept[-1]) > 1e-6:
            kept.append(point)
    return [tuple(map(float, point)) for point in kept]
