"""The beams of a scan that a measurement model uses, in the robot's frame."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_common.planar import between
from sara_common.scans import Sweep, shares_of
from sara_localization.geometry.rigid import Transform, rotation_matrix

FLATTEST = 0.5
"""Cosine of the tilt from which on a scanner does not look along the floor."""


class Beams(NamedTuple):
    """x, y of the scanner in the robot's frame, m; directions (n,) there, rad; ranges (n,), m; most: the range, m, that
    stands for "no echo".
    """

    x: float
    y: float
    directions: np.ndarray
    ranges: np.ndarray
    most: float

    @property
    def points(self) -> np.ndarray:
        """(n, 2) where the beams end, in the robot's frame, m."""
        return np.stack(
            (
                self.x + self.ranges * np.cos(self.directions),
                self.y + self.ranges * np.sin(self.directions),
            ),
            1,
        )


class BeamChoice(NamedTuple):
    """How many beams at the most; ranges below `least` or from `most` on are not used, each -1 where the scanner's own
    limit stands; silent: beams without an echo are used, too.
    """

    count: int
    least: float = -1.0
    most: float = -1.0
    silent: bool = False


def limits(sweep: Sweep, choice: BeamChoice) -> tuple[float, float]:
    """The least and the greatest range (m) that are used: the narrower of the scanner's and those asked for."""
    least = max(sweep.range_min, choice.least) if choice.least > 0.0 else sweep.range_min
    most = min(sweep.range_max, choice.most) if choice.most > 0.0 else sweep.range_max
    return least, most


def chosen(
    sweep: Sweep, mount: Transform, choice: BeamChoice, motion: tuple[float, float, float] | None = None
) -> Beams:
    """At most `choice.count` beams, spread evenly over those that say something: of a scan that is half empty as many
    are used as of a full one.

    mount: base_from_scanner. A scanner that is upside down or leans is projected onto the floor. No echo is +inf or the
    maximum of the range (REP 117); NaN and what is too near (-inf) say nothing. motion: ScanInput's; beams are then as
    the scanner would have seen their ends from where it was at the first ray.
    """
    least, most = limits(sweep, choice)
    ranges = np.asarray(sweep.ranges, float)
    with np.errstate(invalid='ignore'):
        echo = (ranges > least) & (ranges < most)
        usable = echo | (ranges >= most) if choice.silent else echo
    indices = np.flatnonzero(usable)
    if len(indices) > choice.count:
        indices = indices[np.linspace(0, len(indices) - 1, choice.count).round().astype(int)]
    angles = sweep.angle_min + indices * sweep.angle_increment
    flat = rotation_matrix(mount.rotation)[:2, :2] @ np.stack((np.cos(angles), np.sin(angles)))
    reach = np.minimum(ranges[indices], most)
    reach = np.where(echo[indices], reach * np.hypot(*flat), most)
    beams = Beams(*mount.translation[:2], np.arctan2(flat[1], flat[0]), reach, most)
    if motion is None or not len(indices):
        return beams
    return _from_first(beams, shares_of(indices, len(ranges)), motion, echo[indices])


def _from_first(beams, shares, motion, echo):
    """Beams that were cast while the robot moved, as seen from where the first was; without an echo they stay so."""
    x, y, yaw = between((0.0, 0.0, 0.0), motion, shares)
    (across, along), c, s = beams.points.T, np.cos(yaw), np.sin(yaw)
    x, y = x + c * across - s * along - beams.x, y + s * across + c * along - beams.y
    ranges = np.where(echo, np.minimum(np.hypot(x, y), np.nextafter(beams.most, 0.0)), beams.most)
    return beams._replace(directions=np.arctan2(y, x), ranges=ranges)


def is_level(mount: Transform) -> bool:
    """Whether a scanner looks along the floor, upright or upside down."""
    return abs(rotation_matrix(mount.rotation)[2, 2]) >= FLATTEST and all(map(math.isfinite, mount.translation))
