"""What the robot node publishes, under stage_ros's names; bags of simulated drives hold the same."""

from __future__ import annotations

from collections.abc import Sequence

import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from sara_common.planar import quaternion_from_yaw
from sara_sim.robot.robot_config import ScannerConfig

ODOM, TRUTH, SCAN = 'odom', 'base_pose_ground_truth', 'base_scan'
BASE, FOOTPRINT, LASER = 'base_link', 'base_footprint', 'base_laser_link'


def numbered(name: str, scanners: Sequence[ScannerConfig]) -> list[str]:
    """A topic's or a frame's name for each scanner: with its number where there are several."""
    return [name] if len(scanners) == 1 else [f'{name}_{number}' for number in range(len(scanners))]


def odometry(stamp: rospy.Time, frame: str, pose: Sequence[float], velocity: Sequence[float]) -> Odometry:
    """A pose (x, y, yaw; m, rad) of the base in a frame, and its velocity along and about its own axes (m/s, rad/s)."""
    message = Odometry()
    message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, frame, FOOTPRINT
    _fill(message.pose.pose.position, message.pose.pose.orientation, pose)
    message.twist.twist.linear.x, message.twist.twist.angular.z = velocity
    return message


def transforms(stamp: rospy.Time, pose: Sequence[float], scanners: Sequence[ScannerConfig]) -> TFMessage:
    """odom -> base_footprint at a pose (x, y, yaw; m, rad), base_footprint -> base_link, and each scanner's frame."""
    found = [transform(stamp, ODOM, FOOTPRINT, pose), transform(stamp, FOOTPRINT, BASE, (0.0, 0.0, 0.0))]
    for frame, one in zip(numbered(LASER, scanners), scanners):
        found.append(transform(stamp, BASE, frame, (one.x, one.y, one.yaw)))
        found[-1].transform.translation.z = one.z
    return TFMessage(found)


def transform(stamp: rospy.Time, parent: str, child: str, pose: Sequence[float]) -> TransformStamped:
    """The frame `child` at a pose (x, y, yaw; m, rad) in `parent`."""
    message = TransformStamped(child_frame_id=child)
    message.header.stamp, message.header.frame_id = stamp, parent
    _fill(message.transform.translation, message.transform.rotation, pose)
    return message


def _fill(position, orientation, pose):
    position.x, position.y = pose[:2]
    orientation.x, orientation.y, orientation.z, orientation.w = quaternion_from_yaw(pose[2])
