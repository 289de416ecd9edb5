"""The parameters of explore: names and units of explore_lite's node, and more; config/explore.yaml explains them."""

from __future__ import annotations

from dataclasses import dataclass

from sara_common.config import ConfigError, fault, number_faults
from sara_localization.config.parameters import ParameterReader

_FRAMES = ('robot_base_frame',)
_WORDS = ('costmap_topic', 'costmap_updates_topic', 'move_base')
SENSORS = ('scan', 'ranges')
_ABOVE_0 = ('planner_frequency', 'progress_timeout', 'min_frontier_size', 'transform_tolerance', 'range_reach')
_FROM_0 = ('potential_scale', 'gain_scale', 'orientation_scale', 'time_limit', 'return_by')


@dataclass(frozen=True)
class ExploreConfig:
    """m, rad, s, Hz."""

    robot_base_frame: str = 'base_link'
    costmap_topic: str = 'map'
    costmap_updates_topic: str = 'map_updates'
    move_base: str = 'move_base'
    planner_frequency: float = 1.0
    progress_timeout: float = 30.0
    min_frontier_size: float = 0.5
    potential_scale: float = 1.0
    gain_scale: float = 0.3
    orientation_scale: float = 0.5
    transform_tolerance: float = 1.0
    time_limit: float = 0.0
    return_by: float = 0.0
    sensors: str = SENSORS[0]
    range_topics: tuple[str, ...] = ()
    range_reach: float = 1.5
    return_to_init: bool = True
    visualize: bool = True
    warnings: tuple = ()

    def faults(self) -> list[str]:
        """Sentences, one for each bad value."""
        found = number_faults(self, _ABOVE_0, _FROM_0)
        if self.return_by and not self.return_to_init:
            found.append(f'return_by is {self.return_by!r}, allowed is 0 without return_to_init')
        words = {name: getattr(self, name) for name in _WORDS}
        return found + [
            fault(self, name, 'is a name') for name, word in words.items() if not (isinstance(word, str) and word)
        ]

    @classmethod
    def from_params(cls, params: dict[str, object]) -> ExploreConfig:
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        reader = ParameterReader(params)
        values = reader.by_defaults(cls, _FRAMES, apart=(*_WORDS, 'sensors', 'range_topics', 'warnings'))
        values.update({name: reader.take(name, getattr(cls, name)) for name in _WORDS})
        values['sensors'] = reader.choice('sensors', SENSORS)
        values['range_topics'] = reader.topics('range_topics', int(values['sensors'] == 'ranges'))
        warnings = tuple(f'{name} is no parameter of explore: ignored.' for name in sorted(reader.left))
        config = cls(warnings=warnings, **values)
        faults = reader.faults + config.faults()
        if faults:
            raise ConfigError(faults, warnings)
        return config
