"""Settings of the controller under the names of the C++ diff_drive_controller, checked all at once."""

import math
from dataclasses import dataclass

# Parameters of the C++ peer that are not built yet; whoever sets one is told so by name.
NOT_AVAILABLE = (
    'open_loop', 'allow_multiple_cmd_vel_publishers', 'publish_cmd', 'publish_wheel_joint_controller_state',
    *(f'{axis}/{kind}' for axis in ('linear/x', 'angular/z') for kind in (
        'has_velocity_limits', 'has_acceleration_limits', 'has_jerk_limits', 'max_velocity', 'max_acceleration', 'max_jerk',
        'min_velocity', 'min_acceleration', 'min_jerk')))


class ConfigError(ValueError):
    """One sentence per faulty parameter: its name, what it held, what is allowed."""


@dataclass(frozen=True)
class ControllerConfig:
    """Geometry in m, rates in Hz, timeouts in s; the covariance diagonals are x y z roll pitch yaw.

    encoder_timeout (ours): without encoders for this long the wheels are commanded to stop. steps_per_turn and
    max_wheel_speed (rad/s, ours): encoder edges of a wheel turn, and what no wheel can do.
    """

    wheel_separation: float
    wheel_radius: float
    pose_covariance_diagonal: tuple
    twist_covariance_diagonal: tuple
    left_wheel: str
    right_wheel: str
    wheel_separation_multiplier: float = 1.0
    left_wheel_radius_multiplier: float = 1.0
    right_wheel_radius_multiplier: float = 1.0
    publish_rate: float = 50.0
    velocity_rolling_window_size: int = 10
    cmd_vel_timeout: float = 0.5
    base_frame_id: str = 'base_link'
    odom_frame_id: str = 'odom'
    enable_odom_tf: bool = True
    encoder_timeout: float = 0.5
    steps_per_turn: int = 64000
    max_wheel_speed: float = 20.0

    def __post_init__(self):
        faults = []
        for name in ('wheel_separation', 'wheel_radius', 'wheel_separation_multiplier', 'left_wheel_radius_multiplier',
                     'right_wheel_radius_multiplier', 'publish_rate', 'cmd_vel_timeout', 'encoder_timeout',
                     'max_wheel_speed'):
            value = getattr(self, name)
            if not _is_number(value) or value <= 0:
                faults.append(f'{name} is {value!r}, allowed are numbers above 0')
        for name in ('pose_covariance_diagonal', 'twist_covariance_diagonal'):
            value = getattr(self, name)
            if not isinstance(value, (list, tuple)) or len(value) != 6 or not all(_is_number(v) and v >= 0 for v in value):
                faults.append(f'{name} is {value!r}, allowed are six numbers of 0 or more')
        for name in ('left_wheel', 'right_wheel', 'base_frame_id', 'odom_frame_id'):
            value = getattr(self, name)
            if not isinstance(value, str) or not value:
                faults.append(f'{name} is {value!r}, allowed is one name')
        for name in ('velocity_rolling_window_size', 'steps_per_turn'):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                faults.append(f'{name} is {value!r}, allowed are whole numbers of 1 or more')
        if not isinstance(self.enable_odom_tf, bool):
            faults.append(f'enable_odom_tf is {self.enable_odom_tf!r}, allowed are true and false')
        if faults:
            raise ConfigError('; '.join(faults))

    @property
    def separation(self):
        """The track with its multiplier, m."""
        return self.wheel_separation * self.wheel_separation_multiplier

    @property
    def radii(self):
        """Left and right wheel radius with their multipliers, m."""
        return (self.wheel_radius * self.left_wheel_radius_multiplier,
                self.wheel_radius * self.right_wheel_radius_multiplier)

    @classmethod
    def from_params(cls, params):
        """From a (nested) dictionary as ROS gives it, other names in it ignored (see not_available). Raises ConfigError."""
        flat = flatten(params)
        missing = [f'{name} is missing' + (', and taking it from the URDF is not available yet' if 'wheel_' in name else '')
                   for name in ('wheel_separation', 'wheel_radius', 'pose_covariance_diagonal', 'twist_covariance_diagonal',
                                'left_wheel', 'right_wheel') if name not in flat]
        if missing:
            raise ConfigError('; '.join(missing))
        both = flat.get('wheel_radius_multiplier')
        values = {name: flat[name] for name in cls.__dataclass_fields__ if name in flat}
        if both is not None:
            values.update(left_wheel_radius_multiplier=both, right_wheel_radius_multiplier=both)
        for side in ('left_wheel', 'right_wheel'):
            if isinstance(values[side], (list, tuple)) and len(values[side]) == 1:
                values[side] = values[side][0]
        return cls(**values)


def not_available(params):
    """One sentence for each parameter of the C++ peer that is set here and not built yet."""
    flat = flatten(params)
    return [f'{name} is set but not available yet: it is ignored' for name in NOT_AVAILABLE if name in flat]


def flatten(params, prefix=''):
    """Nested dictionaries as one, with names joined by '/'."""
    flat = {}
    for name, value in params.items():
        if isinstance(value, dict):
            flat.update(flatten(value, f'{prefix}{name}/'))
        else:
            flat[prefix + name] = value
    return flat


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
