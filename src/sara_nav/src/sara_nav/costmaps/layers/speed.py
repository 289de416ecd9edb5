"""sara_nav/SpeedFilter: places where the robot drives slower, as a mask that a map server publishes.

The mask's values are those of Nav2's SpeedFilter: per cent of the greatest speed; 0, 100 and unknown limit nothing. It
changes no costs. The peer limits the speed from when the robot's centre is on such a cell; here all of the body counts,
and a local planner that looks ahead is slow when it gets there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.layers.base import Layer, Parent
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
        return [] if self.mask_topic else ['mask_topic is empty, allowed is the name of a topic']


class SpeedFilter(Layer):
    """Tells how much of the greatest speed is allowed where."""

    config_class = SpeedConfig
    rolling = True
    """The mask may be in another frame than the costmap."""

    def attach(self, parent: Parent) -> None:
        self.mask: GridMap | None = None
        self._box = []
        self._frame = Pose2D(0.0, 0.0, 0.0)
        super().attach(parent)

    def set_mask(self, mask: GridMap) -> None:
        """Take a mask in place of the one before; raises MapError."""
        check(self, mask)
        self.mask = mask
        self._percent = np.where((mask.data > 0) & (mask.data < WHOLE), mask.data, WHOLE).astype(np.int8)
        cells, g = np.argwhere(self._percent < WHOLE)[:, ::-1], mask.geometry
        corners = (cells.min(0), cells.max(0) + 1) if len(cells) else ()
        self._box = [np.array((g.origin_x, g.origin_y)) + g.resolution * corner for corner in corners]

    def set_frame(self, pose: Pose2D) -> None:
        """Say where the costmap's frame is in the mask's (Pose2D)."""
        if pose.is_finite():
            self._frame = pose
        else:
            self.drop('bad_frames', 'a transform to the mask that holds a NaN')

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
        f, g = self._frame, self.mask.geometry
        c, s = np.cos(f.yaw), np.sin(f.yaw)
        x, y, yaw = f.x + poses[:, :2] @ (c, -s), f.y + poses[:, :2] @ (s, c), poses[:, 2] + f.yaw
        reach = np.hypot(*points.T).max()
        low, high = self._box[0] - reach, self._box[1] + reach
        near = np.flatnonzero((x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1]))
        if not len(near):
            return allowed
        x, y, c, s = (of[near, None] for of in (x, y, np.cos(yaw), np.sin(yaw)))
        px, py = points.T
        columns = np.floor((x + c * px - s * py - g.origin_x) / g.resolution).astype(int)
        rows = np.floor((y + s * px + c * py - g.origin_y) / g.resolution).astype(int)
        on = (columns >= 0) & (columns < g.width) & (rows >= 0) & (rows < g.height)
        percent = np.where(on, self._percent[rows.clip(0, g.height - 1), columns.clip(0, g.width - 1)], WHOLE)
        allowed[near] = percent.min(1) / WHOLE
        return allowed
