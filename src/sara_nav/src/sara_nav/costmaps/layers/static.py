"""costmap_2d::StaticLayer: the map, as a map server or a mapper sends it, and its updates.

A costmap that does not roll takes the map's size; a rolling one looks the map up wherever its window is, also when
the map's frame is another one than the costmap's.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import UNKNOWN, StaticLayerConfig, freed, static_costs
from sara_nav.costmaps.layers.base import HERE, GridLayer, Layer, Parent, combine
from sara_nav.grids.grid import Grid, GridGeometry
from sara_nav.grids.windows import Window, Windows
from sara_nav.maps.map_io import GridMap, MapError

FINEST, COARSEST, FARTHEST = 1e-4, 50.0, 1e6
"""Sensible resolutions and places of a map (m)."""
OFF_MAP = -1


class StaticLayer(GridLayer):
    """The map's obstacles and unknown space; overwrites the layers below but with ``use_maximum``."""

    config_class = StaticLayerConfig

    def attach(self, parent: Parent) -> None:
        self._map = None
        self._frame = Pose2D(0.0, 0.0, 0.0)
        self._windows = []
        super().attach(parent)

    @property
    def rolling(self) -> bool:
        """True when the costmap rolls: then ``costs`` lie on the map's cells instead of the costmap's."""
        return self.parent.config.rolling_window

    def resize(self, geometry: GridGeometry) -> None:
        if not self.rolling:
            self._windows = []
            super().resize(geometry)

    def roll(self, columns: int, rows: int) -> None:
        pass

    def stale(self, t: float) -> str:
        return '' if self._map is not None else f'no map on {self.config.map_topic} yet'

    def mapped(self) -> tuple[np.ndarray, GridGeometry, Pose2D] | None:
        """Return (costs (h, w), the GridGeometry they lie on, the costmap's frame in that grid's, Pose2D); None without
        a map.
        """
        if self._map is None:
            return None
        if self.rolling:
            return self.costs, self._map.geometry, self._frame
        return self.costs, self.parent.geometry, HERE

    # -- data in -----------------------------------------------------------------------------------------------

    def set_map(self, grid_map: GridMap) -> bool:
        """Take a GridMap; returns False when it is ignored as ``first_map_only`` asks; raises MapError."""
        if self._map is not None and self.config.first_map_only:
            return False
        check(self, grid_map)
        self._map = GridMap(np.array(grid_map.data, np.int8), grid_map.geometry)
        self._take_map()
        return True

    def update_map(self, x: int, y: int, values: np.ndarray) -> bool:
        """Take new values (rows, columns) int8 of a part of the map whose lower left cell is (x, y); MapError."""
        values = np.asarray(values)
        if self._map is None:
            self.drop('updates_without_map', 'an update of a map that has not come yet')
            raise MapError('an update came before the map')
        height, width = self._map.data.shape
        if (
            values.ndim != 2
            or values.size == 0
            or x < 0
            or y < 0
            or x + values.shape[1] > width
            or y + values.shape[0] > height
        ):
            self.drop('bad_updates', 'an update that reaches off the map')
            raise MapError(
                f'the update at ({x}, {y}) of shape {values.shape} does not lie on the map of {width} x {height} cells'
            )
        part = slice(y, y + values.shape[0]), slice(x, x + values.shape[1])
        self._map.data[part] = values
        if self.config.free_margin > 0.0:
            self._take_map()
            return True
        self.costs[part] = static_costs(values, self.config)
        if self.rolling:
            self.parent.touch_all()
        else:
            self._windows.append((x, y, x + values.shape[1], y + values.shape[0]))
        return True

    def set_frame(self, pose: Pose2D) -> None:
        """Say where the costmap's frame is in the map's (Pose2D); only a rolling costmap may be in another frame."""
        if not pose.is_finite():
            self.drop('bad_frames', 'a transform to the map that holds a NaN')
            return
        if pose != self._frame:
            self._frame = pose
            self.parent.touch_all()

    def reset(self) -> None:
        """Take the map anew, as it came last."""
        if self._map is not None:
            self._take_map()

    def reconfigure(self, config: StaticLayerConfig) -> None:
        super().reconfigure(config)
        if self._map is not None:
            self._take_map()

    def _take_map(self):
        if not self.rolling:
            self.parent.resize(self._map.geometry, locked=True)
        costs, resolution = static_costs(self._map.data, self.config), self._map.geometry.resolution
        self.costs = freed(costs, resolution, self.config.free_margin)
        self.parent.touch_all()

    # -- the layer ---------------------------------------------------------------------------------------------

    def clear(self, x0: int, y0: int, xn: int, yn: int, invert: bool) -> bool:
        if self.rolling:
            return self._clear_on_map(x0, y0, xn, yn, invert)
        return super().clear(x0, y0, xn, yn, invert)

    def _clear_on_map(self, x0, y0, xn, yn, invert):
        if self._map is None:
            return False
        g, m = self.parent.geometry, self._map.geometry
        back = self._frame.inverse()
        x, y = np.meshgrid(
            m.origin_x + (np.arange(m.width) + 0.5) * m.resolution,
            m.origin_y + (np.arange(m.height) + 0.5) * m.resolution,
        )
        c, s = math.cos(back.yaw), math.sin(back.yaw)
        column = np.floor((back.x + c * x - s * y - g.origin_x) / g.resolution)
        row = np.floor((back.y + s * x + c * y - g.origin_y) / g.resolution)
        inside = (column > x0) & (column < xn) & (row > y0) & (row < yn)
        self.costs[inside == invert] = UNKNOWN
        self.parent.touch_all()
        return True

    def update_bounds(self, t: float, pose: Pose2D | None, windows: Windows) -> None:
        pending, self._windows = self._windows, []
        for window in pending:
            windows.add(*window)

    def update_costs(self, costs: np.ndarray, window: Window) -> None:
        if self._map is None:
            return
        x0, y0, xn, yn = window
        if self.rolling:
            g, m, f = self.parent.geometry, self._map.geometry, self._frame
            source = Source(self.costs, m.grid, (float(f.x), float(f.y), float(f.yaw)))
            look_up(costs, g.grid, window, source, self.config.use_maximum)
        elif self.config.use_maximum:
            combine(costs, self.costs, window, True)
        else:
            costs[y0:yn, x0:xn] = self.costs[y0:yn, x0:xn]


