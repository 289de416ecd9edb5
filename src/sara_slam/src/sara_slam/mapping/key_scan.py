"""What is kept of a scan: where its rays end, in the robot's frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sara_localization.particles.beams import BeamChoice, chosen
from sara_localization.particles.scan_input import ScanInput
from sara_slam.matching.surfaces import Surfaces, surfaces_of

EVERY = 1_000_000
"""More beams than a scan has."""
FARTHEST = 250.0
"""m: an echo from further off is none; no scanner sees so far indoors, and the map would not fit into memory."""


class RangeLimits(NamedTuple):
    """m. usable: an echo from further off is no echo, though its ray is clear that far; greatest: a range from here on
    says nothing. 0: the scanner's own limit.
    """

    usable: float = 0.0
    greatest: float = 0.0


class KeyScan(NamedTuple):
    """stamp, s; odometry: the robot's pose (x, y, yaw) by it; origin: the scanner in the robot's frame, m; ends (n, 2),
    float32, of its rays there; echo (n,): which of them end at something.
    """

    stamp: float
    odometry: tuple[float, float, float]
    origin: tuple[float, float]
    ends: np.ndarray
    echo: np.ndarray

    def points(self, every: int = 1) -> np.ndarray:
        """(m, 2) of every n-th echo, m, in the robot's frame."""
        return self.ends[self.echo][::every].astype(float)

    def surfaces(self) -> Surfaces:
        """What it saw of surfaces, in the robot's frame."""
        return surfaces_of(self.points()).seen_from(self.origin)


def key_scan(scan: ScanInput, limits: RangeLimits) -> KeyScan:
    """The KeyScan of a scan, in the robot's frame as it was at the scan's stamp. Where the robot's pose at the last ray
    is known, each ray ends where it did at its own time, the motion being even in between.

    No echo is the scanner's greatest range or +inf (REP 117). It says nothing, as in gmapping, unless `limits.greatest`
    is beyond the scanner's own limit: then such a ray is clear as far as ranges are usable.
    """
    sweep = scan.sweep
    greatest = limits.greatest or sweep.range_max
    ranges = np.array(sweep.ranges, float)
    if greatest <= sweep.range_max:
        with np.errstate(invalid='ignore'):
            ranges[ranges >= greatest] = np.nan
    usable = min(limits.usable or greatest, greatest, FARTHEST)
    beams = chosen(sweep._replace(ranges=ranges), scan.mount, BeamChoice(EVERY, most=usable, silent=True), scan.motion)
    odometry = (*scan.odometry.translation[:2], scan.odometry.yaw)
    origin = float(beams.x), float(beams.y)
    return KeyScan(sweep.stamp, odometry, origin, beams.points.astype(np.float32), beams.ranges < beams.most)
