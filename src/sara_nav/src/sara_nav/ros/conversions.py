"""Between ROS messages and the plain data of sara_nav."""

import math
from collections.abc import Sequence

import numpy as np
import rospy
from geometry_msgs.msg import Pose, PoseStamped, Transform, Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Path
from sensor_msgs.msg import PointCloud2, PointField

from sara_common.planar import LEVEL, Pose2D, quaternion_from_yaw, yaw_from_quaternion
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap, MapError

LONGEST_SWEEP = 10.0
"""s that a scanner's sweep may take."""
STEEPEST = math.radians(30.0)
"""Slope that a robot may stand on; what is tipped more has no yaw to speak of."""


def pose_to_msg(pose: Pose2D) -> Pose:
    """Return a geometry_msgs/Pose of a Pose2D."""
    msg = Pose()
    msg.position.x, msg.position.y = pose.x, pose.y
    (msg.orientation.x, msg.orientation.y, msg.orientation.z, msg.orientation.w) = quaternion_from_yaw(pose.yaw)
    return msg


def pose_stamped(pose: Pose2D, frame: str, stamp: rospy.Time) -> PoseStamped:
    """Return a geometry_msgs/PoseStamped of a Pose2D."""
    msg = PoseStamped(pose=pose_to_msg(pose))
    msg.header.frame_id, msg.header.stamp = frame, stamp
    return msg


def pose_from_msg(msg: Pose) -> Pose2D:
    """Return the Pose2D of a geometry_msgs/Pose; raises ValueError for NaN and bad quaternions."""
    return _planar(msg.position, msg.orientation, LEVEL)


def pose_from_transform(msg: Transform) -> Pose2D:
    """Return the Pose2D of a geometry_msgs/Transform, of a robot on a slope, too; raises ValueError as pose_from_msg
    does.
    """
    return _planar(msg.translation, msg.rotation, STEEPEST)


def _planar(position, q, tilt):
    pose = Pose2D(position.x, position.y, yaw_from_quaternion(q.x, q.y, q.z, q.w, tilt))
    if not pose.is_finite():
        raise ValueError('the position holds a NaN or an infinity')
    return pose


def twist_to_msg(v: float, w: float) -> Twist:
    """Return a geometry_msgs/Twist that drives at v (m/s) and turns at w (rad/s)."""
    msg = Twist()
    msg.linear.x, msg.angular.z = v, w
    return msg


def grid_to_msg(
    data: np.ndarray, geometry: GridGeometry, origin_yaw: float, frame: str, stamp: rospy.Time
) -> OccupancyGrid:
    """Return a nav_msgs/OccupancyGrid of int8 data (height, width), row 0 at the bottom."""
    info = MapMetaData(
        map_load_time=stamp,
        resolution=geometry.resolution,
        width=geometry.width,
        height=geometry.height,
        origin=pose_to_msg(Pose2D(geometry.origin_x, geometry.origin_y, origin_yaw)),
    )
    msg = OccupancyGrid(info=info, data=data.ravel().tolist())
    msg.header.frame_id, msg.header.stamp = frame, stamp
    return msg


def grid_from_msg(msg: OccupancyGrid) -> GridMap:
    """Return the GridMap of a nav_msgs/OccupancyGrid; raises MapError or GridError with the reason."""
    info = msg.info
    # The message carries the resolution in single precision: 0.05 comes as 0.05000000074505806.
    geometry = GridGeometry(
        info.width,
        info.height,
        float(np.format_float_positional(np.float32(info.resolution))),
        info.origin.position.x,
        info.origin.position.y,
    )
    if len(msg.data) != info.width * info.height:
        raise MapError(f'the map says {info.width} x {info.height} cells but holds {len(msg.data)}')
    q = info.origin.orientation
    try:  # without an orientation, as messages are made, it is not turned
        yaw = pose_from_msg(info.origin).yaw if any((q.x, q.y, q.z, q.w)) else 0.0
    except ValueError as error:
        raise MapError(f"the map's origin cannot be used: {error}") from None
    data = np.array(msg.data, dtype=np.int8).reshape(info.height, info.width)
    return GridMap(data, geometry, yaw)


def path_to_msg(plan: np.ndarray, frame: str, stamp: rospy.Time) -> Path:
    """Return a nav_msgs/Path of a plan (n, 3)."""
    msg = Path()
    msg.header.frame_id, msg.header.stamp = frame, stamp
    msg.poses = [pose_stamped(Pose2D(*row), frame, stamp) for row in plan.tolist()]
    return msg


def cloud_to_msg(points: np.ndarray, names: Sequence[str], frame: str, stamp: rospy.Time) -> PointCloud2:
    """Return a sensor_msgs/PointCloud2 of points (n, k), one float32 field a column, called by ``names``."""
    points = np.ascontiguousarray(points, np.float32)
    fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate(names)]
    msg = PointCloud2(
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=False,
        point_step=4 * len(names),
        row_step=4 * len(names) * len(points),
        data=points.tobytes(),
        is_dense=True,
    )
    msg.header.frame_id, msg.header.stamp = frame, stamp
    return msg


def duration_of_sweep(seconds: float) -> rospy.Duration:
    """The Duration that a sweep takes (s). Raises ValueError where no scanner takes so long: tf2 would end the process
    at such a time.
    """
    if not 0.0 <= seconds <= LONGEST_SWEEP:
        raise ValueError(f'a sweep takes {seconds!r} s by its time_increment, allowed are 0 to {LONGEST_SWEEP:g} s')
    return rospy.Duration.from_sec(seconds)
