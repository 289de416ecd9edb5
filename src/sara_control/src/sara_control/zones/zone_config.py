"""What the distance zones are configured with: the body, how it stops, and where its range sensors sit."""

import math
from dataclasses import dataclass
from typing import Any

from sara_common.config import ConfigError, is_number, number_faults
from sara_common.platforms import OfPlatform, Platform

CRAWL = 0.04  # m/s: no faster towards a pedestrian who approaches
SLACK = 1.25  # creeping may be this much faster before it is braked hard: v and w are limited each by itself


@dataclass(frozen=True)
class RangeSensor:
    """A sensor on the chair: name, place x, y (m) and yaw (rad) in the base frame.

    near: what a reading of -Inf counts as, m. stops: whether it may stop the chair or only slow it to creeping.
    """

    name: str
    x: float
    y: float
    yaw: float
    near: float = 0.0
    stops: bool = True

    @property
    def side(self) -> str:
        """Where it looks: front, rear, left or right."""
        x, y = math.cos(self.yaw), math.sin(self.yaw)
        if abs(x) >= abs(y):
            return 'front' if x > 0.0 else 'rear'
        return 'left' if y > 0.0 else 'right'


@dataclass(frozen=True)
class ZoneConfig(OfPlatform):
    """length, width: of the body, centred on the base frame, m; they must be given. side_margin: added to each side, m;
    turning_margin: and so much more where the chair turns in place. field_of_view: rad, of each sensor.

    stop_distance: m. reaction_time: s from an echo to the wheels' answer. braking, hard_braking: m/s2. ease: s more
    that is reckoned with for the former, so that it begins gently. creep_speed: m/s. trigger, release: how many
    readings in a row make a range nearer, or farther.
    """

    sensors: tuple
    length: float = 0.0
    width: float = 0.0
    side_margin: float = 0.02
    turning_margin: float = 0.02
    field_of_view: float = math.radians(60.0)
    stop_distance: float = 0.15
    reaction_time: float = 0.75
    braking: float = 0.8
    hard_braking: float = 1.5
    ease: float = 0.6
    creep_speed: float = 0.1
    trigger: int = 2
    release: int = 3

    def __post_init__(self):
        faults = number_faults(
            self,
            above_0=(
                'length',
                'width',
                'field_of_view',
                'stop_distance',
                'reaction_time',
                'braking',
                'hard_braking',
                'creep_speed',
            ),
            from_0=('side_margin', 'turning_margin', 'ease'),
        )
        for name in ('trigger', 'release'):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= 10:
                faults.append(f'{name} is {value!r}, allowed are whole numbers from 1 to 10')
        if not faults and self.way_to_rest(SLACK * self.creep_speed) >= self.stop_distance:
            faults.append(
                f'creep_speed is {self.creep_speed!r}, allowed are speeds that come to rest well within stop_distance '
                f'({self.stop_distance!r} m)'
            )
        if faults:
            raise ConfigError(faults)

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """Its body."""
        return dict(zip(('length', 'width'), platform.size))

    def way_to_rest(self, u: float) -> float:
        """How far the chair goes from speed u (m/s) to rest, m."""
        return u * self.reaction_time + u * u / (2.0 * self.braking)

    @classmethod
    def from_params(cls, params: dict) -> 'ZoneConfig':
        """From a dictionary; `sensors` maps names to x, y, yaw_deg and optionally near, stops. Raises ConfigError."""
        values = dict(params)
        faults = [
            f'{name} is {values.pop(name)!r}, but there is no such parameter'
            for name in list(values)
            if name not in cls.__dataclass_fields__ and name != 'field_of_view_deg'
        ]
        if 'field_of_view_deg' in values:
            degrees = values.pop('field_of_view_deg')
            values['field_of_view'] = math.radians(degrees) if is_number(degrees) else degrees
        sensors = values.get('sensors', {})
        if not isinstance(sensors, dict):
            faults.append(f'sensors is {sensors!r}, allowed is a mapping from names to places')
            sensors = {}
        values['sensors'] = tuple(filter(None, (_sensor(name, place, faults) for name, place in sensors.items())))
        try:
            config = cls(**values)
        except ConfigError as error:
            faults.append(str(error))
        if faults:
            raise ConfigError(faults)
        return config


def _sensor(name, place, faults):
    """The RangeSensor, or None and its faults added."""
    found = []
    place = place if isinstance(place, dict) else {}
    for key in ('x', 'y', 'yaw_deg'):
        if not is_number(place.get(key)):
            found.append(f'sensors/{name}/{key} is {place.get(key)!r}, allowed are numbers')
    near, stops = place.get('near', 0.0), place.get('stops', True)
    if not is_number(near) or near < 0:
        found.append(f'sensors/{name}/near is {near!r}, allowed are numbers of 0 or more')
    if not isinstance(stops, bool):
        found.append(f'sensors/{name}/stops is {stops!r}, allowed are true and false')
    found += [
        f'sensors/{name}/{key} is {place[key]!r}, but there is no such parameter'
        for key in place
        if key not in ('x', 'y', 'yaw_deg', 'near', 'stops')
    ]
    faults += found
    return None if found else RangeSensor(name, place['x'], place['y'], math.radians(place['yaw_deg']), near, stops)
