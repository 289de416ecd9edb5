"""Parameters of range_sensor_layer::RangeSensorLayer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sara_common.config import range_faults

SENSOR_TYPES = ('VARIABLE', 'FIXED', 'ALL')


@dataclass(frozen=True)
class RangeSensorConfig:
    """Names of range_sensor_layer::RangeSensorLayer; two defaults differ, see the module. transform_tolerance is also
    read under the peer's name transform_tolerance_.

    Not the peer's: ignore_mapped: an echo whose arc has something of the costmap's static layer within mapped_tolerance
    (m) marks nothing, and clears up to there. mapped_steepest: rad, walls of the map whose normal is further than this
    from the sensor's axis are not expected to echo. ignore_seen: the same with what obstacle layers of the costmap have
    marked, for a laser scanner knows where on the arc it is. free_memory: s, cells that were seen free no longer ago
    are not what echoes, as long as others on the arc may be; 0: nobody remembers. passing_memory: s for which echoes
    mark nothing after move_base was told that somebody moves past the robot (`~wait`); what they marked so long before
    is forgotten; 0: they mark.
    """

    topics: tuple = ('/sonar',)
    ns: str = ''
    input_sensor_type: str = 'ALL'
    use_decay: bool = True
    pixel_decay: float = 10.0
    transform_tolerance: float = 0.3
    phi: float = 1.2
    inflate_cone: float = 1.0
    no_readings_timeout: float = 0.0
    clear_threshold: float = 0.2
    mark_threshold: float = 0.8
    clear_on_max_reading: bool = True
    ignore_mapped: bool = False
    mapped_tolerance: float = 0.2
    mapped_steepest: float = 0.5 * math.pi
    ignore_seen: bool = False
    free_memory: float = 0.0
    passing_memory: float = 0.0
    enabled: bool = True

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = []
        if isinstance(self.topics, str) or not all(isinstance(topic, str) and topic for topic in self.topics):
            result.append(f'topics is {self.topics!r}, allowed is a list of names')
        if self.input_sensor_type.upper() not in SENSOR_TYPES:
            result.append(
                'input_sensor_type is {!r}, allowed are {}'.format(self.input_sensor_type, ', '.join(SENSOR_TYPES))
            )
        result += range_faults(
            self,
            {
                'pixel_decay': (0.0, 1e6),
                'transform_tolerance': (0.0, 10.0),
                'phi': (0.0, 1e3),
                'inflate_cone': (0.0, 1.0),
                'no_readings_timeout': (0.0, 1e6),
                'clear_threshold': (0.0, 1.0),
                'mark_threshold': (0.0, 1.0),
                'mapped_tolerance': (0.0, 10.0),
                'free_memory': (0.0, 1e6),
                'passing_memory': (0.0, 1e6),
                'mapped_steepest': (0.0, 0.5 * math.pi),
            },
        )
        if not result and self.clear_threshold > self.mark_threshold:
            result.append(
                f'clear_threshold is {self.clear_threshold:g}, allowed is mark_threshold ({self.mark_threshold:g}) '
                'and less'
            )
        return result

    def sources(self) -> tuple[str, ...]:
        """Return the topics with ``ns`` before them."""
        if not self.ns:
            return tuple(self.topics)
        return tuple('{}/{}'.format(self.ns.rstrip('/'), topic.lstrip('/')) for topic in self.topics)
