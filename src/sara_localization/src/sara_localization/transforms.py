"""Transforms between frames over time, for a filter that runs without ROS.

The filter needs one method, `lookup(target, source, stamp)`; TransformBuffer gives it from static and timed
transforms by tf2's rules: linear and great-circle interpolation between samples, ten seconds of memory, no
extrapolation, and (what robot_localization does when a time is not covered) the latest transform instead.
"""
from __future__ import annotations

from bisect import bisect_left
from typing import Optional, Protocol

from .geometry import IDENTITY, Transform

CACHE_TIME = 10.0


class Transforms(Protocol):
    """What the filter asks of a source of transforms."""

    def lookup(self, target: str, source: str, stamp: float) -> Optional[Transform]:
        """target_from_source at the stamp (s), the latest one where that time is not covered, or None."""


class _Timed:
    """The samples of one moving frame, oldest first."""

    def __init__(self):
        self.stamps, self.samples = [], []

    def insert(self, stamp, parent, transform) -> bool:
        if self.stamps and stamp < self.stamps[-1] - CACHE_TIME:
            return False
        k = bisect_left(self.stamps, stamp)
        if k < len(self.stamps) and self.stamps[k] == stamp:
            return False
        self.stamps.insert(k, stamp)
        self.samples.insert(k, (parent, transform))
        expired = bisect_left(self.stamps, self.stamps[-1] - CACHE_TIME)
        if expired > 64:
            del self.stamps[:expired], self.samples[:expired]
        return True

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
        self.sample = (parent, transform)

    def at(self, stamp):
        return self.sample


class TransformBuffer:
    """A tree of frames, filled by hand, from a bag or by the filter itself."""

    def __init__(self):
        self._frames = {}

    def set_transform(self, parent: str, child: str, transform: Transform, stamp: Optional[float] = None) -> bool:
        """Enter parent_from_child at a stamp (s), or for good with stamp None.

        Returns False for one that is too old or was entered before, as tf2 does.
        """
        parent, child = parent.lstrip('/'), child.lstrip('/')
        if not parent or not child or parent == child:
            return False
        if stamp is None:
            self._frames[child] = _Static(parent, transform)
            return True
        frame = self._frames.get(child)
        if not isinstance(frame, _Timed):
            frame = self._frames[child] = _Timed()
        return frame.insert(stamp, parent, transform)

    def clear(self):
        """Forget what moves; what is static stays."""
        self._frames = {child: frame for child, frame in self._frames.items() if isinstance(frame, _Static)}

    def lookup(self, target: str, source: str, stamp: Optional[float]) -> Optional[Transform]:
        """target_from_source at the stamp, at the latest common time where that fails, None where nothing joins them."""
        if target == source:
            return IDENTITY
        found = self._at(target, source, stamp)
        if found is None:
            found = self._at(target, source, self._latest_common_time(target, source))
        return found

    def _chain(self, frame, stamp):
        """[(ancestor, ancestor_from_frame)] from the frame itself up to the root, as far as the time is covered."""
        chain, transform = [(frame, IDENTITY)], IDENTITY
        while frame in self._frames and len(chain) <= len(self._frames) + 1:
            sample = self._frames[frame].at(stamp)
            if sample is None:
                break
            frame, step = sample
            transform = step @ transform
            chain.append((frame, transform))
        return chain

    def _at(self, target, source, stamp):
        up_source = self._chain(source, stamp)
        if up_source[-1][0] == target:
            return up_source[-1][1]
        above_source = dict(up_source)
        for frame, frame_from_target in self._chain(target, stamp):
            if frame in above_source:
                return frame_from_target.inverse() @ above_source[frame]
        return None

    def _latest_common_time(self, target, source):
        up_target, up_source = ([f for f, _ in self._chain(frame, None)] for frame in (target, source))
        common = next((f for f in up_target if f in up_source), None)
        if common is None:
            return None
        way = up_target[:up_target.index(common)] + up_source[:up_source.index(common)]
        return min((self._frames[f].stamps[-1] for f in way if self._frames[f].stamps), default=None)
