"""From the messages of the inputs to measurements: what is dropped and why, and what must be remembered between
messages.

One Intake serves one filter. It knows the inputs' configurations, keeps their accounts (status.py), their previous
poses (differential, relative), and the extensions that look at messages: covariances of the user's own, noise that
grows with turning, gyro biases, and what is known of a parked robot.
"""

from __future__ import annotations

import contextlib
import math
from typing import NamedTuple

import numpy as np

from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.standstill import Standstill
from sara_localization.filters.state import ANGLES, POSE, RATES, SIZE, TWIST, VYAW
from sara_localization.geometry.rigid import multiply, normalised, quaternion_from_rpy, rpy_from_quaternion
from sara_localization.inputs import measurement
from sara_localization.inputs.data import ImuData, OdometryData, PoseData, Turning, TwistData
from sara_localization.inputs.measurement import MissingTransform, PoseMemory, PoseOptions
from sara_localization.inputs.sheets import Measurement, Memory
from sara_localization.inputs.status import InputStatus

# A message that is this far ahead of the clock (s) would wait for longer than anybody, and all after it would be late.
FUTURE = 10.0


class Motion(NamedTuple):
    """The filter's state (15,) and how its rates change, of the moment, for sensors off the robot's centre."""

    state: np.ndarray
    turning: Turning


class Part(NamedTuple):
    """A part of an input's messages that is asked for. differential: a message that is late is no use; memory: of its
    covariance.
    """

    source: str
    mask: tuple
    status: InputStatus
    differential: bool
    memory: Memory


