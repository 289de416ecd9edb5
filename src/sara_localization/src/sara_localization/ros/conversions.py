"""ROS messages to the filter's plain data and back."""

from __future__ import annotations

import functools

import numpy as np
import rospy
from geometry_msgs.msg import (
    AccelWithCovarianceStamped,
    Pose,
    PoseWithCovarianceStamped,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovarianceStamped,
)
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Imu

from sara_localization.fake import true_pose
from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import Stamp, nanoseconds
from sara_localization.inputs.data import FilterOutput, ImuData, OdometryData, PoseData, StampedTransform, TwistData
from sara_localization.ranges.range_data import RangeMap


def seconds(time: rospy.Time) -> Stamp:
    """A rospy.Time in seconds, with its nanoseconds."""
    return Stamp(time.secs, time.nsecs)


def ros_time(stamp: float) -> rospy.Time:
    """The rospy.Time of seconds, to the nanosecond where they are a Stamp."""
    return rospy.Time(*divmod(nanoseconds(stamp), 10**9))


def _vector(v):
    return v.x, v.y, v.z


def _quaternion(q):
    return q.x, q.y, q.z, q.w


def _square(values, n):
    return _known_square(tuple(values), n)


@functools.lru_cache(maxsize=64)
def _known_square(values, n):
    """(n, n) read-only: most sensors state the same covariance in every message."""
    square = np.array(values, dtype=float).reshape(n, n)
    square.flags.writeable = False
    return square


def odometry(msg: Odometry) -> OdometryData:
    return OdometryData(
        seconds(msg.header.stamp),
        msg.header.frame_id,
        msg.child_frame_id,
        _vector(msg.pose.pose.position),
        _quaternion(msg.pose.pose.orientation),
        _square(msg.pose.covariance, 6),
        _vector(msg.twist.twist.linear),
        _vector(msg.twist.twist.angular),
        _square(msg.twist.covariance, 6),
    )


def pose(msg: PoseWithCovarianceStamped) -> PoseData:
    return PoseData(
        seconds(msg.header.stamp),
        msg.header.frame_id,
        _vector(msg.pose.pose.position),
        _quaternion(msg.pose.pose.orientation),
        _square(msg.pose.covariance, 6),
    )


def twist(msg: TwistWithCovarianceStamped) -> TwistData:
    return TwistData(
        seconds(msg.header.stamp),
        msg.header.frame_id,
        _vector(msg.twist.twist.linear),
        _vector(msg.twist.twist.angular),
        _square(msg.twist.covariance, 6),
    )


def imu(msg: Imu) -> ImuData:
    return ImuData(
        seconds(msg.header.stamp),
        msg.header.frame_id,
        _quaternion(msg.orientation),
        _square(msg.orientation_covariance, 3),
        _vector(msg.angular_velocity),
        _square(msg.angular_velocity_covariance, 3),
        _vector(msg.linear_acceleration),
        _square(msg.linear_acceleration_covariance, 3),
    )


def transform(msg: TransformStamped) -> StampedTransform:
    """A geometry_msgs/TransformStamped."""
    t = msg.transform
    return StampedTransform(
        seconds(msg.header.stamp),
        msg.header.frame_id,
        msg.child_frame_id,
        Transform(_vector(t.translation), _quaternion(t.rotation)),
    )


def range_map(msg: OccupancyGrid, occupied_above: float) -> RangeMap:
    """A map; raises ValueError with a sentence. occupied_above: cells of a higher occupancy (0..100) are walls."""
    info = msg.info
    turned = _quaternion(info.origin.orientation)  # all 0: without an orientation, as messages are made, it is not
    origin = true_pose(_vector(info.origin.position), turned if any(turned) else (0.0, 0.0, 0.0, 1.0))
    if origin is None:
        raise ValueError('its origin is no pose')
    if len(msg.data) != info.width * info.height:
        raise ValueError(f'it says {info.width} x {info.height} cells but holds {len(msg.data)}')
    cells = np.asarray(msg.data, np.int8).reshape(info.height, info.width)
    # The message carries the resolution in single precision: 0.05 comes as 0.05000000074505806.
    resolution = float(np.format_float_positional(np.float32(info.resolution)))
    return RangeMap.from_occupancy(cells, resolution, (*origin.translation[:2], origin.yaw), occupied_above)


def command(msg: Twist | TwistStamped, now: float, base: str) -> tuple[float, tuple[float, ...]]:
    """(stamp in s, (6,) command) of a Twist, which counts as of `now`, or a TwistStamped. Raises ValueError with a
    sentence where it is not in the robot's frame `base`, which no frame_id is, too.
    """
    stamped = hasattr(msg, 'twist')
    twist_ = msg.twist if stamped else msg
    if stamped and msg.header.frame_id.lstrip('/') not in ('', base):
        raise ValueError(f'a command in the frame {msg.header.frame_id} is ignored: it must be in {base}')
    return seconds(msg.header.stamp) if stamped else now, _vector(twist_.linear) + _vector(twist_.angular)


def fill_pose(pose_: Pose, transform_: Transform) -> None:
    """Into a geometry_msgs/Pose."""
    p, q = pose_.position, pose_.orientation
    p.x, p.y, p.z = transform_.translation
    q.x, q.y, q.z, q.w = transform_.rotation


def odometry_message(output: FilterOutput, msg: Odometry | None = None) -> Odometry:
    """msg: one to write into, for who publishes many (rospy has put it into bytes when publish() returns)."""
    msg = Odometry() if msg is None else msg
    msg.header.stamp = ros_time(output.stamp)
    msg.header.frame_id, msg.child_frame_id = output.frame_id, output.child_frame_id
    fill_pose(msg.pose.pose, output.pose)
    v, w = msg.twist.twist.linear, msg.twist.twist.angular
    v.x, v.y, v.z, w.x, w.y, w.z = output.state[6:12].tolist()
    msg.pose.covariance = output.covariance[:6, :6].ravel().tolist()
    msg.twist.covariance = output.covariance[6:12, 6:12].ravel().tolist()
    return msg


def acceleration_message(output: FilterOutput) -> AccelWithCovarianceStamped:
    msg = AccelWithCovarianceStamped()
    msg.header.stamp = ros_time(output.stamp)
    msg.header.frame_id = output.child_frame_id
    a, w = msg.accel.accel.linear, msg.accel.accel.angular
    a.x, a.y, a.z = output.state[12:].tolist()
    w.x, w.y, w.z = output.angular_acceleration.tolist()
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = output.covariance[12:, 12:]
    covariance[3:, 3:] = output.angular_acceleration_covariance
    msg.accel.covariance = covariance.ravel().tolist()
    return msg


def transform_message(stamped: StampedTransform, msg: TransformStamped | None = None) -> TransformStamped:
    """msg: as in odometry_message."""
    msg = TransformStamped() if msg is None else msg
    msg.header.stamp = ros_time(stamped.stamp)
    msg.header.frame_id, msg.child_frame_id = stamped.parent, stamped.child
    t, r = msg.transform.translation, msg.transform.rotation
    t.x, t.y, t.z = stamped.transform.translation
    r.x, r.y, r.z, r.w = stamped.transform.rotation
    return msg