def check(layer: Layer, grid_map: GridMap) -> None:
    """Raise MapError, and count it as dropped by a layer, where a GridMap cannot be laid over a costmap."""
    if not abs(grid_map.origin_yaw) <= 1e-6:  # NaN, too
        layer.drop('turned_maps', 'a map whose origin is turned')
        raise MapError(f"the map's origin is turned by {grid_map.origin_yaw:.3f} rad but must not be")
    g = grid_map.geometry
    if not (FINEST <= g.resolution <= COARSEST and max(abs(g.origin_x), abs(g.origin_y)) <= FARTHEST):
        layer.drop('bad_maps', 'a map of no sensible resolution or origin')
        raise MapError(
            f"the map's resolution is {g.resolution!r} and its origin ({g.origin_x!r}, {g.origin_y!r}), allowed "
            f'are {FINEST:g} to {COARSEST:g} and within {FARTHEST:g}'
        )
    if grid_map.data.shape != g.shape:
        layer.drop('bad_maps', 'a map whose size is not what it says')
        raise MapError(f'the map says {g.width} x {g.height} cells but holds {grid_map.data.shape}')


class Source(NamedTuple):
    """A map that costs are copied from."""

    costs: np.ndarray
    """uint8 (h, w)."""
    grid: Grid
    frame: tuple[float, float, float]
    """x, y, yaw (m, rad) of the other grid's frame in the map's."""


@kernel
def look_up(costs: np.ndarray, grid: Grid, window: Window, source: Source, maximum: bool) -> None:
    """Copy a Source's costs into a window (x0, y0, xn, yn) of a Grid; ``maximum``: where they are higher.

    Where the source's cells are smaller, a cell takes the highest of the costs known in it, lest what is thin be lost.
    Cells that lie off the map are left as they are.
    """
    points = max(int(math.ceil(grid.resolution / source.grid.resolution - 1e-6)), 1)
    x0, y0, xn, yn = window
    highest = np.full((yn - y0, xn - x0), OFF_MAP, np.int16)
    for i in range(points):
        for j in range(points):
            _take_higher(highest, grid, (x0 + (j + 0.5) / points, y0 + (i + 0.5) / points), source)
    for row in range(y0, yn):
        for column in range(x0, xn):
            cost = highest[row - y0, column - x0]
            if cost != OFF_MAP and (not maximum or cost > costs[row, column]):
                costs[row, column] = cost


@kernel
def _take_higher(highest, grid, first, source):
    """Raise costs (rows, columns) of a Grid to a Source's, at one point in each cell; first: in the first one, in cells
    (column, row). Any cost that is known is higher than an unknown one, and that than OFF_MAP.
    """
    source_x, source_y, resolution = source.grid
    frame_x, frame_y, frame_yaw = source.frame
    height, width = source.costs.shape
    c, s = math.cos(frame_yaw), math.sin(frame_yaw)
    for row in range(highest.shape[0]):
        y = grid.origin_y + (first[1] + row) * grid.resolution
        for column in range(highest.shape[1]):
            x = grid.origin_x + (first[0] + column) * grid.resolution
            u = int(math.floor((frame_x + c * x - s * y - source_x) / resolution))
            v = int(math.floor((frame_y + s * x + c * y - source_y) / resolution))
            if 0 <= u < width and 0 <= v < height:
                cost, known = source.costs[v, u], highest[row, column]
                if known in (OFF_MAP, UNKNOWN) or (cost != UNKNOWN and cost > known):
                    highest[row, column] = cost


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    costs, grid = np.zeros((2, 2), np.uint8), Grid(0.0, 0.0, 1.0)
    look_up(costs, grid, (0, 0, 2, 2), Source(costs, grid, (0.0, 0.0, 0.0)), False)
