"""What keep-out and slow places have in common: a mask that a map server publishes, in whatever frame."""

from __future__ import annotations

import numpy as np

from sara_common.planar import Pose2D
from sara_common.repeatable import cos_sin
from sara_nav.costmaps.layers.base import Layer, Parent
from sara_nav.maps.map_io import GridMap


class MaskFilter(Layer):
    """A layer whose config has the `mask_topic` that its `mask` comes from; None before the first."""

    rolling = True
    """The mask may be in another frame than the costmap."""

    def attach(self, parent: Parent) -> None:
        self.mask: GridMap | None = None
        self._frame = Pose2D(0.0, 0.0, 0.0)
        super().attach(parent)

    def set_mask(self, mask: GridMap) -> None:
        """Take a mask in place of the one before; raises MapError."""
        raise NotImplementedError

    def set_frame(self, pose: Pose2D) -> None:
        """Say where the costmap's frame is in the mask's (Pose2D)."""
        if not pose.is_finite():
            self.drop('bad_frames', 'a transform to the mask that holds a NaN')
        elif pose != self._frame:
            self._frame = pose
            self._moved()

    def _moved(self):
        """The mask lies elsewhere now."""

    def _placed(self, poses):
        """(n, 3): poses (n, 3) of the costmap's frame in the mask's."""
        f = self._frame
        c, s = np.cos(f.yaw), np.sin(f.yaw)
        return np.column_stack((f.x + poses[:, :2] @ (c, -s), f.y + poses[:, :2] @ (s, c), f.yaw + poses[:, 2]))

    def _under(self, poses, points):
        """(rows, columns, which of them are on the mask), (n, k) each: cells under points (k, 2), m, of a body at poses
        (n, 3) of the mask's frame.
        """
        g, (px, py) = self.mask.geometry, points.T
        x, y, yaw = (of[:, None] for of in poses.T)
        c, s = cos_sin(yaw)
        columns = np.floor((x + c * px - s * py - g.origin_x) / g.resolution)
        rows = np.floor((y + s * px + c * py - g.origin_y) / g.resolution)
        on = (columns >= 0) & (columns < g.width) & (rows >= 0) & (rows < g.height)
        return np.where(on, rows, 0).astype(int), np.where(on, columns, 0).astype(int), on


def topic_faults(topic: str) -> list[str]:
    """Return what is wrong with a mask_topic."""
    return [] if topic else ['mask_topic is empty, allowed is the name of a topic']
