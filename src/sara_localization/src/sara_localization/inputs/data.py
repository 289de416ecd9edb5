"""What goes into the filter and what comes out, as plain data: no ROS message is needed to run it.

Times are float seconds, vectors and quaternions (x, y, z, w) tuples or lists, covariances (6, 6) or (3, 3) arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_localization.filters import state_pose
from sara_localization.filters.state import RATES
from sara_localization.geometry.rigid import Transform


def _zeros(n):
    square = np.zeros((n, n))
    square.flags.writeable = False
    return square


class PoseData(NamedTuple):
    """A pose of the robot in frame_id, with the covariance of x, y, z, roll, pitch, yaw."""

    stamp: float
    frame_id: str
    position: Sequence[float] = (0.0, 0.0, 0.0)
    orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
    covariance: np.ndarray = _zeros(6)


class TwistData(NamedTuple):
    """Velocity and rates along the axes of frame_id, with the covariance of all six."""

    stamp: float
    frame_id: str
    linear: Sequence[float] = (0.0, 0.0, 0.0)
    angular: Sequence[float] = (0.0, 0.0, 0.0)
    covariance: np.ndarray = _zeros(6)


class OdometryData(NamedTuple):
    """A pose in frame_id and a twist along the axes of child_frame_id (nav_msgs/Odometry)."""

    stamp: float
    frame_id: str
    child_frame_id: str
    position: Sequence[float] = (0.0, 0.0, 0.0)
    orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
    pose_covariance: np.ndarray = _zeros(6)
    linear: Sequence[float] = (0.0, 0.0, 0.0)
    angular: Sequence[float] = (0.0, 0.0, 0.0)
    twist_covariance: np.ndarray = _zeros(6)

    @property
    def pose(self) -> PoseData:
        return PoseData(self.stamp, self.frame_id, self.position, self.orientation, self.pose_covariance)

    @property
    def twist(self) -> TwistData:
        return TwistData(self.stamp, self.child_frame_id, self.linear, self.angular, self.twist_covariance)


class ImuData(NamedTuple):
    """An inertial measurement; frame_id is where the sensor is mounted (sensor_msgs/Imu).

    A covariance whose first element is -1 says that the sensor does not measure that part.
    """

    stamp: float
    frame_id: str
    orientation: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
    orientation_covariance: np.ndarray = _zeros(3)
    angular_velocity: Sequence[float] = (0.0, 0.0, 0.0)
    angular_velocity_covariance: np.ndarray = _zeros(3)
    linear_acceleration: Sequence[float] = (0.0, 0.0, 0.0)
    linear_acceleration_covariance: np.ndarray = _zeros(3)


class StampedTransform(NamedTuple):
    """parent_from_child at a time, to be broadcast."""

    stamp: float
    parent: str
    child: str
    transform: Transform


class Turning(NamedTuple):
    """State (n,) and covariance (n, n) after a tick, and the rates (3,) rad/s of dt (s) before; dt 0: nobody has turned
    yet.
    """

    state: np.ndarray
    covariance: np.ndarray
    before: np.ndarray
    dt: float

    def acceleration(self) -> np.ndarray:
        """The angular acceleration (3,) rad/s2; worked out when it is asked for, which few do."""
        return (self.state[RATES] - self.before) / self.dt if self.dt > 0.0 else np.zeros(3)

    def acceleration_covariance(self) -> np.ndarray:
        """That of `acceleration`, (3, 3)."""
        if not self.dt > 0.0:
            return np.zeros((3, 3))
        return self.covariance[RATES, RATES] * (2.0 / (self.dt * self.dt))


class FilterOutput(NamedTuple):
    """The estimate after a tick.

    Attributes:
        stamp: time of the state (s); frame_id, child_frame_id: world and robot frame.
        state: (15,) in the order of state.py; covariance: (15, 15).
        transform: what is to be broadcast (map -> odom, or odom -> base_link), or None where there is none.
        published: False where the stamp was published before (robot_localization keeps silent then).
        turning: how the rates changed between the last two ticks, for the angular acceleration.
    """

    stamp: float
    frame_id: str
    child_frame_id: str
    state: np.ndarray
    covariance: np.ndarray
    transform: StampedTransform | None
    published: bool
    turning: Turning

    @property
    def pose(self) -> Transform:
        """The robot in the world frame."""
        return state_pose.pose_of(self.state)

    @property
    def odometry(self) -> OdometryData:
        """As it is published on odometry/filtered."""
        state, pose = self.state, self.pose
        return OdometryData(
            self.stamp,
            self.frame_id,
            self.child_frame_id,
            pose.translation,
            pose.rotation,
            self.covariance[:6, :6],
            tuple(state[6:9].tolist()),
            tuple(state[9:12].tolist()),
        )

    @property
    def angular_acceleration(self) -> np.ndarray:
        """(3,) rad/s2 from the rates of the last two ticks."""
        return self.turning.acceleration()

    @property
    def angular_acceleration_covariance(self) -> np.ndarray:
        """(3, 3) of it."""
        return self.turning.acceleration_covariance()

    @property
    def map_to_odom(self) -> StampedTransform | None:
        """The transform map -> odom where the world frame is the map, else None."""
        return None if self.transform is None or self.transform.child == self.child_frame_id else self.transform
