"""Odometry that jumps: its node was started anew, or somebody has reset it."""

from __future__ import annotations

import math

from sara_common.planar import wrap

FASTEST, SLACK = 3.0, 1.0
"""m/s and rad/s, m and rad: nothing moves more between two scans."""
UNKNOWN_SIGMA = 0.3, 0.2
"""m and rad; standard deviations of a motion that the odometry does not tell."""


class OdometryWatch:
    """longest_gap: s; a longer time between two scans allows no more motion than this."""

    def __init__(self, longest_gap: float = math.inf):
        self._longest_gap = longest_gap
        self._seen: tuple[float, tuple[float, float, float]] | None = None

    def jump(self, stamp: float, odometry: tuple[float, float, float]) -> str:
        """What is wrong with the odometry (x, y, yaw) at the time (s) of a scan, after that of the scan before, in
        words; '' where the robot may have moved so.
        """
        before, self._seen = self._seen, (stamp, odometry)
        if before is None:
            return ''
        most = SLACK + FASTEST * min(abs(stamp - before[0]), self._longest_gap)
        way, turn = math.dist(odometry[:2], before[1][:2]), abs(float(wrap(odometry[2] - before[1][2])))
        return f'the odometry jumps by {way:.3g} m and {turn:.3g} rad' if max(way, turn) > most else ''
