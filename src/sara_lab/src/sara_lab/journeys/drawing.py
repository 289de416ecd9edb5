"""Maps and the chair's body in pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sara_common.platforms import chosen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Polygon

    from sara_sim.world.world import World


def draw_map(axis: Axes, world: World) -> None:
    """What is occupied, in the map frame, m."""
    size, (x0, y0) = world.resolution, world.origin
    axis.imshow(
        world.occupied,
        origin='lower',
        cmap='Greys',
        vmin=0,
        vmax=1.6,
        interpolation='nearest',
        extent=(x0, x0 + size * world.occupied.shape[1], y0, y0 + size * world.occupied.shape[0]),
    )


def body_at(pose: tuple[float, float, float], **style) -> Polygon:
    """The outline of the body at a pose (x, y, yaw; m, rad), as a patch."""
    from matplotlib.patches import Polygon

    x, y, yaw = pose
    corners = 0.5 * np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)]) * chosen().size
    c, s = np.cos(yaw), np.sin(yaw)
    return Polygon(corners @ np.array([[c, s], [-s, c]]) + (x, y), **style)
