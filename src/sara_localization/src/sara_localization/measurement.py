"""From a sensor's data to a measurement of the filter's variables: frames, masks, gravity, and what is no data.

The rules are robot_localization's: a pose is brought into the world frame, a twist and an acceleration into the robot's
(with the speed and the acceleration that the sensor has only because it sits off the centre of a turning robot); which
variables count is turned along with the data; an IMU's orientation is that of its mounting, whose roll, pitch and yaw are
taken off. Unlike there, a number that is no number, a variance that is not positive and a quaternion of no length leave
their variables out and are reported, and with two_d_mode no covariance of the forced zeros with the rest is taken in.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from .data import ImuData, PoseData, TwistData
from .geometry import IDENTITY, Transform, cross, normalised, quaternion_from_rpy, rotate, rotation_matrix, wrap
from .state import ANGLES, AX, NAMES, OFF_PLANE, POSITION, RATES, SIZE, TWIST, X

OFF_PLANE_VARIANCE = 1e-6
# Drivers write "I do not measure this" as a very large variance; squared, it would no longer be a number.
LARGEST_VARIANCE = 1e15


class Problem(NamedTuple):
    """Something wrong with a message: its kind (counted by it) and a sentence for the user."""

    kind: str
    sentence: str


@dataclass(frozen=True)
class Measurement:
    """k of the state's variables at a time: indices, z (k,), R (k, k) and the gate in sigmas."""

    stamp: float
    source: str
    indices: Tuple[int, ...]
    z: np.ndarray
    R: np.ndarray
    threshold: float = float('inf')


class MissingTransform(Exception):
    """No transform from `source` to `target`."""

    def __init__(self, target, source):
        super().__init__('no transform %s -> %s' % (source or '(empty frame_id)', target))
        self.target, self.source = target, source


def _lookup(transforms, target: str, source: str, stamp: float) -> Transform:
    source = source.lstrip('/')
    if source == target:
        return IDENTITY
    found = transforms.lookup(target, source, stamp) if source else None
    if found is None:
        raise MissingTransform(target, source)
    return found


