"""The parameters of amcl: names, units and defaults of the C++ node; config/amcl.yaml explains them."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from sara_common.config import ConfigError, fault, is_whole, number_faults, range_faults
from sara_localization.config.parameters import ParameterReader

SCAN_MODELS = ('likelihood_field', 'likelihood_field_prob', 'beam')
ODOM_MODELS = ('diff', 'omni', 'diff-corrected', 'omni-corrected')
_FRAMES = ('odom_frame_id', 'base_frame_id', 'global_frame_id')
_INITIAL = ('initial_pose_x', 'initial_pose_y', 'initial_pose_a', 'initial_cov_xx', 'initial_cov_yy', 'initial_cov_aa')
_OLD_NAMES = {'beam_skip_error_threshold_': 'beam_skip_error_threshold'}
"""{name that some versions of the C++ node read: name}."""
_NOT_BUILT = {'bag_scan_period': 'it slows down --run-from-bag, which is not here'}
_ABOVE_0 = (
    'kld_err',
    'kld_z',
    'laser_lambda_short',
    'laser_likelihood_max_dist',
    'std_warn_level_x',
    'std_warn_level_y',
    'std_warn_level_yaw',
)
_FROM_0 = (
    'update_min_d',
    'update_min_a',
    'transform_tolerance',
    'beam_skip_distance',
    'initial_cov_xx',
    'initial_cov_yy',
    'initial_cov_aa',
)
_RANGES = {
    **{f'odom_alpha{k}': (0.0, 1000.0) for k in range(1, 6)},
    **{f'laser_z_{part}': (0.0, 1000.0) for part in ('hit', 'short', 'max', 'rand')},
    'laser_sigma_hit': (1e-3, 100.0),
    'laser_likelihood_power': (1e-3, 100.0),
    'recovery_alpha_slow': (0.0, 1.0),
    'recovery_alpha_fast': (0.0, 1.0),
    'lost_limit': (0.0, 1.0),
    'lost_keeps_heading': (0.0, 1.0),
    'beam_skip_threshold': (0.0, 1.0),
    'beam_skip_error_threshold': (0.0, 1.0),
    'map_occupied_above': (0.0, 99.0),
}
_WHOLE_FROM_1 = ('min_particles', 'max_particles', 'resample_interval', 'laser_max_beams')
MOST_PARTICLES = 1_000_000
CLIENT_LIMITS = {
    'min_particles': (1, 1000),
    'max_particles': (1, 10000),
    'kld_err': (0.0, 1.0),
    'kld_z': (0.0, 5.0),
    'update_min_d': (0.0, 5.0),
    'update_min_a': (0.0, 2.0 * math.pi),
    'resample_interval': (1, 20),
    'transform_tolerance': (0.0, 2.0),
    'gui_publish_rate': (-1.0, 100.0),
    'save_pose_rate': (-1.0, 10.0),
    'laser_min_range': (-1.0, 1000.0),
    'laser_max_range': (-1.0, 1000.0),
    'laser_max_beams': (1, 250),
    'laser_likelihood_max_dist': (0.0, 20.0),
    'laser_likelihood_power': (0.0, 10.0),
    'beam_skip_distance': (0.0, 2.0),
    **{f'odom_alpha{k}': (0.0, 10.0) for k in range(1, 6)},
    **{f'laser_{name}': (0.0, 10.0) for name in ('z_hit', 'z_short', 'z_max', 'z_rand', 'sigma_hit', 'lambda_short')},
    **dict.fromkeys(('recovery_alpha_slow', 'recovery_alpha_fast', 'lost_limit', 'lost_keeps_heading'), (0.0, 1.0)),
    **dict.fromkeys(('beam_skip_threshold', 'beam_skip_error_threshold'), (0.0, 1.0)),
}
"""What dynamic_reconfigure offers: the limits of the C++ node's AMCL.cfg, which a YAML may exceed."""
_FIXED = (*_INITIAL, 'std_warn_level_x', 'std_warn_level_y', 'std_warn_level_yaw', 'map_occupied_above', 'seed')


