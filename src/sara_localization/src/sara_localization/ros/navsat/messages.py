"""navsat_transform_node's messages to plain data and back."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus

from sara_localization.geometry.rigid import Transform
from sara_localization.gps.fixes import FixData
from sara_localization.gps.velocity_heading import VelocityData
from sara_localization.inputs.data import ImuData, OdometryData
from sara_localization.ros import conversions


def fix(msg: NavSatFix) -> FixData:
    """A receiver's fix."""
    return FixData(
        conversions.seconds(msg.header.stamp),
        msg.header.frame_id,
        msg.status.status,
        msg.latitude,
        msg.longitude,
        msg.altitude,
        np.array(msg.position_covariance, dtype=float).reshape(3, 3),
        msg.position_covariance_type,
    )


def velocity(msg: TwistStamped) -> VelocityData:
    """A receiver's velocity."""
    v = msg.twist.linear
    return VelocityData(conversions.seconds(msg.header.stamp), msg.header.frame_id, v.x, v.y)


def fix_message(data: FixData) -> NavSatFix:
    """gps/filtered."""
    msg = NavSatFix()
    msg.header.stamp, msg.header.frame_id = conversions.ros_time(data.stamp), data.frame_id
    msg.status.status, msg.status.service = data.status, NavSatStatus.SERVICE_GPS
    msg.latitude, msg.longitude, msg.altitude = data.latitude, data.longitude, data.altitude
    msg.position_covariance = data.covariance.ravel().tolist()
    msg.position_covariance_type = data.covariance_type
    return msg


def odometry_message(data: OdometryData) -> Odometry:
    """odometry/gps."""
    msg = Odometry()
    msg.header.stamp, msg.header.frame_id = conversions.ros_time(data.stamp), data.frame_id
    msg.child_frame_id = data.child_frame_id
    conversions.fill_pose(msg.pose.pose, Transform(tuple(data.position), tuple(data.orientation)))
    msg.pose.covariance = data.pose_covariance.ravel().tolist()
    return msg


def heading_message(data: ImuData) -> Imu:
    """gps/heading."""
    msg = Imu()
    msg.header.stamp, msg.header.frame_id = conversions.ros_time(data.stamp), data.frame_id
    q = msg.orientation
    q.x, q.y, q.z, q.w = data.orientation
    msg.orientation_covariance = data.orientation_covariance.ravel().tolist()
    msg.angular_velocity_covariance = data.angular_velocity_covariance.ravel().tolist()
    msg.linear_acceleration_covariance = data.linear_acceleration_covariance.ravel().tolist()
    return msg
