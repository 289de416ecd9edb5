"""The parameters that say where a map builder's map goes, and when: the same of slam_gmapping and slam_sonar."""

from __future__ import annotations

import math

from sara_localization.config.parameters import ParameterReader

FRAMES = ('base_frame', 'map_frame', 'odom_frame')
INTERVALS = ('map_update_interval', 'transform_publish_period')
"""s, 0 or more."""
_FILES = ('map_file', 'state_file')


class MapOutput:
    """For dataclasses with FRAMES, INTERVALS, tf_delay (NaN: not given), map_file and state_file ('': none)."""

    base_frame: str
    map_frame: str
    odom_frame: str
    map_update_interval: float
    transform_publish_period: float
    tf_delay: float
    map_file: str
    state_file: str

    @property
    def delay(self) -> float:
        """By how much map -> odom is dated ahead, s: tf_delay, or transform_publish_period where that is not given."""
        return self.transform_publish_period if math.isnan(self.tf_delay) else self.tf_delay

    def frame_faults(self) -> list[str]:
        """A sentence where frames are the same."""
        names = [getattr(self, name) for name in FRAMES]
        if len(set(names)) == len(names):
            return []
        return [f'base_frame, map_frame and odom_frame must differ; they are {", ".join(names)}']

    @classmethod
    def read(cls, reader: ParameterReader) -> dict[str, object]:
        """{field: value} of a reader: by their defaults, and these that are read otherwise."""
        values = reader.by_defaults(cls, FRAMES, apart=('tf_delay', *_FILES))
        for name in _FILES:
            if reader.left.get(name) == '':
                reader.take(name)
            elif name in reader.left:
                values[name] = reader.file(name, '')
        if 'tf_delay' in reader.left:
            values['tf_delay'] = reader.number('tf_delay', 0.0)
        return values
