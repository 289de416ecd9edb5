"""The filter's configuration, read from the parameters of robot_localization's nodes (their names, types and defaults).

FilterConfig.from_params takes the private parameters of a node, or a YAML file of them, as a dictionary. Everything
that is wrong is told at once in a ConfigError, one sentence each. What would be ignored is told by name in `warnings`
(of either): a name that is none, and a parameter that has no effect as things are. Extensions are off unless asked for.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field

import numpy as np

from sara_common.config import ConfigError
from sara_localization.config.input_config import INPUT, InputConfig, InputReader
from sara_localization.filters.control import ControlConfig
from sara_localization.filters.standstill import StandstillConfig
from sara_localization.filters.state import SIZE

__all__ = ['ConfigError', 'FilterConfig', 'InputConfig']

DEFAULT_PROCESS_NOISE = (0.05, 0.05, 0.06, 0.03, 0.03, 0.06, 0.025, 0.025, 0.04, 0.01, 0.01, 0.02, 0.01, 0.01, 0.015)
DEFAULT_INITIAL_VARIANCE = 1e-9
FILTERS = ('ekf', 'ukf')
BACKENDS = ('compiled', 'filterpy')
TWIST_NAMES = 'vx vy vz vroll vpitch vyaw'

DEBUG_FILE = 'robot_localization_debug.txt'
ONLY_WITH = {
    'use_control': (
        'control_config',
        'control_timeout',
        'acceleration_limits',
        'deceleration_limits',
        'acceleration_gains',
        'deceleration_gains',
    )
}
SWITCHES = {
    'two_d_mode': False,
    'publish_tf': True,
    'invert_tf': False,
    'print_diagnostics': True,
    'publish_acceleration': False,
    'permit_corrected_publication': False,
    'reset_on_time_jump': False,
    'predict_to_current_time': False,
    'smooth_lagged_data': False,
    'dynamic_process_noise_covariance': False,
    'disabled_at_startup': False,
    'publish_nis': False,
    'join_at_odometry_time': False,
    'debug': False,
}
"""Parameters that are on or off, and their defaults."""


@dataclass(frozen=True)
class FilterConfig:
    """All that the filter needs to know; frequencies in Hz, times in s, frames without a leading slash."""

    inputs: tuple[InputConfig, ...] = ()
    filter: str = 'ekf'
    backend: str = 'compiled'
    frequency: float = 30.0
    sensor_timeout: float = 1.0 / 30.0
    two_d_mode: bool = False
    map_frame: str = 'map'
    odom_frame: str = 'odom'
    base_link_frame: str = 'base_link'
    base_link_frame_output: str = 'base_link'
    world_frame: str = 'odom'
    publish_tf: bool = True
    invert_tf: bool = False
    publish_acceleration: bool = False
    permit_corrected_publication: bool = False
    print_diagnostics: bool = True
    transform_time_offset: float = 0.0
    transform_timeout: float = 0.0
    gravitational_acceleration: float = 9.80665
    reset_on_time_jump: bool = False
    predict_to_current_time: bool = False
    smooth_lagged_data: bool = False
    history_length: float = 0.0
    disabled_at_startup: bool = False
    dynamic_process_noise_covariance: bool = False
    control: ControlConfig | None = None
    alpha: float = 0.001
    beta: float = 2.0
    kappa: float = 0.0
    process_noise_covariance: np.ndarray = field(default_factory=lambda: np.diag(DEFAULT_PROCESS_NOISE))
    initial_estimate_covariance: np.ndarray = field(default_factory=lambda: np.eye(SIZE) * DEFAULT_INITIAL_VARIANCE)
    initial_state: np.ndarray = field(default_factory=lambda: np.zeros(SIZE))
    standstill: StandstillConfig = StandstillConfig()
    publish_nis: bool = False
    hold_after: float = 0.0
    join_at_odometry_time: bool = False
    debug: bool = False
    debug_out_file: str = DEBUG_FILE
    warnings: tuple[str, ...] = ()

    @property
    def publishes_map_to_odom(self) -> bool:
        return self.world_frame == self.map_frame

    def input(self, name: str) -> InputConfig:
        """The input of that name; KeyError if there is none."""
        for candidate in self.inputs:
            if candidate.name == name:
                return candidate
        raise KeyError(name)

    @classmethod
    def from_params(cls, params: dict[str, object], filter: str = 'ekf') -> FilterConfig:
        """From a dictionary of parameters, for the 'ekf' or the 'ukf'; raises ConfigError with every fault that was
        found.
        """
        if filter not in FILTERS:
            raise ConfigError(f'the filter is {filter!r}, allowed are {", ".join(FILTERS)}')
        return _Reader(params).config(cls, filter)


class _Reader(InputReader):
    """The parameters of the filter, in their order."""

    def control(self, sensor_timeout, inputs):
        if not self.boolean('use_control', False):
            for switch, names in ONLY_WITH.items():
                for name in names:
                    if self.take(name) is not None:
                        self.warnings.append(f'{name} has no effect: it belongs to {switch}, which is off.')
            self.boolean('stamped_control', False)
            return None
        mask = self.flags('control_config', 6, TWIST_NAMES) or (False,) * 6
        for i, axis in enumerate('xyz'):
            measuring = [each.name for each in inputs if each.kind == 'imu' and each.mask[12 + i]]
            if mask[i] and measuring:
                self.warnings.append(
                    f'control_config: v{axis} is left out, for {measuring[0]} measures a{axis}; leave one of them '
                    'out of the '
                    'configuration.'
                )
                mask = mask[:i] + (False,) + mask[i + 1 :]
        limits = self.numbers('acceleration_limits', 6, (1.0,) * 6, low=0.0)
        gains = self.numbers('acceleration_gains', 6, (1.0,) * 6, low=0.0)
        return ControlConfig(
            mask,
            self.number('control_timeout', sensor_timeout, low=0.0),
            limits,
            self.numbers('deceleration_limits', 6, limits, low=0.0),
            gains,
            self.numbers('deceleration_gains', 6, gains, low=0.0),
            self.boolean('stamped_control', False),
        )

    def standstill(self):
        d = StandstillConfig()
        values = {
            name: self.number('standstill_' + name, getattr(d, name), above=0.0)
            for name in (
                'time',
                'linear_velocity',
                'angular_velocity',
                'gyro_deviation',
                'gyro_limit',
                'acceleration_deviation',
                'variance',
            )
        }
        return StandstillConfig(update=self.boolean('standstill_update', False), **values)

    def unscented(self):
        return dict(
            alpha=self.number('alpha', 0.001, above=0.0),
            beta=self.number('beta', 2.0, low=0.0),
            kappa=self.number('kappa', 0.0, low=0.0),
        )

    def leftovers(self):
        for name in sorted(self.left):
            match = INPUT.match(name)
            sentence = f'{name} is no parameter of this filter: ignored.'
            if match and match.group(3) is None:
                sentence = f'{name} is ignored: inputs are numbered from 0 without a gap.'
            elif match and '{}{}'.format(*match.group(1, 2)) not in self.known:
                sentence = '%s is ignored: there is no %s%s.' % ((name,) + match.group(1, 2))
            else:
                close = difflib.get_close_matches(name, self.known, 1)
                if close:
                    sentence = f'{name} is no parameter of this filter: ignored (is {close[0]} meant?).'
            self.warnings.append(sentence)

    def frames(self):
        prefix = self.take('tf_prefix', '')
        if not isinstance(prefix, str):
            self.faults.append(f'tf_prefix is {prefix!r}, allowed is a word')
            prefix = ''
        prefix = prefix.strip('/')
        frames = {
            name: self.frame(name, default, prefix)
            for name, default in (('map_frame', 'map'), ('odom_frame', 'odom'), ('base_link_frame', 'base_link'))
        }
        if len(set(frames.values())) < 3:
            self.faults.append(
                'map_frame, odom_frame and base_link_frame must differ; they are {}.'.format(', '.join(frames.values()))
            )
        world = frames['world_frame'] = self.frame('world_frame', frames['odom_frame'], prefix)
        if world not in (frames['map_frame'], frames['odom_frame']):
            self.faults.append(
                'world_frame is {}, allowed are map_frame ({}) and odom_frame ({})'.format(
                    world, frames['map_frame'], frames['odom_frame']
                )
            )
        frames['base_link_frame_output'] = self.frame('base_link_frame_output', frames['base_link_frame'], prefix)
        if frames['base_link_frame_output'] in (frames['map_frame'], frames['odom_frame']):
            self.faults.append(
                'base_link_frame_output is {}, allowed is a frame of the robot, not map_frame or odom_frame'.format(
                    frames['base_link_frame_output']
                )
            )
        return frames

    def config(self, cls, filter) -> FilterConfig:
        inputs = self.inputs()
        frequency = self.number('frequency', 30.0, above=0.0)
        values = self.sizes(frequency, inputs)
        values.update({name: self.boolean(name, default) for name, default in SWITCHES.items()})
        if values['smooth_lagged_data'] and values['history_length'] == 0.0:
            self.warnings.append(
                'smooth_lagged_data has no effect while history_length is 0: give it the longest delay of an '
                'input in seconds.'
            )
        elif values['history_length'] and not values['smooth_lagged_data']:
            self.warnings.append('history_length has no effect: it belongs to smooth_lagged_data, which is off.')
        values['backend'] = self.choice('backend', BACKENDS)
        values['debug_out_file'] = self.file('debug_out_file', DEBUG_FILE)
        values.update(self.unscented())
        values.update(self.frames())
        self.leftovers()
        if not inputs:
            self.faults.append('no input is set: name at least one of odom0, imu0, pose0, twist0 and its _config.')
        if self.faults:
            raise ConfigError(self.faults, self.warnings)
        return cls(inputs=inputs, filter=filter, frequency=frequency, warnings=tuple(self.warnings), **values)

    def sizes(self, frequency, inputs):
        """Times, covariances and what else has a size."""
        sensor_timeout = self.number('sensor_timeout', 1.0 / frequency, above=0.0)
        return dict(
            sensor_timeout=sensor_timeout,
            transform_time_offset=self.number('transform_time_offset', 0.0),
            transform_timeout=self.number('transform_timeout', 0.0, low=0.0),
            gravitational_acceleration=self.number('gravitational_acceleration', 9.80665),
            history_length=abs(self.number('history_length', 0.0)),
            hold_after=self.number('hold_after', 0.0, low=0.0),
            process_noise_covariance=self.covariance('process_noise_covariance', SIZE, np.diag(DEFAULT_PROCESS_NOISE)),
            initial_estimate_covariance=self.covariance(
                'initial_estimate_covariance', SIZE, np.eye(SIZE) * DEFAULT_INITIAL_VARIANCE
            ),
            initial_state=self.vector('initial_state', np.zeros(SIZE)),
            control=self.control(sensor_timeout, inputs),
            standstill=self.standstill(),
        )
