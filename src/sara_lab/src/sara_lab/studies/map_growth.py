"""How time and memory of slam_gmapping grow with the way driven: laps of one drive through the school, one after the
other, with a map every map_update_interval, as the node draws it.
"""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Iterator
from typing import NamedTuple

from sara_common.planar import compose, inverse
from sara_lab.studies.map_drives import Drive
from sara_lab.studies.map_trial import scans_of, slam_of

MB = 1024.0  # kB, as getrusage counts


class Grown(NamedTuple):
    """After `way` (m): core s of this process since the laps began and s that the robot has driven; MB that the process
    had at most; key scans; loops.
    """

    way: float
    core_s: float
    driven_s: float
    mb: float
    key_scans: int
    loops: int


def grown(drive: Drive, way: float) -> Iterator[Grown]:
    """The Grown after each lap, until the way (m) is driven."""
    slam, start, begun = slam_of(), (0.0, 0.0, 0.0), time.process_time()
    first, last = tuple(drive.poses[0, 1:4]), tuple(drive.poses[-1, 1:4])
    seconds, drawn, lap = float(drive.stamps[-1] - drive.stamps[0]), -math.inf, 0
    while lap * drive.way < way:
        for scan in scans_of(drive, start=compose(start, inverse(first)), later=lap * (seconds + 1.0)):
            slam.on_scan(scan)
            if scan.sweep.stamp - drawn >= slam.config.map_update_interval:
                slam.map()
                drawn = scan.sweep.stamp
        lap += 1
        start = compose(start, compose(inverse(first), last))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MB
        spent = time.process_time() - begun
        yield Grown(lap * drive.way, spent, lap * seconds, peak, len(slam.scans), slam.counts['loops'])
