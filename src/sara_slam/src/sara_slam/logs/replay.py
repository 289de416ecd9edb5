"""A recorded log put through Slam: the pose at each of its records."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from sara_common.planar import compose, inverse
from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_slam.logs.records import Record
from sara_slam.logs.relations import Track
from sara_slam.mapping.slam import Slam

LEAST_RANGE = 0.1
"""m; nearer ranges say nothing."""


def sweep_of(record: Record, range_max: float) -> Sweep:
    """A CARMEN log's scan: n ranges over half a turn, the first to the right; range_max: m from which on no echo."""
    count = len(record.ranges)
    step = math.pi / count if count > 181 else math.pi / 180.0
    first = -0.5 * math.pi
    return Sweep(record.stamp, first, first + step * (count - 1), step, 0.0, LEAST_RANGE, range_max, record.ranges)


class Replay:
    """`slam`: a new Slam. range_max: m, of the log's scanner."""

    def __init__(self, slam: Slam, range_max: float = 80.0):
        self.slam, self._range_max = slam, range_max
        self._keys: list[int] = []  # numbers of the records that became key scans

    def run(self, records: Sequence[Record], progress: Callable[[Iterable], Iterable] = iter) -> Track:
        """Put all records through; returns the track of all of them, odometry and scans."""
        for number, record in progress(list(enumerate(records))):
            if record.ranges is not None:
                place = Transform.from_xyz_rpy(*record.pose[:2], 0.0, 0.0, 0.0, record.pose[2])
                scan = ScanInput('laser', sweep_of(record, self._range_max), Transform(), place)
                result = self.slam.on_scan(scan)
                if result is not None and result.used:
                    self._keys.append(number)
        self.slam.finish()
        return Track.of(np.array([record.stamp for record in records]), self.poses(records))

    def poses(self, records: Sequence[Record]) -> np.ndarray:
        """(n, 3) the pose at each record: that of the key scan before, moved on by the odometry. What this misses the
        next key scan by is spread over the steps by how far each moves and turns.
        """
        keys, found = self._keys, np.array([record.pose for record in records], float)
        effort = _effort(records)
        for k, key in enumerate(keys):
            begin, end = (key if k else 0), (keys[k + 1] if k + 1 < len(keys) else len(records))
            offset = compose(self.slam.poses[k], inverse(records[key].pose))
            missed = (0.0, 0.0, 0.0)
            if end < len(records):
                missed = compose(inverse(compose(offset, records[end].pose)), self.slam.poses[k + 1])
            for number in range(begin, end):
                share = 0.0
                if number > key and end < len(records):
                    share = (effort[number] - effort[key]) / max(effort[end] - effort[key], 1e-12)
                step = tuple(share * part for part in missed)
                found[number] = compose(compose(offset, records[number].pose), step)
        return found


def _effort(records):
    """(n,) metres moved plus radians turned up to each record."""
    steps = [compose(inverse(one.pose), two.pose) for one, two in zip(records, records[1:])]
    return np.concatenate(([0.0], np.cumsum([math.hypot(x, y) + abs(turn) + 1e-9 for x, y, turn in steps])))
