"""How a frame is turned in another, asked for now and then: tf is listened to meanwhile alone."""

from __future__ import annotations

import math
import time

import rospy
import tf2_ros

from canserial.ros.conversions import yaw_of

PATIENCE_S = 1.0
"""s of the wall clock until a transform is not known."""


def yaw_between(target: str, source: str) -> float:
    """Yaw (rad) of the frame `source` in the frame `target`, by the newest transforms; NaN where they are not known."""
    buffer, end = tf2_ros.Buffer(debug=False), time.monotonic() + PATIENCE_S
    listener = tf2_ros.TransformListener(buffer)
    try:
        while True:
            try:
                return yaw_of(buffer.lookup_transform(target, source, rospy.Time()).transform.rotation)
            except tf2_ros.TransformException:
                if time.monotonic() > end or rospy.is_shutdown():
                    return math.nan
                time.sleep(0.02)
    finally:
        listener.unregister()
