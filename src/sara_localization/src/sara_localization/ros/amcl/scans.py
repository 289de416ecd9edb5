"""Scans of several scanners that wait until tf knows where the robot was."""

from __future__ import annotations

from bisect import insort
from collections.abc import Callable
from typing import NamedTuple

from sensor_msgs.msg import LaserScan

from sara_common.ros.scans import sweep_of
from sara_localization.particles.scan_input import ScanInput
from sara_localization.ros import conversions
from sara_localization.ros.tf2_transforms import Tf2Transforms

MOST_WAITING = 100
"""Scans of a scanner; more push the oldest out."""
PATIENCE = 1.0
"""s that a scan may wait before that is told."""


LONGEST_SWEEP = 1.0
"""s from a scan's first ray to its last; no scanner takes longer, and nobody waits for one that says so."""


class _Waiting(NamedTuple):
    """A scan of a stamp (s), the `number`-th that came, at a time (s)."""

    stamp: float
    number: int
    came: float
    msg: LaserScan


class WaitingScans:
    """`lost`: called with a sentence for each scan that is dropped. `last`: when the newest came (s), None before the
    first. The scans of a frame wait in the order of their stamps: one from the future keeps no other waiting.
    """

    def __init__(self, transforms: Tf2Transforms, lost: Callable[[str], None]):
        self._transforms, self._lost = transforms, lost
        self._waiting, self._count, self._number = {}, 0, 0
        self._frames, self._used = ('', ''), {}  # numbers of the newest used, by frame
        self.last: float | None = None

    def __bool__(self) -> bool:
        return self._count > 0  # asked by threads that do not hold the node's lock

    def add(self, msg: LaserScan, now: float) -> bool:
        """One more, at a time (s); the mount of each scan is looked up for its own time. True where the clock has gone
        back since the last one: then those before are dropped.
        """
        went_back = self.last is not None and now < self.last
        if went_back:
            self._waiting.clear()
            self._count = 0
        self.last = now
        frame = msg.header.frame_id.lstrip('/')
        queue = self._waiting.setdefault(frame, [])
        if len(queue) == MOST_WAITING:
            queue.remove(min(queue, key=lambda scan: scan.number))
            self._lost(f'scans from the frame "{frame}" are dropped: {self._why(frame)}')
        else:
            self._count += 1
        self._number += 1
        insort(queue, _Waiting(conversions.seconds(msg.header.stamp), self._number, now, msg))
        return went_back

    def ready(self, odom: str, base: str) -> list[ScanInput]:
        """Those whose transforms are known by now, oldest first for each scanner. odom, base: the odometry's and the
        robot's frame.
        """
        self._frames = odom, base
        found = []
        for frame, queue in self._waiting.items():
            while queue:
                stamp, number, _, msg = queue[0]
                scan = self._with_transforms(frame, stamp, msg)
                if scan is not None:
                    found.append(scan)
                    self._used[frame] = max(number, self._used.get(frame, 0))
                elif self._is_too_old(frame, stamp):
                    self._lost(f'a scan from the frame "{frame}" is older than what tf remembers: dropped')
                else:
                    break
                del queue[0]
                self._count -= 1
        return sorted(found, key=lambda scan: scan.sweep.stamp)

    def _with_transforms(self, frame, stamp, msg):
        odom, base = self._frames
        odometry = self._transforms.lookup_at(odom, base, stamp)
        mount = self._transforms.lookup_at(base, frame, stamp) if frame and odometry is not None else None
        if mount is None:
            return None
        sweep, ended = sweep_of(msg)._replace(stamp=stamp), None
        if 0.0 < sweep.duration <= LONGEST_SWEEP:
            ended = self._transforms.lookup_at(odom, base, stamp + sweep.duration)
            if ended is None:
                return None
        return ScanInput(frame, sweep, mount, odometry, ended)

    def _is_too_old(self, frame, stamp):
        odom, base = self._frames
        pairs = ((odom, base), (base, frame)) if frame else ((odom, base),)
        return any(
            self._transforms.lookup_at(*pair, stamp) is None and self._transforms.is_past(*pair, stamp)
            for pair in pairs
        )

    def _why(self, frame):
        odom, base = self._frames
        for target, source in ((odom, base), (base, frame)):
            if not source or self._transforms.latest(target, source) is None:
                return f'there is no transform {target} -> {source or "(a frame without a name)"}'
        return f'the transform {odom} -> {base} is older than the scans'

    def waiting_for(self, now: float) -> str:
        """What scans have been waiting for since long at a time (s), or ''; not one that later ones have overtaken."""
        for frame, queue in self._waiting.items():
            used = self._used.get(frame, 0)
            if any(scan.number > used and now - scan.came > PATIENCE for scan in queue):
                return f'scans from the frame "{frame}" wait: {self._why(frame)}'
        return ''
