"""The parameters of navsat_transform_node: names, units and defaults of the C++ node; config/navsat.yaml explains
them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from sara_common.config import ConfigError
from sara_localization.config.parameters import ParameterReader, as_number
from sara_localization.gps.grid import NoPlace, place
from sara_localization.gps.tangent_plane import TangentPlane
from sara_localization.gps.utm import Zone

_OLD_NAMES = {
    'broadcast_utm_transform': 'broadcast_cartesian_transform',
    'broadcast_utm_transform_as_parent_frame': 'broadcast_cartesian_transform_as_parent_frame',
}
_HINTS = {
    'use_manual_datum': 'the parameter is called wait_for_datum',
    'force_user_utm': 'call the service setUTMZone',
    'utm_zone': 'call the service setUTMZone',
    'tf_prefix': 'frames are those of the messages',
    'world_frame': 'the world frame is the frame_id of odometry/filtered',
    'map_frame': 'the world frame is the frame_id of odometry/filtered',
    'base_link_frame': 'the base frame is the child_frame_id of odometry/filtered',
    'magnetic_declination': 'the parameter is called magnetic_declination_radians',
}


@dataclass(frozen=True)
class NavSatConfig:
    """Hz, s, rad, m, m/s.

    magnetic_declination_radians: None where the world magnetic model is to say it. datum: latitude, longitude (deg),
    heading (rad, 0 east).
    """

    frequency: float = 10.0
    delay: float = 0.0
    magnetic_declination_radians: float | None = None
    yaw_offset: float = 0.0
    zero_altitude: bool = False
    publish_filtered_gps: bool = False
    broadcast_cartesian_transform: bool = False
    broadcast_cartesian_transform_as_parent_frame: bool = False
    use_odometry_yaw: bool = False
    wait_for_datum: bool = False
    datum: tuple[float, float, float] | None = None
    use_local_cartesian: bool = False
    cartesian_frame_id: str = 'utm'
    transform_timeout: float = 0.0
    assumed_sigma: float = 5.0
    velocity_heading: bool = False
    velocity_sigma: float = 0.1
    warnings: tuple[str, ...] = ()

    @classmethod
    def from_params(cls, params: dict[str, object]) -> NavSatConfig:
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        params = dict(params)
        warnings = _renamed(params)
        reader, values = ParameterReader(params), {}
        values['frequency'] = reader.number('frequency', cls.frequency, above=0.0)
        for name in ('assumed_sigma', 'velocity_sigma'):
            values[name] = reader.number(name, getattr(cls, name), above=0.0)
        for name in ('delay', 'transform_timeout'):
            values[name] = reader.number(name, 0.0, low=0.0)
        values['yaw_offset'] = reader.number('yaw_offset', 0.0)
        if reader.left.get('magnetic_declination_radians') is not None:
            values['magnetic_declination_radians'] = reader.number('magnetic_declination_radians', 0.0)
        reader.take('magnetic_declination_radians')
        for f in fields(cls):
            if isinstance(f.default, bool):
                values[f.name] = reader.boolean(f.name, f.default)
        usual = 'local_enu' if values['use_local_cartesian'] else cls.cartesian_frame_id
        values['cartesian_frame_id'] = reader.frame('cartesian_frame_id', usual)
        values['datum'] = _datum(reader, warnings, values['use_local_cartesian'])
        for name in sorted(reader.left):
            hint = _HINTS.get(name)
            warnings.append(f'{name} is no parameter of navsat_transform_node: {hint or "ignored"}.')
        if reader.faults:
            raise ConfigError(reader.faults, warnings)
        return cls(warnings=tuple(warnings), **values)


def _renamed(params):
    """Gives old names their new ones, under which the old one wins, as in the C++ node; sentences."""
    said = []
    for old, new in _OLD_NAMES.items():
        if old in params:
            params[new] = params.pop(old)
            said.append(f'{old} should be called {new}.')
    return said


def _datum(reader, warnings, local):
    """Latitude, longitude, heading; frames that may follow do not count."""
    value = reader.take('datum')
    if value is None:
        return None
    numbers = [as_number(v) for v in value[:3]] if isinstance(value, (list, tuple)) else []
    if len(numbers) < 3 or None in numbers or not abs(numbers[2]) <= 1e3:
        reader.faults.append(
            f'datum is {value!r}, allowed is a list of latitude, longitude (deg) and heading (rad, 0 east)'
        )
        return None
    if len(value) > 3:
        warnings.append('datum: only latitude, longitude and heading count; frames are those of odometry/filtered.')
    try:
        latitude, longitude = place(numbers[0], numbers[1])
        if local:
            TangentPlane(latitude, longitude)
        else:
            Zone.of(latitude, longitude)
        return latitude, longitude, numbers[2]
    except NoPlace as error:
        reader.faults.append(f'datum is {value!r}: {error}')
        return None
