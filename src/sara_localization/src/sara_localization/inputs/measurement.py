"""From a sensor's data to a measurement of the filter's variables: frames, masks, gravity, and what is no data.

The rules are robot_localization's: a pose is brought into the world frame (poses.py), a twist and an acceleration into
the robot's (with the speed and the acceleration that the sensor has only because it sits off the centre of a turning
robot); which variables count is turned along with the data; an IMU's orientation is that of its mounting, whose roll,
pitch and yaw are taken off. Unlike there, a number that is no number, a variance that is not positive and a quaternion
of no length leave their variables out and are reported, and with two_d_mode no covariance of the forced zeros with the
rest is taken in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_localization.filters.state import ANGLES, AX, RATES, TWIST
from sara_localization.geometry.rigid import (
    IDENTITY,
    Quaternion,
    Transform,
    cross,
    multiply,
    normalised,
    quaternion_from_rpy,
    rotate,
)
from sara_localization.geometry.transforms import Transforms
from sara_localization.inputs.data import ImuData, TwistData
from sara_localization.inputs.raw_measurement import Measurement, Memory, Problem, RawMeasurement

# The source of the zero velocities that are taken in while the robot is parked.
STANDSTILL = 'standstill'

Prepared = tuple[Measurement | None, list[Problem]]


class MissingTransform(Exception):
    """No transform from `source` to `target`."""

    def __init__(self, target: str, source: str):
        super().__init__('no transform {} -> {}'.format(source or '(empty frame_id)', target))
        self.target, self.source = target, source


class Frames(NamedTuple):
    """The frames that a filter measures in, and what knows where others are. two_d: the robot stays on a floor."""

    transforms: Transforms
    world: str
    base: str
    two_d: bool = False

    def lookup(self, target: str, source: str, stamp: float) -> Transform:
        """target_from_source at a time (s); raises MissingTransform."""
        source = source.lstrip('/')
        if source == target:
            return IDENTITY
        found = self.transforms.lookup(target, source, stamp) if source else None
        if found is None:
            raise MissingTransform(target, source)
        return found


class Part(NamedTuple):
    """A part of an input's messages that is measured: which of its variables count (mask), the gate in sigmas, and what
    was worked out of its covariance (None: nothing is kept).
    """

    source: str
    mask: tuple[bool, ...]
    threshold: float = float('inf')
    memory: Memory | None = None


class Gravity(NamedTuple):
    """What is taken off a specific force: size (m/s2; None: nothing). relative: the message's orientation is that of
    the robot since the start, not of the sensor.
    """

    size: float | None = None
    relative: bool = False


def orientation(raw: RawMeasurement, q: Sequence[float], first: int) -> Quaternion | None:
    """The unit quaternion; None for one that stands for no rotation: then the angles, from `first` on, do not count."""
    try:
        return normalised(q)
    except ValueError as error:
        if raw.mask[first : first + 3].any():
            raw.mask[first : first + 3] = False
            raw.problems.append(Problem('bad_orientation', str(error)))
        return None


def twist(
    data: TwistData,
    part: Part,
    frames: Frames,
    rates: Sequence[float],
    turning_noise: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Prepared:
    """A twist along the axes of data.frame_id as a measurement of the robot's velocity and rates.

    rates: (3,) the robot's own, for the velocity of a sensor off its centre (o x w). turning_noise: (3,) standard
    deviations of vx, vy, vyaw per rad/s of turning, added to the data's own. Raises MissingTransform.
    """
    noisy = any(turning_noise)
    values = (*data.linear, *data.angular)
    raw = RawMeasurement(TWIST.start, values, data.covariance, part.mask, None if noisy else part.memory)
    if noisy:
        turning = raw.values[5] ** 2
        for i, noise in zip((0, 1, 5), turning_noise):
            raw.covariance[i, i] += noise * noise * turning
    trans = frames.lookup(frames.base, data.frame_id or frames.base, data.stamp)
    if not trans.is_identity:
        lever = cross(trans.translation, [float(w) for w in rates])
        turned = rotate(trans.rotation, raw.values[:3])
        raw.values[:3] = [v + along for v, along in zip(turned, lever)]
        raw.values[3:] = rotate(trans.rotation, raw.values[3:])
        raw.turn(trans.rotation)
    return raw.measurement(data.stamp, part.source, part.threshold, frames.two_d), raw.problems


def imu_rates(data: ImuData, part: Part, frames: Frames) -> Prepared:
    """What a gyro says as a measurement of the robot's rates. Raises MissingTransform."""
    raw = RawMeasurement(RATES.start, data.angular_velocity, data.angular_velocity_covariance, part.mask, part.memory)
    trans = frames.lookup(frames.base, data.frame_id or frames.base, data.stamp)
    if not trans.is_identity:
        raw.values[:] = rotate(trans.rotation, raw.values)
        raw.turn(trans.rotation)
    return raw.measurement(data.stamp, part.source, part.threshold, frames.two_d), raw.problems


def acceleration(
    data: ImuData,
    part: Part,
    frames: Frames,
    state: np.ndarray,
    angular_acceleration: Sequence[float],
    gravity: Gravity = Gravity(),
) -> Prepared:
    """An IMU's specific force as a measurement of the robot's acceleration.

    Gravity is taken off along the message's orientation, or the state's (15,) where the message has none.
    angular_acceleration: (3,) rad/s2 of the robot, for a sensor off its centre. Raises MissingTransform.
    """
    raw = RawMeasurement(AX, data.linear_acceleration, data.linear_acceleration_covariance, part.mask, part.memory)
    trans = frames.lookup(frames.base, data.frame_id or frames.base, data.stamp)
    value = tuple(raw.values)
    if gravity.size is not None:
        x, y, z, w = _attitude(raw, data, trans, state, gravity.relative)
        down = rotate((-x, -y, -z, w), (0.0, 0.0, gravity.size))
        value = value[0] - down[0], value[1] - down[1], value[2] - down[2]
    if not trans.is_identity:
        arm, robot_rates = trans.translation, state[RATES].tolist()
        a, t = rotate(trans.rotation, value), cross(arm, np.asarray(angular_acceleration, float).tolist())
        c = cross(cross(arm, robot_rates), robot_rates)  # centripetal; t: from the turning that changes
        value = a[0] + t[0] - c[0], a[1] + t[1] - c[1], a[2] + t[2] - c[2]
        raw.turn(trans.rotation)
    raw.values[:] = value
    return raw.measurement(data.stamp, part.source, part.threshold, frames.two_d), raw.problems


def _attitude(raw, data, trans, state, relative) -> Quaternion:
    """How the sensor stands in the world."""
    if not measures(data.orientation_covariance):
        return multiply(quaternion_from_rpy(*state[ANGLES].tolist()), trans.rotation)
    attitude = orientation(raw, data.orientation, 0) or IDENTITY.rotation
    return multiply(attitude, trans.rotation) if relative else attitude


def measures(covariance: np.ndarray) -> bool:
    """False where the first element is -1: the IMU does not have that part (sensor_msgs/Imu)."""
    first = covariance.item(0) if isinstance(covariance, np.ndarray) else np.asarray(covariance).item(0)
    return abs(first + 1.0) >= 1e-9
