"""What the distance zones are told of an optional laser scanner."""

import math
from dataclasses import dataclass

from sara_common.config import ConfigError, is_number, number_faults


@dataclass(frozen=True)
class ScanConfig:
    """enabled: whether there is one. x, y (m), yaw (rad): its place in the base frame. view: rad to either side of its
    axis beyond which it sees the chair itself.

    timeout: s without a scan until the sonars' limits hold alone. reaction_time: s from an obstacle to the wheels'
    answer. stop_distance: m before contact. creep_speed: m/s, allowed up to there. memory: s for which what was seen is
    kept; still_memory: s for what stood still. walk: m/s at which somebody may come to where nothing is seen.
    approach: m/s at which what moves may come towards the chair. passing_distance: m beside the body within which the
    chair passes what moves at no more than passing_speed, m/s. tolerance: m between an echo and the hit that explains
    it.
    """

    enabled: bool = False
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    view: float = math.radians(100.0)
    timeout: float = 0.25
    reaction_time: float = 0.35
    stop_distance: float = 0.1
    creep_speed: float = 0.1
    memory: float = 3.0
    still_memory: float = 20.0
    walk: float = 1.0
    approach: float = 0.8
    passing_distance: float = 0.3
    passing_speed: float = 0.3
    tolerance: float = 0.1

    def __post_init__(self):
        times = ('timeout', 'reaction_time', 'memory', 'still_memory')
        faults = number_faults(
            self,
            above_0=('view', *times, 'stop_distance', 'creep_speed', 'walk', 'passing_speed', 'tolerance'),
            from_0=('approach', 'passing_distance'),
        )
        faults += [
            f'{name} is {getattr(self, name)!r}, allowed are numbers'
            for name in ('x', 'y', 'yaw')
            if not is_number(getattr(self, name))
        ]
        if not isinstance(self.enabled, bool):
            faults.append(f'enabled is {self.enabled!r}, allowed are true and false')
        if faults:
            raise ConfigError(faults)

    @classmethod
    def from_params(cls, params: dict) -> 'ScanConfig':
        """From a dictionary; view_deg and yaw_deg are in degrees. Raises ConfigError."""
        if not isinstance(params, dict):
            raise ConfigError(f'{params!r} is given where a mapping of parameters is allowed')
        values = dict(params)
        faults = [
            f'{name} is {values.pop(name)!r}, but there is no such parameter'
            for name in list(values)
            if name not in {*cls.__dataclass_fields__, 'view_deg', 'yaw_deg'} - {'view', 'yaw'}
        ]
        for name in ('view', 'yaw'):
            if f'{name}_deg' in values:
                degrees = values.pop(f'{name}_deg')
                values[name] = math.radians(degrees) if is_number(degrees) else degrees
        try:
            config = cls(**values)
        except ConfigError as error:
            raise ConfigError([*faults, *error.faults]) from None
        if faults:
            raise ConfigError(faults)
        return config
