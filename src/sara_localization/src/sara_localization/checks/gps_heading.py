"""Whether an IMU's heading is the way the GPS says that the robot went: what navsat_transform_node needs of it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_localization.checks.findings import Finding, error, warning

STRETCH, LONGEST = 5.0, 20.0
"""m between two places that tell a direction, and s within which they must be."""
STRAIGHT = math.radians(15.0)
"""How far the heading may wander on a stretch."""
FEWEST = 5
_OFF, _WIDE = math.radians(20.0), math.radians(20.0)
_QUARTER = math.pi / 2.0
_AGREE, _DISAGREE = 0.9, 0.7
"""Mean lengths of the unit vectors of angles that are alike, and that are not."""


class Stretches(NamedTuple):
    """Straight stretches of a drive: their directions by the GPS and the headings on them, (n,) rad."""

    courses: np.ndarray
    headings: np.ndarray

    @property
    def differences(self) -> np.ndarray:
        """(n,) rad by which the direction exceeds the heading."""
        return np.angle(np.exp(1j * (self.courses - self.headings)))

    @property
    def median(self) -> float:
        """Of the differences, rad; about their mean, so that angles near 180 deg do not cancel."""
        return self._quantile(0.5)

    @property
    def quartiles(self) -> tuple[float, float]:
        """Between which half of the differences are, rad."""
        return self._quantile(0.25), self._quantile(0.75)

    @property
    def spread(self) -> float:
        """Between the quartiles, rad, from 0 to a whole turn."""
        low, high = np.quantile(self._away[1], (0.25, 0.75))
        return float(high - low)

    @property
    def _away(self):
        """The mean direction of the differences, and (n,) how far each is from it, rad."""
        middle = np.angle(np.exp(1j * self.differences).mean())
        return middle, np.angle(np.exp(1j * (self.differences - middle)))

    def _quantile(self, share):
        middle, away = self._away
        return float(math.remainder(middle + np.quantile(away, share), 2.0 * math.pi))

    @property
    def clockwise(self) -> bool:
        """Whether the heading grows clockwise: the directions agree with its mirror image alone."""
        mirrored = abs(np.exp(1j * (self.courses + self.headings)).mean())
        return mirrored > _AGREE and abs(np.exp(1j * (self.courses - self.headings)).mean()) < _DISAGREE


def stretches(places: np.ndarray, headings: np.ndarray) -> Stretches:
    """The straight stretches of a drive; places: (n, 3) t, x, y; headings: (m, 2) t, yaw; both by time (s, m, rad)."""
    found, first = [], 0
    for last in range(len(places)):
        while places[last, 0] - places[first, 0] > LONGEST:
            first += 1
        step = places[last, 1:] - places[first, 1:]
        if math.hypot(*step) < STRETCH:
            continue
        inside = (headings[:, 0] >= places[first, 0]) & (headings[:, 0] <= places[last, 0])
        turns = np.exp(1j * headings[inside, 1])
        if len(turns):
            middle = np.angle(turns.mean())
            if np.abs(np.angle(turns * np.exp(-1j * middle))).max() <= STRAIGHT:
                found.append((math.atan2(step[1], step[0]), middle))
        first = last
    return Stretches(*np.reshape(found, (-1, 2)).T)


def heading_findings(drive: Stretches, yaw_offset: float) -> list[Finding]:
    """What is wrong with the headings, which hold a yaw_offset (rad) already."""
    count = len(drive.courses)
    if count < FEWEST:
        sentence = (
            f'the bag holds {count} straight stretches of {STRETCH:g} m, too few to judge the heading by the GPS.'
        )
        return [warning('heading', sentence)]
    if drive.clockwise:
        return [
            error(
                'heading',
                'the heading of the IMU grows clockwise, against the way the GPS went: its driver must turn it '
                'counter-clockwise (ENU, REP-103).',
            )
        ]
    low, high = drive.quartiles
    told = (
        f'the robot went {math.degrees(drive.median):.1f} deg counter-clockwise of its heading (median of {count} '
        f'straight stretches, half of them from {math.degrees(low):.1f} to {math.degrees(high):.1f})'
    )
    if drive.spread > _QUARTER:
        return [
            error(
                'heading',
                f'{told}: the heading does not follow the way. Does the IMU measure it at all? Take its yaw out of the '
                'filter, and give navsat_transform_node a datum.',
            )
        ]
    if abs(drive.median) > _OFF:
        wanted = math.remainder(yaw_offset + drive.median, 2.0 * math.pi)
        quarters = round(wanted / _QUARTER) * _QUARTER
        wanted = quarters if abs(wanted - quarters) <= _OFF else wanted
        return [error('yaw_offset', f'{told}: set yaw_offset to {wanted:.7g}, unless it drove backwards.')]
    if drive.spread > _WIDE:
        return [
            warning(
                'heading',
                f'{told}: the heading depends on where the robot is or faces, as near iron. Give the filter the rate '
                'of the IMU, not its yaw, and yaw an initial variance of 0.1.',
            )
        ]
    return []
