"""Localization in lockstep corrected by the map: what range_localization makes of ekf_se's pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

from canserial.reader.readings import FIELD_OF_VIEW
from sara_bringup.lockstep.localization import Estimate
from sara_bringup.lockstep.ranges import mountings
from sara_common.planar import compose
from sara_common.platforms import parameters
from sara_localization.particles.range_localizer import RangeLocalizer
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_data import RangeData, RangeMap

if TYPE_CHECKING:
    from canserial.reader.readings import RangeReading
    from sara_common.platforms import Platform
    from sara_nav.maps.map_io import GridMap


def settings(platform: Platform) -> RangeConfig:
    """The RangeConfig that a robot is launched with."""
    return RangeConfig.from_params(parameters('sara_bringup', 'range_localization.yaml', platform))


def range_map(grid: GridMap, occupied_above: float) -> RangeMap:
    """What localization knows of a map. occupied_above: cells of a higher occupancy (0 to 100) are walls."""
    geometry = grid.geometry
    origin = geometry.origin_x, geometry.origin_y, grid.origin_yaw
    return RangeMap.from_occupancy(grid.data, geometry.resolution, origin, occupied_above)


class Corrected(Estimate):
    """`inner`: the Filter. `grid`: sara_nav's GridMap. `limits`: least and most that the sensors measure, m.
    `platform`: the robot. `config`: RangeConfig, the robot's where none is given.
    """

    def __init__(self, inner, grid, limits, platform, config=None):
        super().__init__()
        self._inner, self._limits, self._places = inner, limits, mountings(platform)
        self.on_imu, self.on_odometry = inner.on_imu, inner.on_odometry
        config = config or settings(platform)
        self.localizer = RangeLocalizer(config, range_map(grid, config.map_occupied_above))

    def on_range(self, reading: RangeReading) -> None:
        """A canserial RangeReading."""
        self.localizer.on_range(
            RangeData(
                reading.name, reading.stamp, self._places[reading.name], reading.range, *self._limits, FIELD_OF_VIEW
            )
        )

    @property
    def lost_probability(self) -> float:
        """That the pose is wrong, 0 to 1."""
        return self.localizer.lost_probability

    def set_pose(self, pose: tuple[float, float, float], now: float) -> None:
        """As Filter's; from there on the filter is believed anew."""
        refused = self._inner.set_pose(pose, now)
        if refused is None:
            self.localizer.forget()
        return refused

    def start_anywhere(self) -> str:
        """As the service `global_localization`; returns '' or why that cannot be."""
        return self.localizer.start_anywhere()

    def step(self, now: float) -> bool:
        """The filter's tick, and what is given out with the correction on it; nothing while the place is searched
        for.
        """
        inner, localizer = self._inner, self.localizer
        if not inner.step(now):
            return False
        localizer.on_pose(inner.stamp, inner.pose)
        if localizer.searching:
            self.pose = self.map_from_odom = None
            return False
        correction = localizer.correction
        self.velocity, self.stamp, self.pose = inner.velocity, inner.stamp, compose(correction.offset, inner.pose)
        self.map_from_odom = inner.map_from_odom and compose(correction.offset, inner.map_from_odom)
        return True
