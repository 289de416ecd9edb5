"""The costmap that move_base drives on: layers over one grid, of which only what changed is computed anew.

costmap_2d's LayeredCostmap and Costmap2DROS without ROS: the scheme is Lu, Hershberger and Smart's (IROS 2014). A
rolling costmap moves with the robot by whole cells; what it still sees is kept.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sara_common.config import range_faults
from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import FREE, UNKNOWN, Costmap
from sara_nav.costmaps.layers import obstacle, range_sensor, static
from sara_nav.costmaps.layers.base import Layer, shifted
from sara_nav.grids import collision, distances
from sara_nav.grids.footprint import radii
from sara_nav.grids.grid import GridGeometry
from sara_nav.grids.windows import Window, Windows, area

FARTHEST = 1e6
"""A robot further (m) than this from the origin of its frame is not believed to be there."""


@dataclass(frozen=True)
class CostmapConfig:
    """Parameters of a costmap (m, Hz, s); names and defaults of costmap_2d."""

    global_frame: str = 'map'
    robot_base_frame: str = 'base_link'
    rolling_window: bool = False
    track_unknown_space: bool = False
    always_send_full_costmap: bool = False
    transform_tolerance: float = 0.3
    update_frequency: float = 5.0
    publish_frequency: float = 0.0
    width: float = 10.0
    height: float = 10.0
    resolution: float = 0.05
    origin_x: float = 0.0
    origin_y: float = 0.0

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = range_faults(
            self,
            {
                'transform_tolerance': (0.0, 10.0),
                'update_frequency': (0.0, 100.0),
                'publish_frequency': (0.0, 100.0),
                'origin_x': (-1e6, 1e6),
                'origin_y': (-1e6, 1e6),
            },
        )
        if not 1e-4 <= self.resolution <= 50.0:
            result.append(f'resolution is {self.resolution!r}, allowed are numbers from 0.0001 to 50')
        else:
            cells = [side / self.resolution for side in (self.width, self.height)]
            for name, count in zip(('width', 'height'), cells):
                if not (math.isfinite(count) and count > 1.0 - 1e-9):
                    result.append(
                        f'{name} is {getattr(self, name)!r}, allowed is a finite number, at least resolution '
                        f'({self.resolution:g})'
                    )
            if not result and cells[0] * cells[1] > 1e8:
                result.append(
                    f'width, height and resolution give {cells[0] * cells[1]:.3g} cells but must give at most 1e8'
                )
        for name in ('global_frame', 'robot_base_frame'):
            if not getattr(self, name).strip('/'):
                result.append(f'{name} is {getattr(self, name)!r}, allowed is the name of a frame')
        return result

    def geometry(self) -> GridGeometry:
        """Return the GridGeometry these parameters ask for; parts of cells are cut off."""
        return GridGeometry(
            int(self.width / self.resolution + 1e-9),
            int(self.height / self.resolution + 1e-9),
            self.resolution,
            self.origin_x,
            self.origin_y,
        )


class LayeredCostmap:
    """A costmap of layers. footprint: padded corners (k, 2) in the robot's frame, m. Times are in s, of one clock.

    ``cells_computed`` counts the cells of all updates, each once for every time its costs were put together.
    """

    def __init__(self, config: CostmapConfig, layers: Sequence[Layer], footprint: np.ndarray) -> None:
        warm()
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        if len({layer.name for layer in layers}) < len(layers):
            raise ValueError('two layers have the same name: {}'.format(', '.join(layer.name for layer in layers)))
        self.config = config
        self.layers = {layer.name: layer for layer in layers}
        self.updated_at = None
        self.cells_computed = 0
        self.bad_poses = 0
        self._next = None
        self._locked = False
        self._everything = True
        self._set_footprint(footprint)
        self._set_geometry(config.geometry())
        for layer in layers:
            layer.attach(self)

    # -- what planners look at ---------------------------------------------------------------------------------

    @property
    def costmap(self) -> Costmap:
        """The Costmap as of the last update; live, and another object after it rolled or was resized."""
        return self._costmap

    @property
    def geometry(self) -> GridGeometry:
        """The GridGeometry of the costmap."""
        return self._costmap.geometry

    @property
    def map_layers(self) -> dict[str, Layer]:
        """The layers that show a map, by their names: those with set_map."""
        return {name: layer for name, layer in self.layers.items() if hasattr(layer, 'set_map')}

    @property
    def keepout_layers(self) -> dict[str, Layer]:
        """The layers that hold keep-out places, by their names: those that forbid places."""
        return {name: layer for name, layer in self.layers.items() if hasattr(layer, 'forbids')}

    @property
    def speed_layers(self) -> dict[str, Layer]:
        """The layers that limit the speed, by their names: those that tell of which share is allowed."""
        return {name: layer for name, layer in self.layers.items() if hasattr(layer, 'share')}

    @property
    def free_margin(self) -> float:
        """m about free cells of the maps in which unknown ones are free (StaticLayerConfig); 0 without such a layer."""
        return max((layer.config.free_margin for layer in self.map_layers.values()), default=0.0)

    def current(self, t: float) -> str:
        """Return '' when all layers have what they need, else sentences on what is stale."""
        found = [layer.stale(t) for layer in self.layers.values() if layer.enabled]
        return '; '.join(text for text in found if text)

    # -- updating ----------------------------------------------------------------------------------------------

    def due(self, t: float) -> bool:
        """True when update_frequency asks for an update at ``t``; at 0 it never does."""
        if self.config.update_frequency <= 0.0:
            return False
        return self._next is None or t >= self._next - 1e-6 or t < self.updated_at - 1e-6

    def update(self, t: float, pose: Pose2D | None) -> Window | None:
        """Bring the costmap up to ``t``; pose: Pose2D of the robot in global_frame, or None when it is not known.

        Returns the window (x0, y0, xn, yn) of cells that changed, or None.
        """
        self._note_time(t)
        if pose is not None and not (pose.is_finite() and max(abs(pose.x), abs(pose.y)) <= FARTHEST):
            self.bad_poses += 1
            pose = None
        windows = Windows(self.geometry)
        if self.config.rolling_window and pose is not None:
            windows = self._roll(pose)
        layers = [layer for layer in self.layers.values() if layer.enabled]
        for layer in layers:
            layer.update_bounds(t, pose, windows)
        if self._everything:
            self._everything = False
            windows.add_all()
        costs = self._costmap.costs
        for x0, y0, xn, yn in windows:
            costs[y0:yn, x0:xn] = self._default
            self.cells_computed += area((x0, y0, xn, yn))
        for layer in layers:
            for window in windows:
                layer.update_costs(costs, window)
            for window in windows:
                layer.finish(costs, window)
        return windows.bounds()

    def _note_time(self, t):
        if self.updated_at is not None and t < self.updated_at - 1e-6:
            for layer in self.layers.values():
                layer.time_went_back(t)
            self._next = None
        if self.config.update_frequency > 0.0:
            period = 1.0 / self.config.update_frequency
            late = self._next is None or t - self._next > period
            self._next = t + period if late else max(self._next, t - period) + period
        self.updated_at = t

    def _roll(self, pose):
        """Move the window so that the robot is in its middle; return the Windows that came into sight."""
        g = self.geometry
        width, height = g.size
        columns = int((pose.x - 0.5 * width - g.origin_x) / g.resolution)
        rows = int((pose.y - 0.5 * height - g.origin_y) / g.resolution)
        if columns == 0 and rows == 0:
            return Windows(g)
        self._cells_moved = self._cells_moved[0] + columns, self._cells_moved[1] + rows
        moved = self._start.moved(*self._cells_moved)
        self._costmap = Costmap(shifted(self._costmap.costs, columns, rows, self._default), moved)
        windows = Windows(moved)
        left, low = max(0, -columns), max(0, -rows)
        right, high = left + g.width - abs(columns), low + g.height - abs(rows)
        if left < right and low < high:
            windows.add(0, 0, left, g.height)
            windows.add(right, 0, g.width, g.height)
            windows.add(0, 0, g.width, low)
            windows.add(0, high, g.width, g.height)
        else:
            windows.add_all()
        for layer in self.layers.values():
            layer.roll(columns, rows)
        return windows

    # -- changes -----------------------------------------------------------------------------------------------

    def touch_all(self) -> None:
        """Have everything computed anew in the next update."""
        self._everything = True

    def resize(self, geometry: GridGeometry, locked: bool = False) -> None:
        """Take a GridGeometry; what sensors said is forgotten if it is another one. locked: a map gave it, parameters
        yield to it.
        """
        self._locked = self._locked or locked
        if geometry == self.geometry:
            return
        self._set_geometry(geometry)
        for layer in self.layers.values():
            layer.resize(geometry)

    def _set_geometry(self, geometry):
        self._default = UNKNOWN if self.config.track_unknown_space else FREE
        self._start, self._cells_moved = geometry, (0, 0)
        self._costmap = Costmap(np.full(geometry.shape, self._default, np.uint8), geometry)
        self._everything = True

    def set_footprint(self, corners: np.ndarray) -> None:
        """Take another padded outline (k, 2) of the robot, m."""
        self._set_footprint(corners)
        for layer in self.layers.values():
            layer.footprint_changed()

    def _set_footprint(self, corners):
        self.footprint = np.array(corners, dtype=np.float64)
        self.inscribed_radius, self.circumscribed_radius = radii(self.footprint)

    def reconfigure(self, config: CostmapConfig) -> None:
        """Take other parameters; raises ValueError. Size and place change unless a map gave them."""
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        old, self.config = self.config, config
        self._next = None
        if not self._locked and config.geometry() != old.geometry():
            self.resize(config.geometry())
        self.touch_all()

    def reset(self) -> None:
        """Forget what sensors said; maps stay."""
        self._costmap.costs[:] = self._default
        for layer in self.layers.values():
            layer.reset()
        self.touch_all()

    def clear_area(
        self, x0: float, y0: float, x1: float, y1: float, invert: bool, layer_names: Sequence[str]
    ) -> list[str]:
        """Forget, in the layers named, all but a rectangle (m, global frame), or with ``invert`` what is in it.

        Cells that the rectangle's edges run through count as outside. Returns the names of the layers cleared; the
        costs follow with the next update.
        """
        if not all(abs(v) <= 10.0 * FARTHEST for v in (x0, y0, x1, y1)):
            raise ValueError(f'the area ({x0!r}, {y0!r}) to ({x1!r}, {y1!r}) must be finite and near')
        low = self.geometry.to_cell_unbounded(x0, y0)
        high = self.geometry.to_cell_unbounded(x1, y1)
        return [
            name
            for name, layer in self.layers.items()
            if name.split('/')[-1] in layer_names and layer.clear(*low, *high, bool(invert))
        ]


@functools.cache
def warm() -> None:
    """Compile, or load from the cache, every kernel that costmaps use, once; making a costmap does it too."""
    for module in (collision, distances, obstacle, range_sensor, static):
        module.warm()
