"""costmap_2d::InflationLayer: costs that fall off around obstacles, by exact distances.

An obstacle reaches ``inflation_radius`` far, so what changed is widened by that much and nothing else is computed. The
peer spreads obstacles by a wave that is not exact in rare cells; this one is.
"""

from __future__ import annotations

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import INSCRIBED, InflationConfig, cost_table, reach_of
from sara_nav.costmaps.layers.base import Layer, Parent, shifted
from sara_nav.grids import distances
from sara_nav.grids.grid import GridGeometry
from sara_nav.grids.windows import Window, Windows


class InflationLayer(Layer):
    """Spreads the obstacles of the layers below it."""

    config_class = InflationConfig

    def attach(self, parent: Parent) -> None:
        self._everything = True
        self._left = []
        super().attach(parent)

    def resize(self, geometry: GridGeometry) -> None:
        self._obstacles = np.zeros(geometry.shape, np.uint8)
        self._left = []
        self.footprint_changed()

    def roll(self, columns: int, rows: int) -> None:
        """Obstacles that left the window cost nothing any more in what they reached into."""
        self._obstacles = shifted(self._obstacles, columns, rows, 0)
        height, width = self._obstacles.shape
        if columns:
            self._left.append((0, 0, self.reach, height) if columns > 0 else (width - self.reach, 0, width, height))
        if rows:
            self._left.append((0, 0, width, self.reach) if rows > 0 else (0, height - self.reach, width, height))

    @property
    def reach(self) -> int:
        """How far an obstacle reaches (cells)."""
        if not self.enabled:
            return 0
        geometry = self.parent.geometry
        return reach_of(self.config.inflation_radius, geometry.resolution, geometry.shape)

    def footprint_changed(self) -> None:
        self._table = cost_table(
            self.reach, self.parent.geometry.resolution, self.parent.inscribed_radius, self.config.cost_scaling_factor
        )
        self._everything = True

    def reconfigure(self, config: InflationConfig) -> None:
        super().reconfigure(config)
        self.footprint_changed()

    def reset(self) -> None:
        self._everything = True

    def update_bounds(self, t: float, pose: Pose2D | None, windows: Windows) -> None:
        left, self._left = self._left, []
        if self._everything:
            self._everything = False
            windows.add_all()
            return
        windows.grow(self.reach)
        for window in left:
            windows.add(*window)

    def update_costs(self, costs: np.ndarray, window: Window) -> None:
        """Obstacles are remembered as they are below this layer, so that those of layers above are never spread."""
        distances.pick_lethal(costs, self._obstacles, window)

    def finish(self, costs: np.ndarray, window: Window) -> None:
        """Spread the obstacles into a window, once those of all windows are known."""
        if self.reach:
            distances.spread(
                self._obstacles,
                costs,
                window,
                self.reach,
                self._table,
                1 if self.config.inflate_unknown else INSCRIBED,
            )
