"""The parameters of slam_sonar: slam_gmapping's where it has them, and range_localization's; config/slam_sonar.yaml
explains them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

from sara_common.config import ConfigError, number_faults, range_faults
from sara_localization.config.parameters import ParameterReader
from sara_slam.mapping.map_output import INTERVALS, MapOutput
from sara_slam.sonar.sonar_config import SonarConfig

_MODEL_FROM_0 = ('range_delay', 'range_min_range', 'body_length', 'body_width')
_ABOVE_0 = tuple(f.name for f in fields(SonarConfig) if f.name not in _MODEL_FROM_0)
_RANGES = {'field_of_view': (0.02, math.pi), 'steepest': (0.02, 0.5 * math.pi), 'resolution': (0.01, 0.5)}


@dataclass(frozen=True)
class SonarNodeConfig(MapOutput):
    """m, rad, s. Frames without a leading slash; `range_topics`: sensor_msgs/Range; `model`: sensors and odometry."""

    base_frame: str = 'base_link'
    map_frame: str = 'map'
    odom_frame: str = 'odom'
    range_topics: tuple[str, ...] = ()
    map_update_interval: float = 5.0
    transform_publish_period: float = 0.05
    tf_delay: float = math.nan
    map_file: str = ''
    state_file: str = ''
    model: SonarConfig = field(default_factory=SonarConfig)
    warnings: tuple[str, ...] = ()

    def faults(self) -> list[str]:
        """Sentences, one for each bad value."""
        found = number_faults(self, (), INTERVALS)
        found += number_faults(self.model, _ABOVE_0, _MODEL_FROM_0) or range_faults(self.model, _RANGES)
        if not found and not self.model.range_min_range < self.model.range_max_range:
            found.append(
                f'range_min_range is {self.model.range_min_range:g}, allowed is less than range_max_range '
                f'({self.model.range_max_range:g})'
            )
        return found + self.frame_faults()

    @classmethod
    def from_params(cls, params: dict[str, object]) -> SonarNodeConfig:
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        reader = ParameterReader(params)
        values = cls.read(reader)
        model = SonarConfig(**reader.by_defaults(SonarConfig))
        topics = reader.topics('range_topics', 1)
        warnings = tuple(f'{name} is no parameter of slam_sonar: ignored.' for name in sorted(reader.left))
        config = cls(range_topics=topics, model=model, warnings=warnings, **values)
        faults = reader.faults + config.faults()
        if faults:
            raise ConfigError(faults, warnings)
        return config
