"""A pose, or an IMU's orientation, as a measurement: in the world frame, since the first, or by their differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap_exact
from sara_localization.filters.state import ANGLES, POSITION, ROLL, X
from sara_localization.geometry.rigid import (
    IDENTITY,
    Quaternion,
    Transform,
    quaternion_from_rpy,
    rotate,
    rpy_from_quaternion,
)
from sara_localization.inputs.data import ImuData, PoseData, TwistData
from sara_localization.inputs.measurement import Frames, Part, Prepared, orientation, twist
from sara_localization.inputs.raw_measurement import Problem, RawMeasurement


@dataclass
class PoseMemory:
    """What a source of poses must remember: the previous (stamp, pose, covariance) to differentiate, the first to
    subtract.
    """

    previous: tuple[float, Transform, np.ndarray] | None = None
    initial: Transform | None = None


@dataclass(frozen=True)
class PoseOptions:
    """How a source of poses is taken. Relative: taken from the first one. Differential: the difference to the previous
    pose as a twist. turning_noise: (3,) see twist; memory: its own, for differential and relative.
    """

    differential: bool = False
    relative: bool = False
    turning_noise: tuple[float, float, float] = (0.0, 0.0, 0.0)
    memory: PoseMemory = field(default_factory=PoseMemory)


class _Reading(NamedTuple):
    """A pose to be differentiated (None: one that is none): its time (s), along whose axes its twist will be, and what
    turns mask and covariance there.
    """

    stamp: float
    pose: Transform | None
    frame: str
    turn: Quaternion = IDENTITY.rotation


def pose(
    data: PoseData,
    part: Part,
    frames: Frames,
    options: PoseOptions = PoseOptions(),
    child_frame: str = '',
    rates: Sequence[float] = (0.0, 0.0, 0.0),
) -> Prepared:
    """A pose in data.frame_id as a measurement of x, y, z, roll, pitch, yaw in the world frame.

    child_frame: whose pose it is, if not the base frame's. Differential: as a twist along the axes of the base frame
    (of child_frame), whatever frame_id is; rates: (3,) as in twist. Raises MissingTransform.
    """
    values = tuple(data.position) + (0.0, 0.0, 0.0)
    raw = RawMeasurement(X, values, data.covariance, part.mask, None if options.differential else part.memory)
    trans = IDENTITY if options.differential else frames.lookup(frames.world, data.frame_id, data.stamp)
    other_body = child_frame if child_frame != frames.base else ''
    child_from_base = frames.lookup(other_body, frames.base, data.stamp) if other_body else IDENTITY
    q = orientation(raw, data.orientation, 3)
    measured = Transform(tuple(raw.values[POSITION]), q or IDENTITY.rotation)
    if options.differential:
        sound = q is not None and np.isfinite(data.position).all()
        reading = _Reading(data.stamp, measured if sound else None, child_frame or frames.base)
        return _difference(raw, reading, part, frames, options, rates)
    measured = trans @ _since_first(measured @ child_from_base, q, options)
    if not trans.is_identity:
        raw.turn(trans.rotation)
    raw.values[POSITION] = measured.translation
    raw.values[ANGLES] = measured.rpy
    return raw.measurement(data.stamp, part.source, part.threshold, frames.two_d), raw.problems


def without_mounting(rotation: Quaternion, base_from_imu: Transform) -> Quaternion:
    """The robot's orientation where an IMU that is mounted so has the orientation `rotation`.

    The angles of the mounting are subtracted, and what is left is turned by the mounting's yaw, so that a pitch of a
    sensor that looks to the side is a roll of the robot.
    """
    offsets, a = base_from_imu.rpy, rpy_from_quaternion(rotation)
    angles = wrap_exact(a[0] - offsets[0]), wrap_exact(a[1] - offsets[1]), wrap_exact(a[2] - offsets[2])
    return quaternion_from_rpy(*rotate(base_from_imu.turn_of_yaw, angles))


def imu_orientation(
    data: ImuData,
    part: Part,
    frames: Frames,
    options: PoseOptions = PoseOptions(),
    rates: Sequence[float] = (0.0, 0.0, 0.0),
) -> Prepared:
    """An IMU's orientation as a measurement of the robot's roll, pitch, yaw, without those of the mounting.

    Relative and differential as in `pose`. Raises MissingTransform.
    """
    trans = frames.lookup(frames.base, data.frame_id, data.stamp)
    raw, first = _angles_of(data, part, options.differential)
    q = orientation(raw, data.orientation, first)
    rotation, turn = q or IDENTITY.rotation, IDENTITY.rotation
    if not trans.is_identity:
        turn = trans.turn_of_yaw
        rotation = without_mounting(rotation, trans)
    if options.differential:
        reading = _Reading(data.stamp, Transform(rotation=rotation) if q else None, frames.base, turn)
        return _difference(raw, reading, part, frames, options, rates)
    if options.relative:
        rotation = _since_first(Transform(rotation=rotation), q, options).rotation
    if not trans.is_identity:
        raw.turn(turn)
    raw.values[:] = rpy_from_quaternion(rotation)
    return raw.measurement(data.stamp, part.source, part.threshold, frames.two_d), raw.problems


def _angles_of(data, part, differential):
    """The raw measurement of an IMU's three angles, of all six of a pose where it is differentiated, and where in it
    the angles begin.
    """
    if not differential:
        return RawMeasurement(ROLL, (0.0,) * 3, data.orientation_covariance, part.mask, part.memory), 0
    covariance = np.zeros((6, 6))
    covariance[ANGLES, ANGLES] = np.reshape(data.orientation_covariance, (3, 3))
    return RawMeasurement(X, (0.0,) * 6, covariance, (False, False, False) + tuple(part.mask)), 3


def _since_first(measured: Transform, q, options: PoseOptions) -> Transform:
    """The pose relative to the first one that had an orientation, if that is asked for."""
    if not options.relative:
        return measured
    if options.memory.initial is None and q is not None:
        options.memory.initial = measured
    return measured if options.memory.initial is None else options.memory.initial.inverse() @ measured


def _difference(
    raw: RawMeasurement, reading: _Reading, part: Part, frames: Frames, options: PoseOptions, rates: Sequence[float]
) -> Prepared:
    """A pose and the one before it as a twist.

    Its covariance is the sum of both times the time between them, as in robot_localization. The time is that of the
    pose that was kept, not of the message before: a pose that was dropped in between does not make the robot fast.
    """
    stamp, measured, memory = reading.stamp, reading.pose, options.memory
    previous = memory.previous
    if measured is None:
        why = 'the pose holds something that is not a number or no rotation: it cannot be differentiated'
        return None, [*raw.problems, Problem('bad_pose', why)]
    if previous is not None and stamp <= previous[0]:
        why = 'the pose has the stamp of the one before: it cannot be differentiated'
        return None, [*raw.problems, Problem('same_stamp', why)]
    memory.previous = (stamp, measured, raw.covariance.copy())
    if previous is None or not raw.mask.any():
        return None, raw.problems
    dt = stamp - previous[0]
    step = previous[1].inverse() @ measured
    covariance = raw.covariance
    covariance += previous[2]
    covariance *= dt
    if reading.turn != IDENTITY.rotation:
        raw.turn(reading.turn)
    linear, angular = tuple(v / dt for v in step.translation), tuple(a / dt for a in step.rpy)
    data = TwistData(stamp, reading.frame, linear, angular, covariance)
    turned = part._replace(mask=raw.mask, memory=None)
    prepared, problems = twist(data, turned, frames, rates, options.turning_noise)
    return prepared, raw.problems + problems
