"""The map that is explored, as a Costmap: of a map builder's OccupancyGrid, or of a costmap's."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from sara_nav.costmaps.costmap import Costmap
from sara_nav.costmaps.layers.static import Source, look_up
from sara_nav.grids.grid import FREE, INSCRIBED, LETHAL, UNKNOWN
from sara_nav.maps.map_io import GridMap, MapError

_COSTS = np.full(256, LETHAL, np.uint8)
_COSTS[:99], _COSTS[99], _COSTS[255] = FREE, INSCRIBED, UNKNOWN


def ground_of(grid: GridMap) -> Costmap:
    """The Costmap of occupancy values: -1 unknown, 0 to 98 free, 99 too near to an obstacle for the robot's centre, any
    other an obstacle. Raises MapError where its origin is turned.
    """
    if abs(grid.origin_yaw) > 1e-6:
        raise MapError(f"the map's origin is turned by {grid.origin_yaw:.3f} rad but must not be")
    return Costmap(_COSTS[grid.data.view(np.uint8)], grid.geometry)


def with_obstacles(ground: Costmap, other: Costmap) -> Costmap:
    """The ground with the obstacles of another Costmap, which may lie elsewhere."""
    g, found = ground.geometry, np.full_like(ground.costs, FREE)
    obstacles = np.where(other.costs == LETHAL, np.uint8(LETHAL), np.uint8(FREE))
    look_up(found, g.grid, (0, 0, g.width, g.height), Source(obstacles, other.geometry.grid, (0.0, 0.0, 0.0)), False)
    return Costmap(np.where(found == LETHAL, found, ground.costs), g)


def updated(ground: Costmap, x: int, y: int, data: np.ndarray) -> Costmap:
    """The Costmap with occupancy values `data` int8 (rows, columns) from the cell (x, y) on. Raises MapError where that
    reaches off it.
    """
    rows, columns = data.shape
    height, width = ground.costs.shape
    if x < 0 or y < 0 or x + columns > width or y + rows > height:
        raise MapError(f'the update at ({x}, {y}) of shape {data.shape} does not lie on {width} x {height} cells')
    costs = ground.costs.copy()
    costs[y : y + rows, x : x + columns] = _COSTS[data.view(np.uint8)]
    return Costmap(costs, ground.geometry)


def filled(costmap: Costmap, wide: float) -> Costmap:
    """The Costmap on which unknown cells in gaps up to twice as wide as `wide` (m) between known ones are free."""
    costs, g = costmap.costs, costmap.geometry
    pad = math.ceil(wide / g.resolution) + 1
    known = np.pad(costs != UNKNOWN, pad)
    near = distance_transform_edt(~known) * g.resolution <= wide
    closed = (distance_transform_edt(near) * g.resolution > wide)[pad:-pad, pad:-pad]
    return Costmap(np.where(closed & (costs == UNKNOWN), FREE, costs).astype(np.uint8), g)


def large_patches(cells: np.ndarray, least: float) -> np.ndarray:
    """Those of bool cells (rows, columns) whose patch has as many as `least`."""
    labels, _ = label(cells)
    large = np.bincount(labels.ravel()) >= least
    large[0] = False
    return large[labels]


def paste(source: np.ndarray, corner: tuple[int, int], target: np.ndarray, other: tuple[int, int]) -> None:
    """Copy of an array at a corner (column, row) what lies in the target, whose corner is another one."""
    dx, dy = corner[0] - other[0], corner[1] - other[1]
    x0, y0 = max(dx, 0), max(dy, 0)
    x1, y1 = min(dx + source.shape[1], target.shape[1]), min(dy + source.shape[0], target.shape[0])
    if x1 > x0 and y1 > y0:
        target[y0:y1, x0:x1] = source[y0 - dy : y1 - dy, x0 - dx : x1 - dx]
