"""tf2 behind the filter's small interface."""
from __future__ import annotations

import time

import rospy
import tf2_ros

from ..geometry import IDENTITY
from . import conversions

# After a wait in vain for a transform it is not waited for again for so long (s): messages would pile up behind each other.
PATIENCE = 1.0


class Tf2Transforms:
    """lookup(target, source, stamp) from a tf2 listener; waits `timeout` s for one that is not there yet."""

    def __init__(self, timeout: float = 0.0):
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer, tcp_nodelay=True)
        self.timeout = rospy.Duration.from_sec(timeout)
        self._in_vain = {}

    def lookup(self, target, source, stamp):
        """target_from_source at the stamp (s), the latest one where that fails, or None."""
        if target == source:
            return IDENTITY
        found = self._at(target, source, conversions.ros_time(stamp))
        if found is None:
            found = self._at(target, source, rospy.Time(0), wait=False)
        return found

    def _at(self, target, source, stamp, wait=True):
        wait = wait and self.timeout and time.monotonic() - self._in_vain.get((target, source), -PATIENCE) >= PATIENCE
        try:
            if wait:
                found = self.buffer.lookup_transform(target, source, stamp, self.timeout)
            else:
                found = self.buffer.lookup_transform_core(target, source, stamp)
        except tf2_ros.TransformException:
            if wait:
                self._in_vain[target, source] = time.monotonic()
            return None
        return conversions.transform(found).transform

    def clear(self):
        """Forget all that moved, as after a jump of the clock."""
        self.buffer.clear()
