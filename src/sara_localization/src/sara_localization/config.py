"""The filter's configuration, read from the parameters of robot_localization's nodes (their names, types and defaults).

FilterConfig.from_params takes the private parameters of a node, or a YAML file of them, as a dictionary. Everything that is
wrong is told at once in a ConfigError, one sentence each. What would be ignored is told by name in `warnings`: a name that
is none, and a parameter of robot_localization that has no effect here. One that would change the result but is not built
is refused when it is set to anything but its default.
"""
from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, field
from typing import Dict, Tuple

import numpy as np

from .state import NAMES, SIZE

DEFAULT_PROCESS_NOISE = (.05, .05, .06, .03, .03, .06, .025, .025, .04, .01, .01, .02, .01, .01, .015)
DEFAULT_INITIAL_VARIANCE = 1e-9

# robot_localization's parameters that are not built yet, with the value that asks for nothing.
NOT_BUILT = {'smooth_lagged_data': False, 'history_length': 0.0, 'use_control': False, 'stamped_control': False,
             'dynamic_process_noise_covariance': False, 'disabled_at_startup': False, 'tf_prefix': ''}
NOT_BUILT_ONLY_WITH = {'use_control': ('control_config', 'control_timeout', 'acceleration_limits', 'deceleration_limits',
                                       'acceleration_gains', 'deceleration_gains')}
NO_EFFECT = {'debug': False, 'debug_out_file': None, 'print_diagnostics': True}
INPUT_NOT_BUILT = {'differential': False, 'relative': False, 'pose_use_child_frame': False}

# Which of the 15 variables each kind of input can measure.
MEASURES = {'odom': range(0, 12), 'pose': range(0, 6), 'twist': range(6, 12), 'imu': (3, 4, 5, 9, 10, 11, 12, 13, 14)}
THRESHOLDS = {'odom': ('pose', 'twist'), 'imu': ('pose', 'twist', 'linear_acceleration'), 'pose': (), 'twist': ()}
_INPUT = re.compile(r'^(odom|pose|twist|imu)(\d+)(?:_(.+))?$')


class ConfigError(ValueError):
    """The configuration cannot be used; `faults` holds one sentence for each reason."""

    def __init__(self, faults):
        super().__init__('\n'.join(faults))
        self.faults = tuple(faults)


@dataclass(frozen=True)
class InputConfig:
    """One input: its name (odom0), kind, topic, the (15,) mask of variables and the gates in sigmas."""

    name: str
    kind: str
    topic: str
    mask: Tuple[bool, ...]
    queue_size: int = 1
    remove_gravity: bool = False
    pose_threshold: float = math.inf
    twist_threshold: float = math.inf
    acceleration_threshold: float = math.inf


@dataclass(frozen=True)
class FilterConfig:
    """All that the filter needs to know; frequencies in Hz, times in s, frames without a leading slash."""

    inputs: Tuple[InputConfig, ...] = ()
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
    transform_time_offset: float = 0.0
    transform_timeout: float = 0.0
    gravitational_acceleration: float = 9.80665
    reset_on_time_jump: bool = False
    predict_to_current_time: bool = False
    process_noise_covariance: np.ndarray = field(default_factory=lambda: np.diag(DEFAULT_PROCESS_NOISE))
    initial_estimate_covariance: np.ndarray = field(default_factory=lambda: np.eye(SIZE) * DEFAULT_INITIAL_VARIANCE)
    initial_state: np.ndarray = field(default_factory=lambda: np.zeros(SIZE))
    warnings: Tuple[str, ...] = ()

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
    def from_params(cls, params: Dict[str, object]) -> 'FilterConfig':
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        return _Reader(params).config(cls)


