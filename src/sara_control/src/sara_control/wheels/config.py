"""Settings of the controller under the names of the C++ diff_drive_controller, checked all at once."""

from dataclasses import dataclass
from functools import cached_property

from sara_common.config import ConfigError, is_number, is_whole, number_faults
from sara_control.wheels.limiter import Limits
from sara_control.wheels.urdf import UrdfError, WheelGeometry

POSITIVE = (
    'wheel_separation',
    'wheel_radius',
    'wheel_separation_multiplier',
    'left_wheel_radius_multiplier',
    'right_wheel_radius_multiplier',
    'cmd_vel_timeout',
    'encoder_timeout',
    'max_wheel_speed',
    'command_rate',
    'encoder_period',
    'frozen_distance',
    'wheel_acceleration',
)
FLAGS = (
    'enable_odom_tf',
    'open_loop',
    'allow_multiple_cmd_vel_publishers',
    'publish_cmd',
    'publish_wheel_joint_controller_state',
)
REQUIRED = (
    'wheel_separation',
    'wheel_radius',
    'pose_covariance_diagonal',
    'twist_covariance_diagonal',
    'left_wheel',
    'right_wheel',
)


@dataclass(frozen=True)
class ControllerConfig:
    """Geometry in m, rates in Hz, timeouts in s; the covariance diagonals are x y z roll pitch yaw.

    left_wheel, right_wheel: a joint's name, or as many names on each side. The last block is ours, not the C++
    controller's:
    command_rate: wheel commands, Hz. encoder_timeout: without wheel positions for so long the wheels stop.
    stop_deceleration: m/s2 of a stop without a command (None: as the limits allow, at once without limits).
    frozen_distance: m of rim that a wheel's encoder may miss while the other wheel turns (see wheel_watch).
    wheel_acceleration: m/s2 of a wheel's rim while readings are lost (see uncertainty). steps_per_turn,
    encoder_period (s), max_wheel_speed (rad/s): of encoders on the bus: edges of a wheel turn, time between two
    readings, and what no wheel can do.
    """

    wheel_separation: float
    wheel_radius: float
    pose_covariance_diagonal: tuple
    twist_covariance_diagonal: tuple
    left_wheel: object
    right_wheel: object
    wheel_separation_multiplier: float = 1.0
    left_wheel_radius_multiplier: float = 1.0
    right_wheel_radius_multiplier: float = 1.0
    publish_rate: float = 50.0
    open_loop: bool = False
    velocity_rolling_window_size: int = 10
    cmd_vel_timeout: float = 0.5
    allow_multiple_cmd_vel_publishers: bool = True
    base_frame_id: str = 'base_link'
    odom_frame_id: str = 'odom'
    enable_odom_tf: bool = True
    publish_cmd: bool = False
    publish_wheel_joint_controller_state: bool = False
    linear_limits: Limits = Limits()
    angular_limits: Limits = Limits()

    command_rate: float = 50.0
    encoder_timeout: float = 0.5
    stop_deceleration: float = None
    frozen_distance: float = 0.015
    wheel_acceleration: float = 1.5
    steps_per_turn: int = 0
    encoder_period: float = 0.1
    max_wheel_speed: float = 20.0

    def __post_init__(self):
        faults = self._faults()
        if faults:
            raise ConfigError(faults)

    def _faults(self):
        faults = number_faults(self, above_0=POSITIVE, from_0=('publish_rate',))

        def check(names, is_right, allowed):
            faults.extend(
                f'{name} is {getattr(self, name)!r}, allowed {allowed}'
                for name in names
                if not is_right(getattr(self, name))
            )

        check(
            ('stop_deceleration',), lambda value: value is None or is_number(value) and value > 0, 'are numbers above 0'
        )
        check(
            ('pose_covariance_diagonal', 'twist_covariance_diagonal'),
            lambda value: (
                isinstance(value, (list, tuple)) and len(value) == 6 and all(is_number(v) and v >= 0 for v in value)
            ),
            'are six numbers of 0 or more',
        )
        check(('base_frame_id', 'odom_frame_id'), _is_name, 'is one name')
        check(
            ('left_wheel', 'right_wheel'),
            lambda value: (
                _is_name(value) or isinstance(value, (list, tuple)) and len(value) > 0 and all(map(_is_name, value))
            ),
            "is a joint's name or a list of names",
        )
        check(('velocity_rolling_window_size',), lambda value: is_whole(value, 1), 'are whole numbers of 1 or more')
        check(
            ('steps_per_turn',),
            lambda value: is_whole(value, 0),
            'are whole numbers of 1 or more, 0 where no encoder is read',
        )
        check(FLAGS, lambda value: isinstance(value, bool), 'are true and false')
        return faults + self._joint_faults()

    def _joint_faults(self):
        left, right = self.left_joints, self.right_joints
        if len(left) != len(right):
            return [
                f'left_wheel has {len(left)} joints and right_wheel {len(right)}, '
                'allowed is the same number on both sides'
            ]
        if len(set(left + right)) != len(left + right):
            return ['left_wheel and right_wheel name a joint twice, allowed are joints of their own']
        return []

    @property
    def left_joints(self) -> tuple[str, ...]:
        """Names of the left wheels' joints."""
        return _names(self.left_wheel)

    @property
    def right_joints(self) -> tuple[str, ...]:
        """Names of the right wheels' joints."""
        return _names(self.right_wheel)

    @cached_property
    def separation(self) -> float:
        """The track with its multiplier, m."""
        return self.wheel_separation * self.wheel_separation_multiplier

    @cached_property
    def radii(self) -> tuple[float, float]:
        """Left and right wheel radius with their multipliers, m."""
        return (
            self.wheel_radius * self.left_wheel_radius_multiplier,
            self.wheel_radius * self.right_wheel_radius_multiplier,
        )

    @classmethod
    def from_params(cls, params: dict, urdf: str | None = None) -> 'ControllerConfig':
        """From a (nested) dictionary as ROS gives it; other names in it are ignored (see `unknown`).

        urdf: text, or None: where wheel_separation or wheel_radius come from if the parameters do not say. Raises
        ConfigError.
        """
        flat, faults = flatten(params), []
        if 'wheel_radius_multiplier' in flat:
            flat['left_wheel_radius_multiplier'] = flat['right_wheel_radius_multiplier'] = flat[
                'wheel_radius_multiplier'
            ]
        limits = {
            'linear_limits': Limits.from_params(flat, 'linear/x', faults),
            'angular_limits': Limits.from_params(flat, 'angular/z', faults),
        }
        _add_geometry(flat, urdf, faults)
        values = {name: flat[name] for name in cls.__dataclass_fields__ if name in flat and name not in limits}
        missing = [name for name in REQUIRED if name not in values]
        named = ' '.join(faults)
        faults.extend(f'{name} is missing' for name in missing if f'{name} is missing' not in named)
        try:
            # What is missing is reported above; stand-ins let the rest be checked in the same go.
            stand_ins = {
                'wheel_separation': 1.0,
                'wheel_radius': 1.0,
                'pose_covariance_diagonal': (0.0,) * 6,
                'twist_covariance_diagonal': (0.0,) * 6,
                'left_wheel': 'left',
                'right_wheel': 'right',
            }
            config = cls(**{**{name: stand_ins[name] for name in missing}, **values}, **limits)
        except ConfigError as error:
            faults.append(str(error))
        if faults:
            raise ConfigError(faults)
        return config


