"""sara_nav/KeepoutFilter: places where the robot is not to drive, as a mask that a map server publishes.

The mask's values and the parameters are those of Nav2's KeepoutFilter: 100 is an obstacle, 0 and unknown cost nothing,
values between cost in proportion. Without a mask the layer does nothing, and nothing waits for one.

A robot that already stands in a keep-out place is let out (``override_lethal_cost``): as long as its footprint touches
that place, its cells cost ``lethal_override_cost``; other places stay closed. The peer looks at the robot's centre and
opens all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sara_common.config import range_faults
from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import StaticLayerConfig, static_costs
from sara_nav.costmaps.layers.base import Parent
from sara_nav.costmaps.layers.mask_filter import MaskFilter, topic_faults
from sara_nav.costmaps.layers.static import Source, check, look_up
from sara_nav.grids.footprint import cover, pad_footprint
from sara_nav.grids.grid import FREE, INSCRIBED, LETHAL, UNKNOWN
from sara_nav.grids.windows import Window, Windows
from sara_nav.maps.map_io import GridMap

SHADES = StaticLayerConfig(track_unknown_space=False, trinary_costmap=False)


@dataclass(frozen=True)
class KeepoutConfig:
    """mask_topic: where the mask comes from (nav_msgs/OccupancyGrid). The rest as of nav2_costmap_2d::KeepoutFilter."""

    enabled: bool = True
    mask_topic: str = 'keepout_filter_mask'
    override_lethal_cost: bool = True
    lethal_override_cost: float = 252.0

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return range_faults(self, {'lethal_override_cost': (0.0, 252.0)}) + topic_faults(self.mask_topic)


class KeepoutFilter(MaskFilter):
    """Puts a mask's costs over those of the layers below, where they are greater."""

    config_class = KeepoutConfig

    def attach(self, parent: Parent) -> None:
        self._open = frozenset()
        super().attach(parent)

    # -- data in -----------------------------------------------------------------------------------------------

    def set_mask(self, mask: GridMap) -> None:
        check(self, mask)
        from scipy.ndimage import label  # takes long to import, and most costmaps have no mask

        self.mask, self._open = mask, frozenset()
        self._whole = static_costs(mask.data, SHADES)
        self._places, _ = label(self._whole == LETHAL, np.ones((3, 3), int))
        self.costs = self._whole
        self.parent.touch_all()

    def _moved(self):
        self.parent.touch_all()

    # -- who stands where --------------------------------------------------------------------------------------

    def forbids(self, pose: Pose2D, footprint: np.ndarray) -> bool:
        """Whether a footprint (k, 2), m, at a Pose2D of the costmap's frame would touch a keep-out place."""
        return self.enabled and bool(self._touched(pose, footprint))

    def _touched(self, pose, footprint):
        """The numbers of the keep-out places that a footprint touches."""
        if self.mask is None:
            return frozenset()
        points = cover(footprint, 0.5 * self.mask.geometry.resolution)
        rows, columns, on = self._under(self._placed(np.array([pose])), points)
        return frozenset(np.unique(self._places[rows[on], columns[on]]).tolist()) - {0}

    def _let_out(self, pose):
        """Open the places that the robot stands in. One opens once a cell's width of the robot is in it, and closes
        once the robot is a cell's width off it: what lies on its edge is no reason to drive in, nor to be shut in.
        """
        cell, footprint = self.mask.geometry.resolution, self.parent.footprint
        stands = self._touched(pose, pad_footprint(footprint, -cell))
        stays = self._open & self._touched(pose, pad_footprint(footprint, cell)) if self._open else frozenset()
        if stands | stays == self._open:
            return
        self._open = stands | stays
        cost = np.uint8(self.config.lethal_override_cost)
        self.costs = np.where(np.isin(self._places, list(self._open)), cost, self._whole)
        self.parent.touch_all()

    # -- the layer ---------------------------------------------------------------------------------------------

    def reconfigure(self, config: KeepoutConfig) -> None:
        super().reconfigure(config)
        self._open = frozenset()
        self.costs = self._whole if self.mask else None

    def update_bounds(self, t: float, pose: Pose2D | None, windows: Windows) -> None:
        if self.mask is not None and pose is not None and self.config.override_lethal_cost:
            self._let_out(pose)

    def update_costs(self, costs: np.ndarray, window: Window) -> None:
        if self.mask is None:
            return
        x0, y0, xn, yn = window
        below, own = costs[y0:yn, x0:xn], np.full((yn - y0, xn - x0), FREE, np.uint8)
        grid, f = self.parent.geometry.moved(x0, y0).grid, self._frame
        source = Source(self.costs, self.mask.geometry.grid, (float(f.x), float(f.y), float(f.yaw)))
        look_up(own, grid, (0, 0, xn - x0, yn - y0), source, True)
        np.copyto(below, own, where=np.where(below == UNKNOWN, own >= INSCRIBED, own > below))
