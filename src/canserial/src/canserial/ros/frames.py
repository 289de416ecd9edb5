"""How a frame is turned in another, asked for now and then: tf is listened to meanwhile alone."""

from __future__ import annotations

import math
import time

import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped

from canserial.ros.conversions import yaw_of

PATIENCE_S = 1.0
"""s of the wall clock until a transform is not known."""


def yaw_in(target: str, message: PoseWithCovarianceStamped) -> float:
    """Yaw (rad) of a pose in a frame; NaN where a filter refuses it: what is not finite, or in an unknown frame."""
    pose, frame = message.pose.pose, message.header.frame_id.lstrip('/')
    if not all(map(math.isfinite, (pose.position.x, pose.position.y, pose.position.z, *message.pose.covariance))):
        return math.nan
    turned = 0.0 if frame in ('', target) else yaw_between(target, frame)
    return math.remainder(yaw_of(pose.orientation) + turned, math.tau)


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