def unknown(params: dict, ours: tuple[str, ...] = ('base', 'dbc', 'assists')) -> list[str]:
    """Names in the parameters under this controller's namespace that nothing reads: misspelt, or of something else.

    ours: what the node knows besides the configuration.
    """
    known = {*ControllerConfig.__dataclass_fields__, *ours, 'wheel_radius_multiplier'} - {
        'linear_limits',
        'angular_limits',
    }
    known.update(
        f'{axis}/{form.format(kind)}'
        for axis in ('linear/x', 'angular/z')
        for kind in ('velocity', 'acceleration', 'jerk')
        for form in ('has_{}_limits', 'max_{}', 'min_{}')
    )
    return sorted(flatten(params).keys() - known)


def flatten(params: dict, prefix: str = '') -> dict:
    """Nested dictionaries as one, with names joined by '/'."""
    flat = {}
    for name, value in params.items():
        if isinstance(value, dict):
            flat.update(flatten(value, f'{prefix}{name}/'))
        else:
            flat[prefix + name] = value
    return flat


def _add_geometry(flat, urdf, faults):
    """Puts what is missing of the geometry into `flat`, from the URDF."""
    wanted = [name for name in ('wheel_separation', 'wheel_radius') if name not in flat]
    left, right = (_names(flat.get(name)) for name in ('left_wheel', 'right_wheel'))
    if not wanted or not left or not right:
        return
    if urdf is None:
        faults.extend(f'{name} is missing, and there is no robot_description to take it from' for name in wanted)
        return
    try:
        geometry = WheelGeometry(urdf)
    except UrdfError as error:
        faults.append(f'{" and ".join(wanted)} is missing, and {error}')
        return
    for name in wanted:
        try:
            flat[name] = geometry.radius(left[0]) if name == 'wheel_radius' else geometry.separation(left[0], right[0])
        except UrdfError as error:
            faults.append(f'{name} is missing, and {error}')


def _names(value):
    return tuple(value) if isinstance(value, (list, tuple)) else () if value is None else (value,)


def _is_name(value):
    return isinstance(value, str) and value != ''