@dataclass(frozen=True)
class AmclConfig:
    """m, rad, s, Hz, and their squares. Frames without a leading slash."""

    odom_frame_id: str = 'odom'
    base_frame_id: str = 'base_link'
    global_frame_id: str = 'map'
    use_map_topic: bool = False
    first_map_only: bool = False
    tf_broadcast: bool = True
    transform_tolerance: float = 0.1
    gui_publish_rate: float = -1.0
    save_pose_rate: float = 0.5

    initial_pose_x: float = 0.0
    initial_pose_y: float = 0.0
    initial_pose_a: float = 0.0
    initial_cov_xx: float = 0.25
    initial_cov_yy: float = 0.25
    initial_cov_aa: float = (math.pi / 12.0) ** 2

    min_particles: int = 100
    max_particles: int = 5000
    kld_err: float = 0.01
    kld_z: float = 0.99
    update_min_d: float = 0.2
    update_min_a: float = math.pi / 6.0
    resample_interval: int = 2
    selective_resampling: bool = False
    recovery_alpha_slow: float = 0.0
    recovery_alpha_fast: float = 0.0
    lost_limit: float = 0.9
    lost_recovery: bool = True
    lost_keeps_heading: float = 0.0
    force_update_after_initialpose: bool = False
    force_update_after_set_map: bool = False

    odom_model_type: str = 'diff'
    odom_alpha1: float = 0.2
    odom_alpha2: float = 0.2
    odom_alpha3: float = 0.2
    odom_alpha4: float = 0.2
    odom_alpha5: float = 0.2

    laser_model_type: str = 'likelihood_field'
    laser_min_range: float = -1.0
    laser_max_range: float = -1.0
    laser_max_beams: int = 30
    laser_z_hit: float = 0.95
    laser_z_short: float = 0.1
    laser_z_max: float = 0.05
    laser_z_rand: float = 0.05
    laser_sigma_hit: float = 0.2
    laser_lambda_short: float = 0.1
    laser_likelihood_max_dist: float = 2.0
    laser_likelihood_power: float = 1.0
    do_beamskip: bool = False
    beam_skip_distance: float = 0.5
    beam_skip_threshold: float = 0.3
    beam_skip_error_threshold: float = 0.9

    std_warn_level_x: float = 0.2
    std_warn_level_y: float = 0.2
    std_warn_level_yaw: float = 0.1
    map_occupied_above: float = 65.0
    seed: int = 0
    warnings: tuple[str, ...] = ()

    @property
    def initial_pose(self) -> tuple[float, float, float]:
        """Where the robot starts: x, y, yaw in the map."""
        return self.initial_pose_x, self.initial_pose_y, self.initial_pose_a

    @property
    def initial_variances(self) -> tuple[float, float, float]:
        """Of that pose, m2, m2, rad2."""
        return self.initial_cov_xx, self.initial_cov_yy, self.initial_cov_aa

    def faults(self) -> list[str]:
        """Sentences, one for each bad value."""
        found = [
            f'{f.name} is {getattr(self, f.name)!r}, allowed is a finite number'
            for f in fields(self)
            if isinstance(f.default, float) and not math.isfinite(getattr(self, f.name))
        ]
        if found:
            return found
        found = number_faults(self, _ABOVE_0, _FROM_0) + range_faults(self, _RANGES)
        found += [
            fault(self, name, f'are whole numbers from 1 to {MOST_PARTICLES}')
            for name in _WHOLE_FROM_1
            if not is_whole(getattr(self, name), 1, MOST_PARTICLES)
        ]
        if not is_whole(self.seed, 0, 2**31 - 1):
            found.append(fault(self, 'seed', 'are whole numbers of 0 or more'))
        return found + self._contradictions()

    def _contradictions(self):
        found = []
        for name, allowed in (('laser_model_type', SCAN_MODELS), ('odom_model_type', ODOM_MODELS)):
            if getattr(self, name) not in allowed:
                found.append(fault(self, name, f'are {", ".join(allowed)}'))
        if self.min_particles > self.max_particles:
            found.append(
                f'min_particles is {self.min_particles}, allowed is at most max_particles: {self.max_particles}'
            )
        if self.laser_z_hit + self.laser_z_rand <= 0.0:
            found.append('laser_z_hit and laser_z_rand are both 0: no scan would say anything')
        if 0.0 < self.laser_max_range <= self.laser_min_range:
            found.append(
                f'laser_min_range is {self.laser_min_range:g}, allowed is less than laser_max_range: '
                f'{self.laser_max_range:g}'
            )
        names = [getattr(self, name) for name in _FRAMES]
        if len(set(names)) < 3:
            found.append(f'odom_frame_id, base_frame_id and global_frame_id must differ; they are {", ".join(names)}')
        return found

    @classmethod
    def from_params(cls, params: dict[str, object]) -> AmclConfig:
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        params = dict(params)
        warnings = _renamed(params) + _without_nan(params, cls)
        reader = ParameterReader(params)
        values = reader.by_defaults(cls, _FRAMES)
        for name in ('odom_model_type', 'laser_model_type'):
            values[name] = str(reader.take(name, getattr(cls, name)))
        reader.take('restore_defaults')  # left by dynamic_reconfigure
        for name in sorted(reader.left):
            why = _NOT_BUILT.get(name)
            warnings.append(f'{name} has no effect: {why}.' if why else f'{name} is no parameter of amcl: ignored.')
        config = cls(warnings=tuple(warnings), **values)
        faults = reader.faults + config.faults()
        if faults:
            raise ConfigError(faults, warnings)
        return config


def _renamed(params):
    """Gives old names their new ones; sentences."""
    said = []
    for old, new in _OLD_NAMES.items():
        if old in params:
            params.setdefault(new, params.pop(old))
            said.append(f'{old} should be called {new}.')
    return said


def _without_nan(params, config):
    """Takes out an initial pose that is no number, as a node that got lost may have saved it; sentences."""
    said = []
    for name in _INITIAL:
        value = params.get(name)
        if isinstance(value, float) and not math.isfinite(value):
            del params[name]
            said.append(f'{name} is {value}: {getattr(config, name):g} is taken.')
    return said


DYNAMIC = tuple(f.name for f in fields(AmclConfig) if f.name not in (*_FIXED, 'warnings'))
"""Parameters that dynamic_reconfigure may change."""
