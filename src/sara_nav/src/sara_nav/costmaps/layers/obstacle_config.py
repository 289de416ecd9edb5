"""Parameters of costmap_2d::ObstacleLayer and of its sources."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sara_common.config import range_faults

DATA_TYPES = ('PointCloud', 'PointCloud2', 'LaserScan')
OVERWRITE, MAXIMUM, NOTHING = 0, 1, 99


@dataclass(frozen=True)
class SourceConfig:
    """One source of observations (m, s): names and defaults of costmap_2d. An empty ``topic`` is the source's name, an
    empty ``sensor_frame`` that of the message."""

    name: str
    topic: str = ''
    sensor_frame: str = ''
    observation_persistence: float = 0.0
    expected_update_rate: float = 0.0
    data_type: str = 'PointCloud'
    min_obstacle_height: float = 0.0
    max_obstacle_height: float = 2.0
    inf_is_valid: bool = False
    clearing: bool = False
    marking: bool = True
    obstacle_range: float = 2.5
    raytrace_range: float = 3.0

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = []
        if self.data_type not in DATA_TYPES:
            result.append('data_type is {!r}, allowed are {}'.format(self.data_type, ', '.join(DATA_TYPES)))
        for name in ('observation_persistence', 'expected_update_rate', 'obstacle_range', 'raytrace_range'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                result.append(f'{name} is {value!r}, allowed are numbers of 0 or more')
        for name in ('min_obstacle_height', 'max_obstacle_height'):
            if math.isnan(getattr(self, name)):
                result.append(f'{name} is nan, allowed is a number')
        return result


@dataclass(frozen=True)
class ObstacleConfig:
    """Names and defaults of costmap_2d::ObstacleLayer; ``sources`` are those of ``observation_sources``.

    Not the peer's: with ``ignore_mapped`` points within ``mapped_tolerance`` (m) of a lethal cell of the static layer
    mark nothing. pixel_decay: s after which what was marked, and not again, is forgotten, though no ray has cleared it;
    0: never. passing_memory: s for which nothing is marked after move_base was told that somebody moves past the robot
    (`~wait`); what was marked so long before is forgotten; 0: points mark. mark_after: s for which a cell must be
    marked again and again, with no more than half a second between, until it counts in the costmap: who walks does not.
    """

    footprint_clearing_enabled: bool = True
    max_obstacle_height: float = 2.0
    combination_method: int = MAXIMUM
    track_unknown_space: bool = False
    transform_tolerance: float = 0.2
    ignore_mapped: bool = False
    mapped_tolerance: float = 0.1
    pixel_decay: float = 0.0
    passing_memory: float = 0.0
    mark_after: float = 0.0
    sources: tuple = ()
    enabled: bool = True

    @property
    def keeps_times(self) -> bool:
        """Whether it matters when a cell was marked."""
        return self.pixel_decay > 0.0 or self.passing_memory > 0.0 or self.mark_after > 0.0

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = [f'{source.name}/{fault}' for source in self.sources for fault in source.faults()]
        if self.combination_method not in (OVERWRITE, MAXIMUM, NOTHING):
            result.append(
                f'combination_method is {self.combination_method!r}, allowed are 0 (overwrite), 1 (maximum) and 99 '
                '(nothing)'
            )
        result += range_faults(
            self,
            {
                'max_obstacle_height': (0.0, 50.0),
                'transform_tolerance': (0.0, 10.0),
                'mapped_tolerance': (0.0, 1.0),
                'pixel_decay': (0.0, 1e6),
                'passing_memory': (0.0, 1e6),
                'mark_after': (0.0, 1e6),
            },
        )
        if len({source.name for source in self.sources}) < len(self.sources):
            result.append('observation_sources names a source twice: {}'.format(' '.join(s.name for s in self.sources)))
        return result
