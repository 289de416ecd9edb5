"""Transforms between frames over time, for a filter that runs without ROS.

The filter needs one method, `lookup(target, source, stamp)`; TransformBuffer gives it from static and timed
transforms by tf2's rules: linear and great-circle interpolation between samples, ten seconds of memory, no
extrapolation, and (what robot_localization does when a time is not covered) the latest transform instead.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import Protocol

from sara_localization.geometry.rigid import IDENTITY, Transform
from sara_localization.geometry.stamps import nanoseconds

CACHE_TIME = 10 * 10**9


class Transforms(Protocol):
    """What the filter asks of a source of transforms."""

    def lookup(self, target: str, source: str, stamp: float) -> Transform | None:
        """target_from_source at the stamp (s), the latest one where that time is not covered, or None."""

    def age(self, target: str, source: str, stamp: float) -> float:
        """By how much (s) what `lookup` gives is older than the stamp; 0.0 where that time is covered, or nothing
        moves.
        """


class _Timed:
    """The samples of one moving frame, oldest first; times in ns."""

    def __init__(self):
        self.stamps, self.samples, self.parent = [], [], None  # parent: the newest one

    def insert(self, stamp, parent, transform) -> bool:
        stamps = self.stamps
        if not stamps or stamp > stamps[-1]:  # as they come, nearly always
            stamps.append(stamp)
            self.samples.append((parent, transform))
            self.parent = parent
            if len(stamps) > 64 and stamps[64] < stamp - CACHE_TIME:
                self._forget()
            return True
        if stamp < stamps[-1] - CACHE_TIME:
            return False
        k = bisect_left(stamps, stamp)
        if stamps[k] == stamp:
            return False
        stamps.insert(k, stamp)
        self.samples.insert(k, (parent, transform))
        self._forget()
        return True

    def _forget(self):
        """Drop what is too old, many at a time."""
        expired = bisect_left(self.stamps, self.stamps[-1] - CACHE_TIME)
        if expired > 64:
            del self.stamps[:expired], self.samples[:expired]

    def at(self, stamp):
        """(parent, transform) at the stamp, None outside of what is remembered; the newest for stamp None."""
        stamps = self.stamps
        if stamp is None or stamp == stamps[-1]:
            return self.samples[-1]
        oldest = bisect_left(stamps, stamps[-1] - CACHE_TIME)
        if stamp > stamps[-1] or stamp < stamps[oldest]:
            return None
        k = bisect_left(stamps, stamp, oldest)
        if stamps[k] == stamp:
            return self.samples[k]
        (parent, before), (next_parent, after) = self.samples[k - 1], self.samples[k]
        if parent != next_parent:
            return parent, before
        return parent, before.interpolate(after, (stamp - stamps[k - 1]) / (stamps[k] - stamps[k - 1]))


class _Static:
    """A frame that never moves."""

    stamps = None

    def __init__(self, parent, transform):
        self.parent, self.sample = parent, (parent, transform)

    def at(self, stamp):
        return self.sample


class TransformBuffer:
    """A tree of frames, filled by hand, from a bag or by the filter itself."""

    def __init__(self):
        self._frames, self._ways, self._newest, self._fixed = {}, {}, {}, {}

    def set_transform(self, parent: str, child: str, transform: Transform, stamp: float | None = None) -> bool:
        """Enter parent_from_child at a stamp (s, a Stamp for the last digits), or for good with stamp None.

        Returns False for one that is too old or was entered before, as tf2 does.
        """
        parent, child = parent.lstrip('/'), child.lstrip('/')
        if not parent or not child or parent == child:
            return False
        if stamp is None:
            self._frames[child] = _Static(parent, transform)
            self._tree_changed()
            return True
        if not math.isfinite(stamp):
            return False
        frame = self._frames.get(child)
        if not isinstance(frame, _Timed):
            frame = self._frames[child] = _Timed()
        before = frame.parent
        taken = frame.insert(nanoseconds(stamp), parent, transform)
        if frame.parent != before:
            self._tree_changed()
        return taken

    def _tree_changed(self):
        self._ways.clear()
        self._newest.clear()
        self._fixed.clear()

    def clear(self) -> None:
        """Forget what moves; what is static stays."""
        self._frames = {child: frame for child, frame in self._frames.items() if isinstance(frame, _Static)}
        self._tree_changed()

    def lookup(self, target: str, source: str, stamp: float | None) -> Transform | None:
        """target_from_source at the stamp, at the latest common time where that fails, None where nothing joins
        them.
        """
        if target == source:
            return IDENTITY
        fixed = self._fixed.get((target, source))
        if fixed is not None:
            return fixed
        kept = self._newest.get((target, source))
        if kept is not None and stamp is not None:
            stamps, latest, transform = kept
            if stamps[-1] == latest <= nanoseconds(stamp):
                return transform
        way = self._way(target, source)
        if way is None:
            return None
        latest = self._latest_common_time(*way)
        if latest is None:  # nothing on the way moves: worked out once
            self._fixed[target, source] = self._along(*way, None)
            return self._fixed[target, source]
        if stamp is not None:
            at = nanoseconds(stamp)
            found = self._along(*way, at) if at <= latest else None
            if found is not None:
                return found
            if len(way[0]) + len(way[1]) == 1:  # what a single frame's newest sample says is worked out once
                return self._of_newest(target, source, way, latest)
        return self._along(*way, latest)

    def lookup_at(self, target: str, source: str, stamp: float) -> Transform | None:
        """target_from_source at that very time (s), None where it is not known or not known yet."""
        if target == source:
            return IDENTITY
        way = self._way(target, source)
        latest = self._latest_common_time(*way) if way else None
        if way is None or latest is None:
            return self.lookup(target, source, None)
        at = nanoseconds(stamp)
        return self._along(*way, at) if at <= latest else None

    def latest(self, target: str, source: str) -> Transform | None:
        """The newest target_from_source, or None."""
        return self.lookup(target, source, None)

    def is_past(self, target: str, source: str, stamp: float) -> bool:
        """Whether newer transforms than of that time (s) are known: what `lookup_at` lacks will not come any more."""
        way = self._way(target, source)
        latest = self._latest_common_time(*way) if way else None
        return latest is not None and latest > nanoseconds(stamp)

    def age(self, target: str, source: str, stamp: float) -> float:
        """By how much (s) what `lookup` gives is older than the stamp; 0.0 where that time is covered, or nothing
        moves.
        """
        way = self._way(target, source)
        latest = self._latest_common_time(*way) if way else None
        return 0.0 if latest is None else max(0.0, 1e-9 * (nanoseconds(stamp) - latest))

    def _of_newest(self, target, source, way, latest):
        transform = self._along(*way, latest)
        self._newest[target, source] = self._frames[(way[0] + way[1])[0]].stamps, latest, transform
        return transform

    def _ancestors(self, frame):
        """The frame and those above it, by their newest parents."""
        line = [frame]
        while frame in self._frames and len(line) <= len(self._frames) + 1:
            frame = self._frames[frame].parent
            line.append(frame)
        return line

    def _way(self, target, source):
        """The frames to climb from target and source until they meet, or None where nothing joins them; kept until the
        tree changes.
        """
        way = self._ways.get((target, source))
        if way is None:
            way = self._ways[target, source] = self._find_way(target, source)
        return way

    def _find_way(self, target, source):
        up_target, up_source = self._ancestors(target), self._ancestors(source)
        for k, frame in enumerate(up_target):
            if frame in up_source:
                return up_target[:k], up_source[: up_source.index(frame)]
        return None

    def _along(self, up_target, up_source, stamp):
        """target_from_source at the stamp; None where a frame on the way is not covered or had another parent then."""
        base_from_target, base_from_source = self._climb(up_target, stamp), self._climb(up_source, stamp)
        if base_from_target is None or base_from_source is None:
            return None
        if base_from_target is IDENTITY:
            return base_from_source
        target_from_base = base_from_target.inverse()
        return target_from_base if base_from_source is IDENTITY else target_from_base @ base_from_source

    def _climb(self, line, stamp):
        transform = IDENTITY
        for name in line:
            frame = self._frames[name]
            sample = frame.at(stamp)
            if sample is None or sample[0] != frame.parent:
                return None
            transform = sample[1] if transform is IDENTITY else sample[1] @ transform
        return transform

    def _latest_common_time(self, up_target, up_source):
        latest = None
        for line in (up_target, up_source):
            for name in line:
                stamps = self._frames[name].stamps
                if stamps and (latest is None or stamps[-1] < latest):
                    latest = stamps[-1]
        return latest
