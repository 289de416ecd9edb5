"""What messages say of a parked robot, and what that says of them: zero velocities, gyro biases, a held yaw."""

from __future__ import annotations

import contextlib
import math

import numpy as np

from sara_localization.config.filter_config import FilterConfig, InputConfig
from sara_localization.filters.standstill import Standstill
from sara_localization.filters.state import RATES, TWIST
from sara_localization.geometry.rigid import multiply, normalised, quaternion_from_rpy, rpy_from_quaternion
from sara_localization.inputs.data import ImuData, OdometryData
from sara_localization.inputs.measurement import STANDSTILL, measures
from sara_localization.inputs.raw_measurement import Measurement


class StandstillWatch:
    """Tells the detector what wheels and gyros do. standstill: the detector; biases: as Preprocessor.biases."""

    def __init__(self, config: FilterConfig, standstill: Standstill, biases: dict[str, dict[int, int]]):
        self._settings, self.standstill, self._biases = config.standstill, standstill, biases
        self._wheel_poses: dict[str, tuple] = {}

    @classmethod
    def of(cls, config: FilterConfig, biases: dict[str, dict[int, int]]) -> StandstillWatch | None:
        """That of a configuration; None where no extension asks for it."""
        gyros = {
            i.name: i.gyro_bias == 'standstill'
            for i in config.inputs
            if i.kind == 'imu' and (config.standstill.update or i.gyro_bias != 'off')
        }
        return cls(config, Standstill(config.standstill, gyros), biases) if gyros else None

    def forget_poses(self) -> None:
        """The robot was put somewhere else."""
        self._wheel_poses.clear()
        self.standstill.forget_yaw()

    def odometry(self, name: str, data: OdometryData) -> None:
        """Tell what the wheels did: what they say, and what their pose says."""
        linear, before = data.linear, self._wheel_poses.get(name)
        if before is not None and data.stamp > before[0]:
            moved = math.dist(data.position, before[1])
            if moved > self._settings.linear_velocity * (data.stamp - before[0]):
                linear = (math.inf, 0.0, 0.0)
        self._wheel_poses[name] = data.stamp, tuple(data.position)
        self.standstill.wheels(data.stamp, linear, data.angular)

    def imu(self, config: InputConfig, data: ImuData) -> ImuData:
        """Tell what an IMU says, and take off the data what is known to be wrong with it."""
        finite = np.isfinite(data.angular_velocity).all() and measures(data.angular_velocity_covariance)
        force = measures(data.linear_acceleration_covariance) and np.isfinite(data.linear_acceleration).all()
        yaw = _yaw(data)
        gyro = self.standstill.gyro(
            config.name,
            data.stamp,
            np.array(data.angular_velocity) if finite else None,
            np.array(data.linear_acceleration) if force else None,
            yaw,
            _claimed_sigma(data),
        )
        changes = {}
        holding = self._settings.update
        if config.gyro_bias != 'state' and finite:
            if holding and self.standstill.parked:
                changes['angular_velocity'] = (0.0, 0.0, 0.0)
            elif config.gyro_bias == 'standstill':
                changes['angular_velocity'] = tuple(float(w - b) for w, b in zip(data.angular_velocity, gyro.bias))
        if holding and yaw is not None:
            back = quaternion_from_rpy(0.0, 0.0, -gyro.yaw_offset(data.stamp))
            changes['orientation'] = multiply(back, normalised(data.orientation))
        return data._replace(**changes) if changes else data

    def at_rest(self, name: str, stamp: float) -> list[Measurement]:
        """What is known while the robot is parked: that it does not move, or where only that is asked, not turn."""
        if not (self.standstill.parked and (self._settings.update or name in self._biases)):
            return []
        still = TWIST if self._settings.update else RATES
        zeros = np.zeros(still.stop - still.start)
        R = np.eye(len(zeros)) * self._settings.variance
        return [Measurement(stamp, STANDSTILL, tuple(range(still.start, still.stop)), zeros, R)]


def _yaw(data):
    """The yaw (rad) of an IMU's orientation; None where it has none."""
    if measures(data.orientation_covariance):
        with contextlib.suppress(ValueError):
            return rpy_from_quaternion(normalised(data.orientation))[2]
    return None


def _claimed_sigma(data):
    """The largest standard deviation (rad/s) that an IMU claims for its rates; 0 where it claims none."""
    claimed = float(np.max(np.reshape(data.angular_velocity_covariance, (3, 3)).diagonal()))
    return math.sqrt(claimed) if 0.0 < claimed < math.inf else 0.0
