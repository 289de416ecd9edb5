"""From the messages of the inputs to measurements: what is dropped and why, and what must be remembered between
messages.

One Preprocessor serves one filter. It knows the inputs' configurations, keeps their accounts (status.py), their
previous poses (differential, relative), and the extensions that look at messages: covariances of the user's own, noise
that grows with turning, gyro biases, and what is known of a parked robot (standstill_watch.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sara_localization.config.filter_config import FilterConfig, InputConfig
from sara_localization.filters.standstill import Standstill
from sara_localization.filters.state import ANGLES, POSE, RATES, SIZE, TWIST, VYAW
from sara_localization.geometry.transforms import Transforms
from sara_localization.inputs import measurement, poses
from sara_localization.inputs.correlation import Correlation
from sara_localization.inputs.data import ImuData, OdometryData, PoseData, Turning, TwistData
from sara_localization.inputs.measurement import Frames, Gravity, MissingTransform, Part, measures
from sara_localization.inputs.poses import PoseMemory, PoseOptions
from sara_localization.inputs.raw_measurement import Measurement, Memory
from sara_localization.inputs.standstill_watch import StandstillWatch
from sara_localization.inputs.status import InputStatus

# A message that is this far ahead of the clock (s) would wait as long, and all after it would be late meanwhile.
FUTURE = 1.0


class Motion(NamedTuple):
    """The filter's state (15,) and how its rates change, of the moment, for sensors off the robot's centre."""

    state: np.ndarray
    turning: Turning


class Asked(NamedTuple):
    """A part of an input's messages that is asked for, and the input's account. differential: a message that is late is
    no use. correlation: of errors that persist.
    """

    part: Part
    status: InputStatus
    differential: bool
    correlation: Correlation | None = None


class Preprocessor:
    """Methods odometry, pose, twist, imu take a message of an input and give its measurements; they never raise for its
    data.

    history_from: stamps (s) from which on a late message can still be put in its place; inf without lagged data.
    now: the newest time that the engine was told (s), inf before any: then nothing is known to be ahead of it.
    """

    def __init__(self, config: FilterConfig, transforms: Transforms, report: Callable[[str], None]):
        self.config, self._report = config, report
        self.inputs: dict[str, InputStatus] = {i.name: InputStatus(i.name, i.topic) for i in config.inputs}
        self._configs = {i.name: i for i in config.inputs}
        self._frames = Frames(transforms, config.world_frame, config.base_link_frame, config.two_d_mode)
        self.biases = _bias_states(config)
        self._watch = StandstillWatch.of(config, self.biases)
        self._asked = {i.name: self._parts(i) for i in config.inputs}
        self._gravity = {
            i.name: Gravity(config.gravitational_acceleration if i.remove_gravity else None, i.relative)
            for i in config.inputs
        }
        self.forget()

    @property
    def standstill(self) -> Standstill | None:
        """What is known of a parked robot; None where no extension asks for it."""
        return self._watch.standstill if self._watch else None

    def _parts(self, i: InputConfig) -> list[Asked | None]:
        """Pose, twist and acceleration of an input's messages, None for what none is asked of."""
        where = ANGLES if i.kind == 'imu' else POSE, RATES if i.kind == 'imu' else TWIST, slice(12, SIZE)
        thresholds = i.pose_threshold, i.twist_threshold, i.acceleration_threshold
        return [
            Asked(
                Part(i.name + part, i.mask[variables], threshold, Memory()),
                self.inputs[i.name],
                part == '_pose' and i.differential,
                _correlation(i) if part == '_pose' else None,
            )
            if any(i.mask[variables])
            else None
            for part, variables, threshold in zip(('_pose', '_twist', '_acceleration'), where, thresholds)
        ]

    def forget(self) -> None:
        """As if nothing had ever come in; the accounts and the gyros' biases stay."""
        self.now = math.inf
        self.history_from = -math.inf if self.config.smooth_lagged_data and self.config.history_length else math.inf
        self._last_stamps: dict[str, float] = {}
        if self._watch:
            self._watch.standstill.forget()
        self.forget_poses(0.0)

    def forget_poses(self, until: float) -> None:
        """The robot was put somewhere at the time `until` (s): older messages are ignored, poses are followed anew from
        here.
        """
        self._ignore_until = until
        self._options = {
            i.name: PoseOptions(i.differential, i.relative, i.turning_noise, PoseMemory()) for i in self.config.inputs
        }
        if self._watch:
            self._watch.forget_poses()
        for pose, *_ in self._asked.values():
            if pose and pose.correlation:
                pose.correlation.forget()

    # Messages

    def odometry(self, name: str, data: OdometryData, motion: Motion) -> list[Measurement]:
        """A message of input `name` (odomN)."""
        if not self._accept(name, data.stamp):
            return []
        if self._watch:
            self._watch.odometry(name, data)
        child = data.child_frame_id.lstrip('/') if self._configs[name].pose_use_child_frame else ''
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
        if self._watch:
            self._watch.standstill.wheels(data.stamp, data.linear, data.angular)
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
            data = _with_covariances(data, config.covariances)
        found = []
        if self._watch and name in self._watch.standstill.gyros:
            data = self._watch.imu(config, data)
            found += self._watch.at_rest(name, data.stamp)
        angles, rates, accelerations = self._asked[name]
        if angles and measures(data.orientation_covariance):
            self._prepare(found, angles, poses.imu_orientation, data, self._options[name], motion.state[RATES])
        if rates and measures(data.angular_velocity_covariance):
            measured = self._prepare(found, rates, measurement.imu_rates, data)
            if measured and name in self.biases:
                found[-1] = self._with_bias(name, found[-1])
        if accelerations and measures(data.linear_acceleration_covariance):
            turning = motion.turning.acceleration()
            gravity = self._gravity[name]
            self._prepare(found, accelerations, measurement.acceleration, data, motion.state, turning, gravity)
        return found

    def took(self, name: str, m: Measurement, taken: bool, nis: float) -> None:
        """What became of a measurement of input `name`: used, or rejected by the gate; nis: its squared distance."""
        status = self.inputs[name]
        status.took(taken, nis, m.informative)
        told = status.outliers.judged(m, taken, nis)
        if told:
            self._report(told)

    # Their parts

    def _pose(self, found, name, data, motion, child):
        given = self._configs[name].covariances
        if 'pose' in given:
            data = data._replace(covariance=given['pose'])
        asked, options = self._asked[name][0], self._options[name]
        self._prepare(found, asked, poses.pose, data, options, child, motion.state[RATES])

    def _twist(self, found, name, data, motion):
        config = self._configs[name]
        if 'twist' in config.covariances:
            data = data._replace(covariance=config.covariances['twist'])
        self._prepare(found, self._asked[name][1], measurement.twist, data, motion.state[RATES], config.turning_noise)

    def _prepare(self, found, asked, prepare, data, *arguments) -> bool:
        """Append what `prepare` makes of a part of a message to the found, unless it is older than its predecessor and
        cannot be put in its place. Returns whether there is one.
        """
        part, status, differential, correlation = asked
        stamp = data.stamp
        if stamp < self._last_stamps.get(part.source, stamp):
            if differential or stamp < self.history_from:
                sentence = f'the message at {stamp:.3f} s is older than the one before it: ignored'
                self._problem(status, 'out_of_order', sentence)
                return False
        else:
            self._last_stamps[part.source] = stamp
        try:
            prepared, problems = prepare(data, part, self._frames, *arguments)
        except MissingTransform as error:
            self._say(status.lacks(str(error), stamp))
            return False
        status.missing = None
        for problem in problems:
            self._problem(status, problem.kind, problem.sentence)
        if prepared is None:
            return False
        if correlation:
            prepared = prepared._replace(inflation=correlation.inflation(stamp))
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

    def _with_bias(self, name, m: Measurement) -> Measurement:
        biases = self.biases[name]
        return m._replace(extra=tuple(biases.get(i, -1) for i in m.indices))


def _correlation(i: InputConfig) -> Correlation | None:
    return Correlation(i.correlation_time) if i.correlation_time and not i.differential else None


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


def _with_covariances(data: ImuData, covariances: dict[str, np.ndarray]) -> ImuData:
    """The data with the user's covariances in the place of its own, but for a part that says it is not measured."""
    changes = {
        part + '_covariance': covariances[part]
        for part in ('orientation', 'angular_velocity', 'linear_acceleration')
        if part in covariances and measures(getattr(data, part + '_covariance'))
    }
    return data._replace(**changes) if changes else data
