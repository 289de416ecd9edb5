"""sara_nav/SpeedFilter: places where the robot drives slower, as a mask that a map server publishes.

The mask's values are those of Nav2's SpeedFilter: per cent of the greatest speed; 0, 100 and unknown limit nothing. It
changes no costs. The peer limits the speed from when the robot's centre is on such a cell; here all of the body counts,
and a local planner that looks ahead is slow when it gets there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sara_nav.costmaps.layers.base import Parent
from sara_nav.costmaps.layers.mask_filter import MaskFilter, topic_faults
from sara_nav.costmaps.layers.static import check
from sara_nav.maps.map_io import GridMap

WHOLE = 100
"""Per cent."""


@dataclass(frozen=True)
class SpeedConfig:
    """mask_topic: where the mask comes from (nav_msgs/OccupancyGrid)."""

    enabled: bool = True
    mask_topic: str = 'speed_filter_mask'

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return topic_faults(self.mask_topic)


class SpeedFilter(MaskFilter):
    """Tells how much of the greatest speed is allowed where."""

    config_class = SpeedConfig

    def attach(self, parent: Parent) -> None:
        self._box = []
        super().attach(parent)

    def set_mask(self, mask: GridMap) -> None:
        check(self, mask)
        self.mask = mask
        self._percent = np.where((mask.data > 0) & (mask.data < WHOLE), mask.data, WHOLE).astype(np.int8)
        cells, g = np.argwhere(self._percent < WHOLE)[:, ::-1], mask.geometry
        corners = (cells.min(0), cells.max(0) + 1) if len(cells) else ()
        self._box = [np.array((g.origin_x, g.origin_y)) + g.resolution * corner for corner in corners]

    @property
    def limits(self) -> bool:
        """False where the speed is limited nowhere."""
        return self.enabled and bool(self._box)

    def share(self, poses: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(n,) the share, above 0 to 1, of the greatest speed that is allowed at poses (n, 3) of the costmap's frame to
        a body that covers points (k, 2), m.
        """
        allowed = np.ones(len(poses))
        if not self.limits:
            return allowed
        placed, reach = self._placed(poses), np.hypot(*points.T).max()
        low, high = self._box[0] - reach, self._box[1] + reach
        near = ((placed[:, :2] > low) & (placed[:, :2] < high)).all(1)
        if near.any():
            rows, columns, on = self._under(placed[near], points)
            allowed[near] = np.where(on, self._percent[rows, columns], WHOLE).min(1) / WHOLE
        return allowed
