"""The ultrasonic sensors in lockstep: from read.py's readings to the range layers of a costmap, as its ROS shell does
it with tf.

Where the sensors sit is what the URDF says: its fixed joints from `base_link` to `NAME_frame`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree

from canserial.reader.readings import FIELD_OF_VIEW
from sara_bringup.platforms.sensor_places import NOWHERE, fixed_places
from sara_common.planar import compose
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorLayer

if TYPE_CHECKING:
    from canserial.reader.config import ReaderConfig
    from sara_common.platforms import Platform
    from sara_nav.move_base.state_machine import MoveBase


def mountings(platform: Platform) -> dict[str, tuple[float, float, float]]:
    """{name of the sensor: (x, y, yaw) in `base_link`, m, rad} as the platform's URDF says it. Raises ValueError where
    it puts one nowhere.
    """
    found = {}
    for link, place in fixed_places(ElementTree.fromstring(platform.urdf)).items():
        if link.endswith('_frame') or link == 'scan':
            if not place.is_finite():
                raise ValueError(NOWHERE.format(link))
            found[link.removesuffix('_frame')] = tuple(place)
    return found


class RangeFeeds:
    """Gives the range layers of both of move_base's costmaps what they listen to.

    `move_base`: MoveBase. `reader`: read.py's ReaderConfig, for the limits it publishes with each reading. `places`:
    where the sensors sit, of `mountings`. `local_frame`: of the local costmap. Raises ValueError where a costmap is in
    neither `map` nor `odom`, the frames that lockstep knows.
    """

    def __init__(
        self, move_base: MoveBase, reader: ReaderConfig, places: dict[str, tuple[float, float, float]]
    ) -> None:
        self._limits, self._places = (reader.range_min, reader.range_max), places
        self._listeners = {}  # {topic: (layers of costmaps in map, of those in odom)}
        self.local_frame = move_base.local_costmap.config.global_frame
        for costmap in (move_base.global_costmap, move_base.local_costmap):
            frame = costmap.config.global_frame
            if frame not in ('map', 'odom'):
                raise ValueError(f"a costmap's global_frame is {frame!r}, but lockstep has map and odom alone")
            for layer in costmap.layers.values():
                if isinstance(layer, RangeSensorLayer):
                    for source in layer.config.sources():
                        self._listeners.setdefault(source, ([], []))[frame == 'odom'].append(layer)

    def add(
        self, reading: RangeReading, in_map: tuple[float, float, float] | None, in_odom: tuple[float, float, float]
    ) -> None:
        """A canserial RangeReading, and `base_link` in map and in odom: (x, y, yaw), m, rad; in_map is None before it
        is known.
        """
        source = f'/{reading.name}_range'
        for base, layers in zip((in_map, in_odom), self._listeners.get(source, ())):
            if layers and base is not None:
                x, y, yaw = compose(base, self._places[reading.name])
                placed = RangeReading(source, reading.stamp, x, y, yaw, reading.range, *self._limits, FIELD_OF_VIEW)
                for layer in layers:
                    layer.add_range(placed)