class _Reader:
    """Takes parameters one by one, so that what is left over is known, and collects what is wrong."""

    def __init__(self, params):
        self.left = dict(params)
        self.known, self.faults, self.warnings = [], [], []

    def _take(self, name, default):
        self.known.append(name)
        return self.left.pop(name, default)

    def number(self, name, default, low=None, above=None):
        value = self._take(name, default)
        result = _as_number(value)
        if result is None or not math.isfinite(result):
            self.faults.append('%s must be a number, not %r.' % (name, value))
            return default
        if (low is not None and result < low) or (above is not None and result <= above):
            allowed = 'at least %g' % low if low is not None else 'greater than %g' % above
            self.faults.append('%s is %g; it must be %s.' % (name, result, allowed))
            return default
        return result

    def boolean(self, name, default):
        value = self._take(name, default)
        result = _as_bool(value)
        if result is None:
            self.faults.append('%s must be true or false, not %r.' % (name, value))
            return default
        return result

    def frame(self, name, default):
        value = self._take(name, default)
        if not isinstance(value, str) or not value.strip('/'):
            self.faults.append('%s must be the name of a frame, not %r.' % (name, value))
            return default
        return value.lstrip('/')

    def vector(self, name, default):
        value = self._take(name, None)
        if value is None:
            return np.array(default, dtype=float)
        numbers = [_as_number(v) for v in value] if isinstance(value, (list, tuple)) else None
        if numbers is None or len(numbers) != SIZE or not all(n is not None and math.isfinite(n) for n in numbers):
            held = '%d values' % len(numbers) if numbers is not None else repr(value)
            self.faults.append('%s must be a list of 15 finite numbers (%s); it holds %s.' % (name, ' '.join(NAMES), held))
            return np.array(default, dtype=float)
        return np.array(numbers)

    def covariance(self, name, default):
        value = self._take(name, None)
        if value is None:
            return np.diag(default)
        if isinstance(value, (list, tuple)) and value and isinstance(value[0], (list, tuple)):
            value = [number for row in value for number in row]
        numbers = [_as_number(v) for v in value] if isinstance(value, (list, tuple)) else [None]
        if len(numbers) not in (SIZE, SIZE * SIZE) or not all(n is not None and math.isfinite(n) for n in numbers):
            self.faults.append('%s must be a list of 225 finite numbers, row by row, or of 15, its diagonal; it holds %d.'
                               % (name, len(numbers)))
            return np.diag(default)
        matrix = np.diag(numbers) if len(numbers) == SIZE else np.reshape(numbers, (SIZE, SIZE))
        if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
            self.faults.append('%s is not symmetric.' % name)
        elif np.linalg.eigvalsh(matrix).min() < -1e-12 * max(1.0, np.abs(matrix).max()):
            self.faults.append('%s is not positive semidefinite: no noise has such a covariance.' % name)
        return matrix

    def mask(self, name, kind):
        value = self._take(name, None)
        if value is None:
            self.faults.append('%s is missing: list for the 15 variables (%s) which of them to use.' % (name, ' '.join(NAMES)))
            return None
        flags = [_as_bool(v) for v in value] if isinstance(value, (list, tuple)) else [None]
        if len(flags) != SIZE or None in flags:
            self.faults.append('%s must be a list of 15 times true or false (%s); it holds %d values.'
                               % (name, ' '.join(NAMES), len(flags)))
            return None
        impossible = [NAMES[i] for i in range(SIZE) if flags[i] and i not in MEASURES[kind]]
        if impossible:
            self.warnings.append('%s asks for %s, which an input of this kind does not measure: left out.'
                                 % (name, ', '.join(impossible)))
        flags = tuple(flag and i in MEASURES[kind] for i, flag in enumerate(flags))
        if not any(flags):
            self.warnings.append('%s takes nothing: the input is of no use.' % name)
        return flags

    def input(self, kind, index):
        name = '%s%d' % (kind, index)
        topic = self._take(name, None)
        if not isinstance(topic, str) or not topic:
            self.faults.append('%s must be the name of a topic, not %r.' % (name, topic))
        mask = self.mask(name + '_config', kind)
        queue_size = self._take(name + '_queue_size', 1)
        if isinstance(queue_size, bool) or not isinstance(queue_size, int) or queue_size < 0:
            self.faults.append('%s_queue_size must be a whole number of messages, not %r.' % (name, queue_size))
        self._take(name + '_nodelay', False)
        for option, nothing in INPUT_NOT_BUILT.items():
            if kind == 'twist' or (option == 'pose_use_child_frame' and kind != 'odom'):
                continue
            if self.boolean('%s_%s' % (name, option), nothing) != nothing:
                self.faults.append('%s_%s is true, but this is not built yet; set it to false.' % (name, option))
        gates = {}
        for part in THRESHOLDS[kind]:
            gates[part] = self.number('%s_%s_rejection_threshold' % (name, part), 1.7e308, low=0.0)
        if kind in ('pose', 'twist'):
            gates[kind] = self.number('%s_rejection_threshold' % name, 1.7e308, low=0.0)
        gravity = kind == 'imu' and self.boolean(name + '_remove_gravitational_acceleration', False)
        return InputConfig(name, kind, topic, mask or (False,) * SIZE, queue_size, gravity, gates.get('pose', math.inf),
                           gates.get('twist', math.inf), gates.get('linear_acceleration', math.inf))

    def inputs(self):
        found = []
        for kind in MEASURES:
            index = 0
            while '%s%d' % (kind, index) in self.left:
                found.append(self.input(kind, index))
                index += 1
        return tuple(found)

    def not_built(self):
        for name, nothing in NOT_BUILT.items():
            value = self._take(name, nothing)
            if value != nothing:
                self.faults.append('%s is %r, but this is not built yet; leave it out or set it to %r.'
                                   % (name, value, nothing))
        for switch, names in NOT_BUILT_ONLY_WITH.items():
            for name in names:
                if self._take(name, None) is not None:
                    self.warnings.append('%s has no effect: it belongs to %s, which is off.' % (name, switch))
        for name, nothing in NO_EFFECT.items():
            value = self._take(name, nothing)
            if value != nothing:
                self.warnings.append('%s: %r has no effect here; diagnostics are always published.' % (name, value))

    def leftovers(self):
        for name in sorted(self.left):
            match = _INPUT.match(name)
            sentence = '%s is no parameter of this filter: ignored.' % name
            if match and match.group(3) is None:
                sentence = '%s is ignored: inputs are numbered from 0 without a gap.' % name
            elif match and '%s%s' % match.group(1, 2) not in self.known:
                sentence = '%s is ignored: there is no %s%s.' % ((name,) + match.group(1, 2))
            else:
                close = difflib.get_close_matches(name, self.known, 1)
                if close:
                    sentence = '%s is no parameter of this filter: ignored (is %s meant?).' % (name, close[0])
            self.warnings.append(sentence)

    def config(self, cls) -> FilterConfig:
        inputs = self.inputs()
        frequency = self.number('frequency', 30.0, above=0.0)
        frames = {name: self.frame(name, default) for name, default in
                  (('map_frame', 'map'), ('odom_frame', 'odom'), ('base_link_frame', 'base_link'))}
        if len(set(frames.values())) < 3:
            self.faults.append('map_frame, odom_frame and base_link_frame must differ; they are %s.'
                               % ', '.join(frames.values()))
        world = self.frame('world_frame', frames['odom_frame'])
        if world not in (frames['map_frame'], frames['odom_frame']):
            self.faults.append('world_frame is %s; it must be map_frame (%s) or odom_frame (%s).'
                               % (world, frames['map_frame'], frames['odom_frame']))
        output = self.frame('base_link_frame_output', frames['base_link_frame'])
        values = dict(
            sensor_timeout=self.number('sensor_timeout', 1.0 / frequency, above=0.0),
            transform_time_offset=self.number('transform_time_offset', 0.0),
            transform_timeout=self.number('transform_timeout', 0.0, low=0.0),
            gravitational_acceleration=self.number('gravitational_acceleration', 9.80665),
            process_noise_covariance=self.covariance('process_noise_covariance', DEFAULT_PROCESS_NOISE),
            initial_estimate_covariance=self.covariance('initial_estimate_covariance', [DEFAULT_INITIAL_VARIANCE] * SIZE),
            initial_state=self.vector('initial_state', np.zeros(SIZE)))
        for name, default in (('two_d_mode', False), ('publish_tf', True), ('invert_tf', False),
                              ('publish_acceleration', False), ('permit_corrected_publication', False),
                              ('reset_on_time_jump', False), ('predict_to_current_time', False)):
            values[name] = self.boolean(name, default)
        self.not_built()
        self.leftovers()
        if not inputs:
            self.faults.append('no input is set: name at least one of odom0, imu0, pose0, twist0 and its _config.')
        if self.faults:
            raise ConfigError(self.faults)
        return cls(inputs=inputs, frequency=frequency, world_frame=world, base_link_frame_output=output,
                   warnings=tuple(self.warnings), **frames, **values)


def _as_number(value):
    """A float from a number or from a string such as '1e-9' (YAML 1.1 takes 1e-9 for a string), else None."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    try:
        return float(value)
    except ValueError:
        return None


def _as_bool(value):
    """True or False from a bool, 0 or 1, or those words in a string, else None."""
    if isinstance(value, str):
        return {'true': True, 'false': False}.get(value.lower())
    return bool(value) if value in (0, 1) and isinstance(value, (bool, int)) else None