class _Sheet:
    """Up to 15 variables being prepared: values, covariance, which are measured, what was wrong."""

    def __init__(self, first: int, values, covariance, mask):
        n = len(values)
        self.first, self.problems = first, []
        self.values = np.array(values, dtype=float)
        self.covariance = np.array(covariance, dtype=float).reshape(n, n)
        self.mask = np.array(mask, dtype=bool)
        self._sift()

    def _sift(self):
        """Leave out what is measured but no data; zero what is neither, so that it cannot spread by a rotation."""
        variances = self.covariance.diagonal()
        sound = bool(np.isfinite(self.values).all() and np.isfinite(self.covariance).all())
        if sound and (variances[self.mask] > 0.0).all() and (variances[self.mask] < LARGEST_VARIANCE).all():
            return
        covariance = self.covariance
        for i in np.flatnonzero(~self.mask):
            if not (np.isfinite(self.values[i]) and abs(variances[i]) < LARGEST_VARIANCE):
                self.values[i] = 0.0
                covariance[i, :] = covariance[:, i] = 0.0
            covariance[i, ~np.isfinite(covariance[i])] = 0.0
            covariance[~np.isfinite(covariance[:, i]), i] = 0.0
        for i in np.flatnonzero(self.mask):
            name, variance = NAMES[self.first + i], float(variances[i])
            if not np.isfinite(self.values[i]):
                self._leave_out(i, 'not_finite', '%s is %s' % (name, self.values[i]))
            elif not np.isfinite(variance):
                self._leave_out(i, 'not_finite', 'the variance of %s is %s' % (name, variance))
            elif variance <= 0.0:
                self._leave_out(i, 'bad_variance', 'the variance of %s is %g and %s is left out; its sensor must state a '
                                'positive one' % (name, variance, name))
            elif variance >= LARGEST_VARIANCE:
                self._leave_out(i, 'huge_variance', 'the variance of %s is %g' % (name, variance))
        for i in np.flatnonzero(self.mask):
            if not np.isfinite(covariance[i]).all() or not np.isfinite(covariance[:, i]).all():
                name, variance = NAMES[self.first + i], float(variances[i])
                self.problems.append(Problem('not_finite', 'a covariance of %s is not a number: taken as 0' % name))
                covariance[i, :] = covariance[:, i] = 0.0
                covariance[i, i] = variance

    def _leave_out(self, i, kind, sentence):
        self.mask[i] = False
        self.values[i] = 0.0
        self.covariance[i, :] = self.covariance[:, i] = 0.0
        self.problems.append(Problem(kind, sentence))

    def turn(self, R: np.ndarray):
        """Turn mask and covariance, three variables at a time, by the (3, 3) matrix R."""
        n = len(self.values)
        full = np.zeros((n, n))
        for k in range(0, n, 3):
            full[k:k + 3, k:k + 3] = R
            self.mask[k:k + 3] = np.sqrt(((R * self.mask[k:k + 3]) ** 2).sum(axis=1)) >= 1e-6
        self.covariance = full @ self.covariance @ full.T

    def measurement(self, stamp, source, threshold, two_d: bool) -> Optional[Measurement]:
        if not self.mask.any():
            return None
        first, n = self.first, len(self.values)
        mask = np.zeros(SIZE, dtype=bool)
        mask[first:first + n] = self.mask
        z, R = np.zeros(SIZE), np.zeros((SIZE, SIZE))
        z[first:first + n] = self.values
        R[first:first + n, first:first + n] = self.covariance
        if two_d:
            for i in OFF_PLANE:
                mask[i], z[i] = True, 0.0
                R[i, :] = R[:, i] = 0.0
                R[i, i] = OFF_PLANE_VARIANCE
        indices = np.flatnonzero(mask)
        R = R[indices[:, None], indices]
        if not _positive(R):
            self.problems.append(Problem('indefinite_covariance',
                                         'the covariance is not positive definite: only its diagonal is used'))
            R = np.diag(np.maximum(R.diagonal(), 1e-9))
        return Measurement(stamp, source, tuple(indices.tolist()), z[indices], R, threshold)


def _positive(R) -> bool:
    if np.count_nonzero(R) <= len(R):
        return True
    try:
        np.linalg.cholesky(0.5 * (R + R.T))
        return True
    except np.linalg.LinAlgError:
        return False


Prepared = Tuple[Optional[Measurement], List[Problem]]


def _orientation(sheet: _Sheet, q, first: int):
    """The unit quaternion, or no turn (and no angle measured) for one that stands for none."""
    try:
        return normalised(q)
    except ValueError as error:
        if sheet.mask[first:first + 3].any():
            sheet.mask[first:first + 3] = False
            sheet.problems.append(Problem('bad_orientation', str(error)))
        return IDENTITY.rotation


def pose(data: PoseData, mask, source: str, transforms, world_frame: str, two_d: bool = False,
         threshold: float = float('inf')) -> Prepared:
    """A pose in data.frame_id as a measurement of x, y, z, roll, pitch, yaw in the world frame.

    mask: which of the six count. Raises MissingTransform.
    """
    values = tuple(data.position) + (0.0, 0.0, 0.0)
    sheet = _Sheet(X, values, data.covariance, mask)
    trans = _lookup(transforms, world_frame, data.frame_id, data.stamp)
    q = _orientation(sheet, data.orientation, 3)
    in_world = trans @ Transform(tuple(sheet.values[POSITION].tolist()), q)
    if not trans.is_identity:
        sheet.turn(rotation_matrix(trans.rotation))
    sheet.values[POSITION] = in_world.translation
    sheet.values[ANGLES] = in_world.rpy
    return sheet.measurement(data.stamp, source, threshold, two_d), sheet.problems


