"""Laser scans as plain data (sara_common.scans)."""

from __future__ import annotations

import numpy as np
from sensor_msgs.msg import LaserScan

from sara_common.scans import Sweep


def sweep_of(scan: LaserScan) -> Sweep:
    """A Sweep of the message."""
    angles = scan.angle_min, scan.angle_max, scan.angle_increment
    stamp, ranges = scan.header.stamp.to_sec(), np.array(scan.ranges, float)
    return Sweep(stamp, *angles, scan.time_increment, scan.range_min, scan.range_max, ranges)