class Intake:
    """Methods odometry, pose, twist, imu take a message of an input and give its measurements; they never raise for its
    data.

    history_from: stamps (s) from which on a late message can still be put in its place; inf without lagged data.
    now: the time of the last tick (s), inf before the first.
    """

    def __init__(self, config: FilterConfig, transforms, report):
        self.config, self.transforms, self._report = config, transforms, report
        self.inputs: dict[str, InputStatus] = {i.name: InputStatus(i.name, i.topic) for i in config.inputs}
        self._configs = {i.name: i for i in config.inputs}
        self.biases = _bias_states(config)
        gyros = {
            i.name: i.gyro_bias == 'standstill'
            for i in config.inputs
            if i.kind == 'imu' and (config.standstill.update or i.gyro_bias != 'off')
        }
        self.standstill = Standstill(config.standstill, gyros) if gyros else None
        self._wheel_poses: dict[str, tuple] = {}
        self._asked = {i.name: self._parts(i) for i in config.inputs}
        self.forget()

    def _parts(self, i) -> list[Part | None]:
        """Pose, twist and acceleration of an input's messages, None for what none is asked of."""
        first = ANGLES if i.kind == 'imu' else POSE, RATES if i.kind == 'imu' else TWIST, slice(12, SIZE)
        return [
            Part(i.name + part, i.mask[where], self.inputs[i.name], part == '_pose' and i.differential, Memory())
            if any(i.mask[where])
            else None
            for part, where in zip(('_pose', '_twist', '_acceleration'), first)
        ]

    def forget(self):
        """As if nothing had ever come in; the accounts and the gyros' biases stay."""
        self.now = math.inf
        self.history_from = -math.inf if self.config.smooth_lagged_data and self.config.history_length else math.inf
        self._last_stamps: dict[str, float] = {}
        self.forget_poses(0.0)

    def forget_poses(self, until: float):
        """The robot was put somewhere at the time `until` (s): older messages are ignored, poses are followed anew from
        here.
        """
        self._ignore_until = until
        self._options = {
            i.name: PoseOptions(
                self.config.two_d_mode, i.pose_threshold, i.differential, i.relative, i.turning_noise, PoseMemory()
            )
            for i in self.config.inputs
        }
        self._wheel_poses.clear()
        if self.standstill:
            self.standstill.forget_yaw()

    # Messages

    def odometry(self, name: str, data: OdometryData, motion: Motion) -> list[Measurement]:
        """A message of input `name` (odomN)."""
        config = self._configs[name]
        if not self._accept(name, data.stamp):
            return []
        if self.standstill:
            self._watch_wheels(name, data)
        child = data.child_frame_id.lstrip('/') if config.pose_use_child_frame else ''
        found, (pose, twist, _) = [], self._asked[name]
        if pose:
            self._pose(found, name, data.pose, motion, child)
        if twist:
            self._twist(found, name, data.twist, motion)
        return found

    def pose(self, name: str, data: PoseData, motion: Motion) -> list[Measurement]:
        """A message of input `name` (poseN)."""
        found = []
        if self._accept(name, data.stamp) and self._asked[name][0]:
            self._pose(found, name, data, motion, '')
        return found

    def twist(self, name: str, data: TwistData, motion: Motion) -> list[Measurement]:
        """A message of input `name` (twistN)."""
        if not self._accept(name, data.stamp):
            return []
        if self.standstill:
            self.standstill.wheels(data.stamp, data.linear, data.angular)
        found = []
        if self._asked[name][1]:
            self._twist(found, name, data, motion)
        return found

    def imu(self, name: str, data: ImuData, motion: Motion) -> list[Measurement]:
        """A message of input `name` (imuN)."""
        config = self._configs[name]
        if not self._accept(name, data.stamp):
            return []
        if config.covariances:
            data = _with_covariances(
                data, config.covariances, ('orientation', 'angular_velocity', 'linear_acceleration')
            )
        found = []
        if self.standstill and name in self.standstill.gyros:
            data = self._watch_gyro(config, data)
            if self.standstill.parked and (self.config.standstill.update or name in self.biases):
                at_rest = TWIST if self.config.standstill.update else RATES
                zeros = np.zeros(at_rest.stop - at_rest.start)
                found.append(
                    Measurement(
                        data.stamp,
                        measurement.STANDSTILL,
                        tuple(range(at_rest.start, at_rest.stop)),
                        zeros,
                        np.eye(len(zeros)) * self.config.standstill.variance,
                    )
                )
        angles, rates, accelerations = self._asked[name]
        frame, two_d = self.config.base_link_frame, self.config.two_d_mode
        if angles and measurement.measures(data.orientation_covariance):
            self._prepare(
                found,
                angles,
                data.stamp,
                measurement.imu_orientation,
                data,
                angles.mask,
                angles.source,
                self.transforms,
                frame,
                self._options[name],
                motion.state[RATES],
            )
        if (
            rates
            and measurement.measures(data.angular_velocity_covariance)
            and (
                self._prepare(
                    found,
                    rates,
                    data.stamp,
                    measurement.imu_rates,
                    data,
                    rates.mask,
                    rates.source,
                    self.transforms,
                    frame,
                    two_d,
                    config.twist_threshold,
                    rates.memory,
                )
                and name in self.biases
            )
        ):
            found[-1] = self._with_bias(name, found[-1])
        if accelerations and measurement.measures(data.linear_acceleration_covariance):
            gravity = self.config.gravitational_acceleration if config.remove_gravity else None
            self._prepare(
                found,
                accelerations,
                data.stamp,
                measurement.acceleration,
                data,
                accelerations.mask,
                accelerations.source,
                self.transforms,
                frame,
                motion.state,
                motion.turning.acceleration()[0],
                gravity,
                two_d,
                config.acceleration_threshold,
                config.relative,
                accelerations.memory,
            )
        return found

    # Their parts

    def _pose(self, found, name, data, motion, child):
        config, part = self._configs[name], self._asked[name][0]
        if 'pose' in config.covariances:
            data = data._replace(covariance=config.covariances['pose'])
        self._prepare(
            found,
            part,
            data.stamp,
            measurement.pose,
            data,
            part.mask,
            part.source,
            self.transforms,
            self.config.world_frame,
            self._options[name],
            self.config.base_link_frame,
            child,
            motion.state[RATES],
        )

    def _twist(self, found, name, data, motion):
        config, part = self._configs[name], self._asked[name][1]
        if 'twist' in config.covariances:
            data = data._replace(covariance=config.covariances['twist'])
        self._prepare(
            found,
            part,
            data.stamp,
            measurement.twist,
            data,
            part.mask,
            part.source,
            self.transforms,
            self.config.base_link_frame,
            motion.state[RATES],
            self.config.two_d_mode,
            config.twist_threshold,
            config.turning_noise,
            part.memory,
        )

    def _prepare(self, found, part, stamp, prepare, *arguments) -> bool:
        """Append prepare(*arguments), a part of a message, to the found, unless it is older than its predecessor and
        cannot be put in its place. Returns whether there is one.
        """
        status, last = part.status, self._last_stamps.get(part.source, stamp)
        if stamp < last:
            if part.differential or stamp < self.history_from:
                self._problem(
                    status, 'out_of_order', f'the message at {stamp:.3f} s is older than the one before it: ignored'
                )
                return False
        else:
            self._last_stamps[part.source] = stamp
        try:
            prepared, problems = prepare(*arguments)
        except MissingTransform as error:
            self._say(status.lacks(str(error), stamp))
            return False
        status.missing = None
        for problem in problems:
            self._problem(status, problem.kind, problem.sentence)
        if prepared is None:
            return False
        found.append(prepared)
        return True

    def _accept(self, name, stamp) -> bool:
        status = self.inputs[name]
        status.received += 1
        if not math.isfinite(stamp) or stamp <= 0.0:
            self._problem(status, 'no_stamp', 'the message has no time stamp')
        elif stamp > self.now + FUTURE:
            self._problem(
                status,
                'from_the_future',
                'the message is %.1f s ahead of the clock: ignored; are the clocks of all '
                'computers the same, and use_sim_time?' % (stamp - self.now),
            )
        elif stamp <= self._ignore_until:
            self._problem(status, 'before_set_pose', 'the message is not newer than the last set_pose: ignored')
        else:
            status.last_stamp = stamp
            return True
        return False

    def _problem(self, status, kind, sentence):
        self._say(status.has_problem(kind, sentence))

    def _say(self, sentence):
        if sentence:
            self._report(sentence)

    # Extensions

    def _with_bias(self, name, m: Measurement) -> Measurement:
        biases = self.biases[name]
        return m._replace(extra=tuple(biases.get(i, -1) for i in m.indices))

    def _watch_wheels(self, name, data: OdometryData):
        """Tell the standstill detector what the wheels did: what they say, and what their pose says."""
        linear, before = data.linear, self._wheel_poses.get(name)
        if before is not None and data.stamp > before[0]:
            moved = math.dist(data.position, before[1])
            if moved > self.config.standstill.linear_velocity * (data.stamp - before[0]):
                linear = (math.inf, 0.0, 0.0)
        self._wheel_poses[name] = data.stamp, tuple(data.position)
        self.standstill.wheels(data.stamp, linear, data.angular)

    def _watch_gyro(self, config, data: ImuData) -> ImuData:
        """Tell the standstill detector what an IMU says, and take off the data what is known to be wrong with it."""
        finite = np.isfinite(data.angular_velocity).all() and measurement.measures(data.angular_velocity_covariance)
        force = (
            measurement.measures(data.linear_acceleration_covariance) and np.isfinite(data.linear_acceleration).all()
        )
        yaw = None
        if measurement.measures(data.orientation_covariance):
            with contextlib.suppress(ValueError):
                yaw = rpy_from_quaternion(normalised(data.orientation))[2]
        claimed = float(np.max(np.reshape(data.angular_velocity_covariance, (3, 3)).diagonal()))
        sigma = math.sqrt(claimed) if 0.0 < claimed < math.inf else 0.0
        gyro = self.standstill.gyro(
            config.name,
            data.stamp,
            np.array(data.angular_velocity) if finite else None,
            np.array(data.linear_acceleration) if force else None,
            yaw,
            sigma,
        )
        changes = {}
        holding = self.config.standstill.update
        if config.gyro_bias != 'state' and finite:
            if holding and self.standstill.parked:
                changes['angular_velocity'] = (0.0, 0.0, 0.0)
            elif config.gyro_bias == 'standstill':
                changes['angular_velocity'] = tuple(float(w - b) for w, b in zip(data.angular_velocity, gyro.bias))
        if holding and yaw is not None:
            back = quaternion_from_rpy(0.0, 0.0, -gyro.yaw_offset(data.stamp))
            changes['orientation'] = multiply(back, normalised(data.orientation))
        return data._replace(**changes) if changes else data


def _bias_states(config: FilterConfig) -> dict[str, dict[int, int]]:
    """For each IMU whose bias is a state: from the measured rate (9..11) to the index of its bias behind the 15
    variables.
    """
    found, following = {}, SIZE
    for i in config.inputs:
        if i.gyro_bias == 'state':
            rates = (VYAW,) if config.two_d_mode else range(RATES.start, RATES.stop)
            found[i.name] = {rate: following + k for k, rate in enumerate(rates)}
            following += len(found[i.name])
    return found


def _with_covariances(data, covariances, parts):
    """The data with the user's covariances in the place of its own, but for a part that says it is not measured."""
    changes = {
        part + '_covariance': covariances[part]
        for part in parts
        if part in covariances and measurement.measures(getattr(data, part + '_covariance'))
    }
    return data._replace(**changes) if changes else data
