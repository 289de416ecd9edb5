"""tf2 behind the filter's small interface."""
from __future__ import annotations

import rospy
import tf2_ros

from ..geometry import IDENTITY
from . import conversions


class Tf2Transforms:
    """lookup(target, source, stamp) from a tf2 listener; waits `timeout` s for one that is not there yet."""

    def __init__(self, timeout: float = 0.0):
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer, tcp_nodelay=True)
        self.timeout = rospy.Duration.from_sec(timeout)

    def lookup(self, target, source, stamp):
        """target_from_source at the stamp (s), the latest one where that fails, or None."""
        if target == source:
            return IDENTITY
        for time, timeout in ((conversions.ros_time(stamp), self.timeout), (rospy.Time(0), rospy.Duration(0))):
            try:
                if timeout:
                    found = self.buffer.lookup_transform(target, source, time, timeout)
                else:
                    found = self.buffer.lookup_transform_core(target, source, time)
                return conversions.transform(found).transform
            except tf2_ros.TransformException:
                continue
        return None

    def clear(self):
        """Forget all that moved, as after a jump of the clock."""
        self.buffer.clear()
