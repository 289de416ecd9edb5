"""One input of the filter: its configuration, and how it is read from the parameters odomN, poseN, twistN, imuN and
theirs.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sara_localization.config.parameters import ParameterReader
from sara_localization.filters.state import AX, NAMES, SIZE

# Which of the 15 variables each kind of input can measure.
MEASURES = {'odom': range(0, 12), 'pose': range(0, 6), 'twist': range(6, 12), 'imu': (3, 4, 5, 9, 10, 11, 12, 13, 14)}
THRESHOLDS = {'odom': ('pose', 'twist'), 'imu': ('pose', 'twist', 'linear_acceleration'), 'pose': (), 'twist': ()}
CORRELATED = {'odom': 'pose_', 'pose': '', 'imu': 'orientation_'}
# The covariances that a parameter can put in the place of the messages' own: parameter, (what, size).
COVARIANCES = {
    'odom': (('pose', 6), ('twist', 6)),
    'pose': (('pose', 6),),
    'twist': (('twist', 6),),
    'imu': (('orientation', 3), ('angular_velocity', 3), ('linear_acceleration', 3)),
}
INPUT = re.compile(r'^(odom|pose|twist|imu)(\d+)(?:_(.+))?$')


@dataclass(frozen=True)
class InputConfig:
    """One input: its name (odom0), kind, topic, the (15,) mask of variables, the gates in sigmas.

    Extensions: `covariances` in the place of the messages' own, by part (pose, twist, orientation, angular_velocity,
    linear_acceleration); `correlation_time`: s over which the errors of its poses (an IMU's: orientations) persist, 0
    for none; `turning_noise`: standard deviations of vx, vy (m/s) and vyaw (rad/s) that grow with each
    rad/s of turning; `gyro_bias`: 'off', 'standstill' (measured while parked) or 'state' (estimated as a state), its
    noise in (rad/s)2 per s and its variance at the start in (rad/s)2.
    """

    name: str
    kind: str
    topic: str
    mask: tuple[bool, ...]
    queue_size: int = 1
    remove_gravity: bool = False
    pose_threshold: float = math.inf
    twist_threshold: float = math.inf
    acceleration_threshold: float = math.inf
    differential: bool = False
    relative: bool = False
    pose_use_child_frame: bool = False
    nodelay: bool = False
    correlation_time: float = 0.0
    covariances: dict[str, np.ndarray] = field(default_factory=dict)
    turning_noise: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gyro_bias: str = 'off'
    gyro_bias_noise: float = 1e-10
    gyro_bias_variance: float = 1e-4


class InputReader(ParameterReader):
    """Reads the parameters of the inputs; what is wrong is collected in faults, what is doubtful in warnings."""

    def mask(self, name: str, kind: str) -> Any:
        flags = self.flags(name, SIZE, ' '.join(NAMES))
        if flags is None:
            return None
        impossible = [NAMES[i] for i in range(SIZE) if flags[i] and i not in MEASURES[kind]]
        if impossible:
            self.warnings.append(
                '{} asks for {}, which an input of this kind does not measure: left out.'.format(
                    name, ', '.join(impossible)
                )
            )
        flags = tuple(flag and i in MEASURES[kind] for i, flag in enumerate(flags))
        if not any(flags):
            self.warnings.append(f'{name} takes nothing: the input is of no use.')
        return flags

    def input(self, kind: str, index: int) -> Any:
        name = f'{kind}{index}'
        topic = self.take(name)
        if not isinstance(topic, str) or not topic:
            self.faults.append(f'{name} is {topic!r}, allowed is the name of a topic')
        # Without a list nothing is doubtful about what is taken: then everything counts as taken that no other setting
        # minds.
        mask = self.mask(name + '_config', kind) or tuple(i in MEASURES[kind] and i < AX for i in range(SIZE))
        values = {}
        queue_size = values['queue_size'] = self.take(name + '_queue_size', 1)
        if isinstance(queue_size, bool) or not isinstance(queue_size, int) or queue_size < 0:
            self.faults.append(f'{name}_queue_size is {queue_size!r}, allowed is a whole number of messages')
        values['nodelay'] = self.boolean(name + '_nodelay', False)
        if kind != 'twist':
            self.pose_options(name, kind, mask, values)
        if kind == 'odom':
            values['pose_use_child_frame'] = self.boolean(name + '_pose_use_child_frame', False)
        for part in THRESHOLDS[kind]:
            values[part.replace('linear_', '') + '_threshold'] = self.number(
                f'{name}_{part}_rejection_threshold', 1.7e308, low=0.0
            )
        if kind in ('pose', 'twist'):
            values[kind + '_threshold'] = self.number(f'{name}_rejection_threshold', 1.7e308, low=0.0)
        covariances = {
            part: self.covariance(f'{name}_{part}_covariance', size, positive=True) for part, size in COVARIANCES[kind]
        }
        values['covariances'] = {part: matrix for part, matrix in covariances.items() if matrix is not None}
        if kind in ('odom', 'twist'):
            values['turning_noise'] = self.numbers(name + '_turning_noise', 3, (0.0,) * 3, low=0.0)
        if kind == 'imu':
            self.imu_options(name, mask, values)
        return InputConfig(name, kind, topic, mask, **values)

    def pose_options(self, name: str, kind: str, mask: tuple[bool, ...], values: dict[str, object]) -> None:
        parameter = f'{name}_{CORRELATED[kind]}correlation_time'
        correlated = values['correlation_time'] = self.number(parameter, 0.0, low=0.0)
        differential = values['differential'] = self.boolean(name + '_differential', False)
        relative = values['relative'] = self.boolean(name + '_relative', False)
        if differential and relative:
            self.warnings.append(
                f'{name}_differential and {name}_relative are both true: differential is used, relative has no '
                'effect; set it to false.'
            )
            values['relative'] = False
        elif (differential or relative) and not any(mask[:6]):
            self.warnings.append(
                '{}_{} has no effect: {}_config takes neither position nor orientation.'.format(
                    name, 'differential' if differential else 'relative', name
                )
            )
        if differential and correlated:
            self.warnings.append(f'{parameter} has no effect: {name}_differential is true.')

    def imu_options(self, name: str, mask: tuple[bool, ...], values: dict[str, object]) -> None:
        values['remove_gravity'] = self.boolean(name + '_remove_gravitational_acceleration', False)
        bias = values['gyro_bias'] = self.choice(name + '_gyro_bias', ('off', 'standstill', 'state'))
        values['gyro_bias_noise'] = self.number(name + '_gyro_bias_noise', 1e-10, low=0.0)
        values['gyro_bias_variance'] = self.number(name + '_gyro_bias_variance', 1e-4, above=0.0)
        if bias != 'off' and not any(mask[9:12]):
            self.warnings.append(f'{name}_gyro_bias has no effect: {name}_config takes no angular velocity.')

    def inputs(self) -> Any:
        found = []
        for kind in MEASURES:
            index = 0
            while f'{kind}{index}' in self.left:
                found.append(self.input(kind, index))
                index += 1
        return tuple(found)
