"""A laser scan as localization and mapping take it, and what is wrong with one that nobody can use."""

from __future__ import annotations

import math
from typing import NamedTuple

from sara_common.planar import compose, inverse
from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.beams import is_level
from sara_localization.ranges.range_data import FARTHEST

FARTHEST_MOUNT = 100.0
"""m from the robot to a scanner on it."""


class ScanInput(NamedTuple):
    """A scan of the scanner `frame`; base_from_scanner and odom_from_base at its time, that of its first ray; ended:
    odom_from_base at its last ray, None where all rays are of one time.
    """

    frame: str
    sweep: Sweep
    mount: Transform
    odometry: Transform
    ended: Transform | None = None

    @property
    def motion(self) -> tuple[float, float, float] | None:
        """Where the robot is at the last ray, x, y, yaw, m, rad, in its frame at the first."""
        if self.ended is None:
            return None
        first, last = ((*pose.translation[:2], pose.yaw) for pose in (self.odometry, self.ended))
        return compose(inverse(first), last)

    @property
    def fault(self) -> tuple[str, str] | None:
        """(what it counts as, what is wrong) with a scan that nobody can use; None with any other."""
        if self.sweep.fault:
            return 'bad_scan', f'a {self.sweep.fault}'
        poses = (self.odometry,) if self.ended is None else (self.odometry, self.ended)
        places = [number for pose in poses for number in (*pose.translation, *pose.rotation)]
        if not all(math.isfinite(v) and abs(v) <= FARTHEST for v in places):
            return 'bad_odometry', 'the odometry is no pose'
        if not is_level(self.mount):
            return 'bad_mount', 'the scanner does not look along the floor'
        if not max(map(abs, self.mount.translation)) <= FARTHEST_MOUNT:
            return 'bad_mount', f'the scanner is more than {FARTHEST_MOUNT:g} m off the robot'
        return None
