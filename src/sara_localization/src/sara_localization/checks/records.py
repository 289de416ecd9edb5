"""What came of one input over a drive, as numbers to look at."""

from __future__ import annotations

import math

import numpy as np

from sara_localization.config.filter_config import InputConfig
from sara_localization.filters.state import ACCELERATION, ANGLES, RATES
from sara_localization.geometry.rigid import Transform, normalised, rpy_from_quaternion
from sara_localization.inputs.data import ImuData, OdometryData, PoseData, TwistData


class Record:
    """What came of one input: stamps, (n, 15) values as the message has them, variances, what was wrong."""

    def __init__(self, config: InputConfig):
        self.config = config
        self.stamps: list[float] = []
        self.received: list[float] = []
        self.values: list[np.ndarray] = []
        self.variances: list[np.ndarray] = []
        self.lost: dict[tuple[str, str, str], int] = {}  # messages by (part, source, target) of the transform they lack
        # (stamp, yaw) and (stamp, yaw rate) along the robot's axes; (stamp, speed, yaw rate) of a twist
        self.headings: list[tuple[float, float]] = []
        self.rates: list[tuple[float, float]] = []
        self.wheels: list[tuple[float, float, float]] = []
        self.mounting: Transform | None = None  # robot_from_sensor

    @property
    def key(self) -> str:
        """What findings about its data are about."""
        return self.config.name + '_data'

    def keep(self, data: ImuData | OdometryData | PoseData | TwistData, received: float) -> None:
        """A message that was received at a time (s)."""
        values, variances = _numbers(data)
        self.stamps.append(data.stamp)
        self.received.append(received)
        self.values.append(values)
        self.variances.append(variances)


def block_start(k: int) -> int:
    """The first variable of the block whose covariance begins with -1 where an IMU lacks it."""
    return ANGLES.start if k in range(3, 6) else RATES.start if k in range(9, 12) else ACCELERATION.start


def in_order(rows: list[tuple[float, ...]]) -> np.ndarray:
    """(columns, n): times and the other columns of rows, oldest first, without repeated times."""
    columns = np.array(rows).T
    _, first = np.unique(columns[0], return_index=True)
    return columns[:, first]


def _numbers(data):
    """(15,) values and variances of a message, NaN and 1 where its kind has none."""
    values, variances = np.full(15, np.nan), np.ones(15)

    def put(first, value, covariance):
        n = len(value)
        values[first : first + n] = value
        size = int(round(math.sqrt(np.size(covariance))))
        variances[first : first + n] = np.reshape(covariance, (size, size)).diagonal()[:n]

    def angles(q):
        try:
            return rpy_from_quaternion(normalised(q))
        except ValueError:
            return (math.nan,) * 3

    if isinstance(data, ImuData):
        put(3, angles(data.orientation), data.orientation_covariance)
        put(9, data.angular_velocity, data.angular_velocity_covariance)
        put(12, data.linear_acceleration, data.linear_acceleration_covariance)
        return values, variances
    if isinstance(data, OdometryData):
        put(0, (*data.position, *angles(data.orientation)), data.pose_covariance)
        put(6, (*data.linear, *data.angular), data.twist_covariance)
    elif hasattr(data, 'position'):
        put(0, (*data.position, *angles(data.orientation)), data.covariance)
    else:
        put(6, (*data.linear, *data.angular), data.covariance)
    return values, variances
