"""`~wheel_joint_controller_state`: what is asked of each wheel joint and what it does, once a cycle."""

import math
from collections.abc import Sequence

import rospy
from trajectory_msgs.msg import JointTrajectoryPoint

from sara_control.wheels.config import ControllerConfig

try:
    from control_msgs.msg import JointTrajectoryControllerState
except ImportError:  # not in Debian
    from sara_control.msg import JointTrajectoryControllerState


class WheelStates:
    """Positions in rad, speeds in rad/s, accelerations in rad/s2; efforts are not measured (NaN)."""

    def __init__(self, config: ControllerConfig) -> None:
        self._joints = [*config.left_joints, *config.right_joints]
        zeros = [0.0] * len(self._joints)
        self._actual = zeros, zeros, zeros, None  # positions, speeds, accelerations, stamp
        self._desired = zeros, zeros, None  # positions, speeds, stamp
        self._publisher = rospy.Publisher(
            '~wheel_joint_controller_state', JointTrajectoryControllerState, queue_size=10, tcp_nodelay=True
        )

    def on_positions(self, positions: Sequence[float], speeds: Sequence[float], stamp: float) -> None:
        """Measured."""
        _, before, _, time = self._actual
        self._actual = list(positions), list(speeds), _rates(speeds, before, stamp, time), stamp

    def publish(self, speeds: Sequence[float], stamp: rospy.Time) -> None:
        """Commanded speeds; a desired position is where the wheel would be had it obeyed since the last measurement."""
        positions, actual_speeds, accelerations, measured_at = self._actual
        now = stamp.to_sec()
        since = 0.0 if measured_at is None else now - measured_at
        desired = [angle + speed * since for angle, speed in zip(positions, speeds)]
        _, before, time = self._desired
        wanted = _rates(speeds, before, now, time)
        self._desired = desired, list(speeds), now
        message = JointTrajectoryControllerState(joint_names=self._joints)
        message.header.stamp = stamp
        period = rospy.Duration(0.0 if time is None else max(0.0, now - time))
        message.desired = _point(desired, speeds, wanted, period)
        message.actual = _point(positions, actual_speeds, accelerations, period)
        message.error = _point(
            *(
                [a - b for a, b in zip(one, other)]
                for one, other in ((desired, positions), (speeds, actual_speeds), (wanted, accelerations))
            ),
            period,
        )
        self._publisher.publish(message)


def _rates(values, before, now, then):
    if then is None or now <= then:
        return [0.0] * len(values)
    return [(value - old) / (now - then) for value, old in zip(values, before)]


def _point(positions, speeds, accelerations, period):
    return JointTrajectoryPoint(
        positions=positions,
        velocities=speeds,
        accelerations=accelerations,
        effort=[math.nan] * len(positions),
        time_from_start=period,
    )
