"""From a sensor's data to a measurement of the filter's variables: frames, masks, gravity, and what is no data.

The rules are robot_localization's: a pose is brought into the world frame, a twist and an acceleration into the robot's
(with the speed and the acceleration that the sensor has only because it sits off the centre of a turning robot); which
variables count is turned along with the data; an IMU's orientation is that of its mounting, whose roll, pitch and yaw
are taken off. Unlike there, a number that is no number, a variance that is not positive and a quaternion of no length
leave their variables out and are reported, and with two_d_mode no covariance of the forced zeros with the rest is taken
in.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sara_common.planar import wrap_exact
from sara_localization.filters.state import ANGLES, AX, POSITION, RATES, ROLL, TWIST, X
from sara_localization.geometry.rigid import (
    IDENTITY,
    Transform,
    cross,
    multiply,
    normalised,
    quaternion_from_rpy,
    rotate,
    rpy_from_quaternion,
)
from sara_localization.inputs.data import ImuData, PoseData, TwistData
from sara_localization.inputs.sheets import Measurement, Memory, Problem, Sheet

# The source of the zero velocities that are taken in while the robot is parked.
STANDSTILL = 'standstill'


class MissingTransform(Exception):
    """No transform from `source` to `target`."""

    def __init__(self, target, source):
        super().__init__('no transform {} -> {}'.format(source or '(empty frame_id)', target))
        self.target, self.source = target, source


def _lookup(transforms, target: str, source: str, stamp: float) -> Transform:
    source = source.lstrip('/')
    if source == target:
        return IDENTITY
    found = transforms.lookup(target, source, stamp) if source else None
    if found is None:
        raise MissingTransform(target, source)
    return found


Prepared = tuple[Measurement | None, list[Problem]]


@dataclass
class PoseMemory:
    """What a source of poses must remember: the previous (stamp, pose, covariance) to differentiate, the first to
    subtract, and what was worked out of its covariance.
    """

    previous: tuple | None = None
    initial: Transform | None = None
    sheet: Memory = field(default_factory=Memory)


@dataclass(frozen=True)
class PoseOptions:
    """How a source of poses is taken. turning_noise: (3,) see twist; memory: its own, for differential and relative."""

    two_d: bool = False
    threshold: float = float('inf')
    differential: bool = False
    relative: bool = False
    turning_noise: tuple[float, float, float] = (0.0, 0.0, 0.0)
    memory: PoseMemory = field(default_factory=PoseMemory)


def _orientation(sheet: Sheet, q, first: int):
    """The unit quaternion, or no turn (and no angle measured) for one that stands for none."""
    try:
        return normalised(q)
    except ValueError as error:
        if sheet.mask[first : first + 3].any():
            sheet.mask[first : first + 3] = False
            sheet.problems.append(Problem('bad_orientation', str(error)))
        return None


def pose(
    data: PoseData,
    mask,
    source: str,
    transforms,
    world_frame: str,
    options: PoseOptions = PoseOptions(),
    base_frame: str = '',
    child_frame: str = '',
    rates=(0.0, 0.0, 0.0),
) -> Prepared:
    """A pose in data.frame_id as a measurement of x, y, z, roll, pitch, yaw in the world frame.

    mask: which of the six count. child_frame: whose pose it is, if not base_frame's. Relative: taken from the first
    one.
    Differential: the difference to the previous pose as a twist along the axes of base_frame (of child_frame), whatever
    frame_id is; rates: (3,) as in twist. Raises MissingTransform.
    """
    values = tuple(data.position) + (0.0, 0.0, 0.0)
    sheet = Sheet(X, values, data.covariance, mask, None if options.differential else options.memory.sheet)
    trans = IDENTITY if options.differential else _lookup(transforms, world_frame, data.frame_id, data.stamp)
    other_body = child_frame if child_frame != base_frame else ''
    child_from_base = _lookup(transforms, other_body, base_frame, data.stamp) if other_body else IDENTITY
    q = _orientation(sheet, data.orientation, 3)
    measured = Transform(tuple(sheet.values[POSITION]), q or IDENTITY.rotation)
    if options.differential:
        sound = q is not None and np.isfinite(data.position).all()
        return _difference(
            sheet,
            measured if sound else None,
            IDENTITY.rotation,
            data.stamp,
            source,
            transforms,
            base_frame,
            child_frame or base_frame,
            options,
            rates,
        )
    measured = trans @ _since_first(measured @ child_from_base, q, options)
    if not trans.is_identity:
        sheet.turn(trans.rotation)
    sheet.values[POSITION] = measured.translation
    sheet.values[ANGLES] = measured.rpy
    return sheet.measurement(data.stamp, source, options.threshold, options.two_d), sheet.problems


def imu_orientation(
    data: ImuData,
    mask,
    source: str,
    transforms,
    base_frame: str,
    options: PoseOptions = PoseOptions(),
    rates=(0.0, 0.0, 0.0),
) -> Prepared:
    """An IMU's orientation as a measurement of the robot's roll, pitch, yaw; mask: which of the three count.

    The angles of the mounting are subtracted, and what is left is turned by the mounting's yaw, so that a pitch of a
    sensor that looks to the side is a roll of the robot. Relative and differential as in `pose`. Raises
    MissingTransform.
    """
    trans = _lookup(transforms, base_frame, data.frame_id, data.stamp)
    if options.differential:
        covariance = np.zeros((6, 6))
        covariance[ANGLES, ANGLES] = np.reshape(data.orientation_covariance, (3, 3))
        sheet, first = Sheet(X, (0.0,) * 6, covariance, (False, False, False) + tuple(mask)), 3
    else:
        sheet, first = Sheet(ROLL, (0.0,) * 3, data.orientation_covariance, mask, options.memory.sheet), 0
    q = _orientation(sheet, data.orientation, first)
    rotation, turn = q or IDENTITY.rotation, IDENTITY.rotation
    if not trans.is_identity:
        offsets = trans.rpy
        turn = trans.turn_of_yaw
        a = rpy_from_quaternion(rotation)
        angles = wrap_exact(a[0] - offsets[0]), wrap_exact(a[1] - offsets[1]), wrap_exact(a[2] - offsets[2])
        rotation = quaternion_from_rpy(*rotate(turn, angles))
    if options.differential:
        measured = Transform(rotation=rotation) if q else None
        return _difference(
            sheet, measured, turn, data.stamp, source, transforms, base_frame, base_frame, options, rates
        )
    if options.relative:
        rotation = _since_first(Transform(rotation=rotation), q, options).rotation
    if not trans.is_identity:
        sheet.turn(turn)
    sheet.values[:] = rpy_from_quaternion(rotation)
    return sheet.measurement(data.stamp, source, options.threshold, options.two_d), sheet.problems


def _since_first(measured: Transform, q, options: PoseOptions) -> Transform:
    """The pose relative to the first one that had an orientation, if that is asked for."""
    if not options.relative:
        return measured
    if options.memory.initial is None and q is not None:
        options.memory.initial = measured
    return measured if options.memory.initial is None else options.memory.initial.inverse() @ measured


def _difference(
    sheet: Sheet, measured: Transform | None, turn, stamp, source, transforms, base_frame, frame, options, rates
) -> Prepared:
    """A pose (None: one that is none) and the one before it as a twist along the axes of `frame`.

    Its covariance is the sum of both times the time between them, as in robot_localization. The time is that of the
    pose that was kept, not of the message before: a pose that was dropped in between does not make the robot fast.
    """
    if measured is None:
        sheet.problems.append(
            Problem(
                'bad_pose', 'the pose holds something that is not a number or no rotation: it cannot be differentiated'
            )
        )
        return None, sheet.problems
    previous = options.memory.previous
    if previous is not None and stamp <= previous[0]:
        sheet.problems.append(
            Problem('same_stamp', 'the pose has the stamp of the one before: it cannot be differentiated')
        )
        return None, sheet.problems
    options.memory.previous = (stamp, measured, sheet.covariance.copy())
    if previous is None or not sheet.mask.any():
        return None, sheet.problems
    dt = stamp - previous[0]
    step = previous[1].inverse() @ measured
    covariance = sheet.covariance
    covariance += previous[2]
    covariance *= dt
    if turn != IDENTITY.rotation:
        sheet.turn(turn)
    data = TwistData(stamp, frame, tuple(v / dt for v in step.translation), tuple(a / dt for a in step.rpy), covariance)
    prepared, problems = twist(
        data, sheet.mask, source, transforms, base_frame, rates, options.two_d, options.threshold, options.turning_noise
    )
    return prepared, sheet.problems + problems


def twist(
    data: TwistData,
    mask,
    source: str,
    transforms,
    base_frame: str,
    rates,
    two_d: bool = False,
    threshold: float = float('inf'),
    turning_noise=(0.0, 0.0, 0.0),
    memory: Memory | None = None,
) -> Prepared:
    """A twist along the axes of data.frame_id as a measurement of the robot's velocity and rates.

    mask: which of the six count; rates: (3,) the robot's own, for the velocity of a sensor off its centre (o x w).
    turning_noise: (3,) standard deviations of vx, vy, vyaw per rad/s of turning, added to the data's own.
    memory: the source's own. Raises MissingTransform.
    """
    noisy = any(turning_noise)
    sheet = Sheet(TWIST.start, (*data.linear, *data.angular), data.covariance, mask, None if noisy else memory)
    if noisy:
        turning = sheet.values[5] ** 2
        for i, noise in zip((0, 1, 5), turning_noise):
            sheet.covariance[i, i] += noise * noise * turning
    trans = _lookup(transforms, base_frame, data.frame_id or base_frame, data.stamp)
    if not trans.is_identity:
        lever = cross(trans.translation, [float(w) for w in rates])
        turned = rotate(trans.rotation, sheet.values[:3])
        sheet.values[:3] = [v + along for v, along in zip(turned, lever)]
        sheet.values[3:] = rotate(trans.rotation, sheet.values[3:])
        sheet.turn(trans.rotation)
    return sheet.measurement(data.stamp, source, threshold, two_d), sheet.problems


def imu_rates(
    data: ImuData,
    mask,
    source: str,
    transforms,
    base_frame: str,
    two_d: bool = False,
    threshold: float = float('inf'),
    memory: Memory | None = None,
) -> Prepared:
    """What a gyro says as a measurement of the robot's rates; mask: which of the three count. Raises
    MissingTransform.
    """
    sheet = Sheet(RATES.start, data.angular_velocity, data.angular_velocity_covariance, mask, memory)
    trans = _lookup(transforms, base_frame, data.frame_id or base_frame, data.stamp)
    if not trans.is_identity:
        sheet.values[:] = rotate(trans.rotation, sheet.values)
        sheet.turn(trans.rotation)
    return sheet.measurement(data.stamp, source, threshold, two_d), sheet.problems


def acceleration(
    data: ImuData,
    mask,
    source: str,
    transforms,
    base_frame: str,
    state,
    angular_acceleration,
    gravity: float | None = None,
    two_d: bool = False,
    threshold: float = float('inf'),
    relative: bool = False,
    memory: Memory | None = None,
) -> Prepared:
    """An IMU's specific force as a measurement of the robot's acceleration.

    gravity (m/s2) is taken off along the message's orientation, or the state's (15,) where the message has none; None
    leaves it in. relative: the message's orientation is that of the robot since the start, not of the sensor.
    angular_acceleration: (3,) rad/s2 of the robot, for a sensor off its centre. memory: the source's own.
    Raises MissingTransform.
    """
    sheet = Sheet(AX, data.linear_acceleration, data.linear_acceleration_covariance, mask, memory)
    trans = _lookup(transforms, base_frame, data.frame_id or base_frame, data.stamp)
    value = tuple(sheet.values)
    if gravity is not None:
        if not measures(data.orientation_covariance):
            attitude = multiply(quaternion_from_rpy(*state[ANGLES].tolist()), trans.rotation)
        else:
            attitude = _orientation(sheet, data.orientation, 0) or IDENTITY.rotation
            if relative:
                attitude = multiply(attitude, trans.rotation)
        x, y, z, w = attitude
        down = rotate((-x, -y, -z, w), (0.0, 0.0, gravity))
        value = value[0] - down[0], value[1] - down[1], value[2] - down[2]
    if not trans.is_identity:
        arm, robot_rates = trans.translation, state[RATES].tolist()
        a, t = rotate(trans.rotation, value), cross(arm, np.asarray(angular_acceleration, float).tolist())
        c = cross(cross(arm, robot_rates), robot_rates)  # centripetal; t: from the turning that changes
        value = a[0] + t[0] - c[0], a[1] + t[1] - c[1], a[2] + t[2] - c[2]
        sheet.turn(trans.rotation)
    sheet.values[:] = value
    return sheet.measurement(data.stamp, source, threshold, two_d), sheet.problems


def measures(covariance) -> bool:
    """False where the first element is -1: the IMU does not have that part (sensor_msgs/Imu)."""
    first = covariance.item(0) if isinstance(covariance, np.ndarray) else np.asarray(covariance).item(0)
    return abs(first + 1.0) >= 1e-9
