"""Where the chair is, in lockstep: the filter that ekf_se and ukf_se run, or the simulator's true pose as
fake_localization gives it.

Each has `pose` (x, y, yaw in the map, m, rad), `velocity` (m/s, rad/s), `stamp` (of the pose, s) and `map_from_odom`
(x, y, yaw), None before they are known; `step(now)` returns whether there is a new pose.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import compose, inverse
from sara_common.platforms import parameters
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData

if TYPE_CHECKING:
    from canserial.reader.readings import ImuReading, RangeReading
    from sara_control.wheels.odometry import OdometryState

RVIZ_COVARIANCE = np.diag((0.25, 0.25, 0.0, 0.0, 0.0, (np.pi / 12.0) ** 2))  # of its "2D Pose Estimate"; m2, rad2


@lru_cache(maxsize=64)
def _diagonal(variances):
    """(n, n) read-only: a sensor states the same in every message, and the filter knows it again."""
    square = np.diag(variances)
    square.flags.writeable = False
    return square


class Estimate:
    """What both tell."""

    lost_probability: float | None = None
    """That the pose is wrong; None where nobody says."""

    def __init__(self) -> None:
        self.pose = self.velocity = self.stamp = self.map_from_odom = None

    def on_range(self, _reading: RangeReading) -> None:
        """A RangeReading: of use to what corrects the pose by the map alone (corrected.py)."""


class Filter(Estimate):
    """`start`: (x, y, yaw), m, rad. `kind`: ekf or ukf, which both read sara_localization's config/ekf_SET.yaml.
    `imu_variances`: read.py's. `backend`: what computes the filter, compiled or filterpy.
    """

    def __init__(
        self,
        start: tuple[float, float, float],
        kind: str,
        name: str,
        imu_variances: Sequence[Sequence[float]],
        backend: str = 'compiled',
    ) -> None:
        super().__init__()
        tree = parameters('sara_localization', f'ekf_{name}.yaml')
        tree['initial_state'] = [start[0], start[1], 0.0, 0.0, 0.0, start[2]] + [0.0] * 9
        tree['backend'] = backend
        self._transforms = TransformBuffer()
        self._engine = FilterEngine(FilterConfig.from_params(tree, kind), self._transforms)
        self._imu_variances = tuple(map(tuple, imu_variances))

    def on_imu(self, reading: ImuReading) -> None:
        """An ImuReading."""
        angles, rates, accelerations = map(_diagonal, reading.variances(self._imu_variances))
        self._engine.add_imu(
            'imu0',
            ImuData(
                reading.stamp,
                'base_link',
                quaternion_from_rpy(reading.roll, reading.pitch, reading.yaw),
                angles,
                reading.angular_velocity,
                rates,
                reading.linear_acceleration,
                accelerations,
            ),
        )

    def on_odometry(self, state: OdometryState) -> None:
        """The controller's newest odometry."""
        x, y, heading, stamp = state.x, state.y, state.heading, state.stamp
        self._transforms.set_transform('odom', 'base_link', Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, heading), stamp)
        self._engine.add_odometry(
            'odom0',
            OdometryData(
                stamp,
                'odom',
                'base_link',
                (x, y, 0.0),
                quaternion_from_rpy(0.0, 0.0, heading),
                _diagonal(tuple(state.pose_covariance)),
                (state.linear, 0.0, 0.0),
                (0.0, 0.0, state.angular),
                _diagonal(tuple(state.twist_covariance)),
            ),
        )

    def set_pose(self, pose: tuple[float, float, float], now: float) -> None:
        """As `/set_pose`, with what RViz's "2D Pose Estimate" thinks of itself: the chair stands at (x, y, yaw), m,
        rad. Returns why that is not believed, or None.
        """
        x, y, yaw = pose
        return self._engine.set_pose(
            PoseData(now, 'map', (x, y, 0.0), quaternion_from_rpy(0.0, 0.0, yaw), RVIZ_COVARIANCE), now
        )

    def step(self, now: float) -> bool:
        """The filter's tick, 50 times a second."""
        output = self._engine.tick(now)
        if output is None:
            return False
        x = output.state.tolist()
        self.pose, self.velocity, self.stamp = (x[0], x[1], x[5]), (x[6], x[11]), output.stamp
        stamped = output.map_to_odom
        if stamped is not None:
            self._transforms.set_transform(stamped.parent, stamped.child, stamped.transform, stamped.stamp)
            x, y, _ = stamped.transform.translation
            self.map_from_odom = (float(x), float(y), stamped.transform.yaw)
        return True


class Truth(Estimate):
    """`true_pose`: a function that gives the chair's (x, y, yaw). Its speed is the odometry's, as in a launch with
    localization:=fake.
    """

    def __init__(self, true_pose: Callable[[], tuple[float, float, float]]) -> None:
        super().__init__()
        self._true_pose = true_pose

    def on_imu(self, _reading: ImuReading) -> None:
        """The truth needs no IMU."""

    def on_odometry(self, state: OdometryState) -> None:
        """The controller's newest odometry: what the truth at this moment is to agree with."""
        self.pose, self.velocity, self.stamp = self._true_pose(), (state.linear, state.angular), state.stamp
        self.map_from_odom = compose(self.pose, inverse((state.x, state.y, state.heading)))

    def step(self, _now: float) -> bool:
        """Nothing is estimated; there is a pose once there is odometry."""
        return self.pose is not None