def imu_orientation(data: ImuData, mask, source: str, transforms, base_frame: str, two_d: bool = False,
                    threshold: float = float('inf')) -> Prepared:
    """An IMU's orientation as a measurement of the robot's roll, pitch, yaw; mask: which of the three count.

    The angles of the mounting are subtracted, and what is left is turned by the mounting's yaw, so that a pitch of a sensor
    that looks to the side is a roll of the robot. Raises MissingTransform.
    """
    covariance = np.zeros((6, 6))
    covariance[ANGLES, ANGLES] = np.reshape(data.orientation_covariance, (3, 3))
    sheet = _Sheet(X, np.zeros(6), covariance, (False, False, False) + tuple(mask))
    trans = _lookup(transforms, base_frame, data.frame_id, data.stamp)
    measured = Transform(rotation=_orientation(sheet, data.orientation, 3)).rpy
    if not trans.is_identity:
        offsets = trans.rpy
        turn = quaternion_from_rpy(0.0, 0.0, offsets[2])
        angles = rotate(turn, tuple(wrap(a - offset) for a, offset in zip(measured, offsets)))
        measured = Transform.from_xyz_rpy(0.0, 0.0, 0.0, *angles).rpy
        sheet.turn(rotation_matrix(turn))
    sheet.values[ANGLES] = measured
    return sheet.measurement(data.stamp, source, threshold, two_d), sheet.problems


def twist(data: TwistData, mask, source: str, transforms, base_frame: str, rates, two_d: bool = False,
          threshold: float = float('inf')) -> Prepared:
    """A twist along the axes of data.frame_id as a measurement of the robot's velocity and rates.

    mask: which of the six count; rates: (3,) the robot's own, for the velocity of a sensor off its centre (o x w).
    Raises MissingTransform.
    """
    sheet = _Sheet(TWIST.start, tuple(data.linear) + tuple(data.angular), data.covariance, mask)
    trans = _lookup(transforms, base_frame, data.frame_id or base_frame, data.stamp)
    if not trans.is_identity:
        values = sheet.values.tolist()
        lever = cross(trans.translation, [float(w) for w in rates])
        sheet.values[:3] = np.add(rotate(trans.rotation, values[:3]), lever)
        sheet.values[3:] = rotate(trans.rotation, values[3:])
        sheet.turn(rotation_matrix(trans.rotation))
    return sheet.measurement(data.stamp, source, threshold, two_d), sheet.problems


def acceleration(data: ImuData, mask, source: str, transforms, base_frame: str, state, angular_acceleration,
                 gravity: Optional[float] = None, two_d: bool = False, threshold: float = float('inf')) -> Prepared:
    """An IMU's specific force as a measurement of the robot's acceleration.

    gravity (m/s2) is taken off along the message's orientation, or the state's (15,) where the message has none; None
    leaves it in. angular_acceleration: (3,) rad/s2 of the robot, for a sensor off its centre. Raises MissingTransform.
    """
    sheet = _Sheet(AX, data.linear_acceleration, data.linear_acceleration_covariance, mask)
    trans = _lookup(transforms, base_frame, data.frame_id or base_frame, data.stamp)
    value = tuple(sheet.values.tolist())
    if gravity is not None:
        if not measures(data.orientation_covariance):
            attitude = (Transform(rotation=quaternion_from_rpy(*state[ANGLES])) @ Transform(rotation=trans.rotation))
        else:
            attitude = Transform(rotation=_orientation(sheet, data.orientation, 0))
        down = attitude.inverse().apply((0.0, 0.0, gravity))
        value = tuple(a - g for a, g in zip(value, down))
    if not trans.is_identity:
        arm, rates = trans.translation, state[RATES].tolist()
        turning = cross(arm, [float(a) for a in angular_acceleration])
        centripetal = cross(cross(arm, rates), rates)
        value = tuple(a + t - c for a, t, c in zip(rotate(trans.rotation, value), turning, centripetal))
        sheet.turn(rotation_matrix(trans.rotation))
    sheet.values[:] = value
    return sheet.measurement(data.stamp, source, threshold, two_d), sheet.problems


def measures(covariance) -> bool:
    """False where the first element is -1: the IMU does not have that part (sensor_msgs/Imu)."""
    return abs(float(np.ravel(covariance)[0]) + 1.0) >= 1e-9
