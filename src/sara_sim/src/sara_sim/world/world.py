"""What stands around the chair: a map of occupied cells that sonars see and bodies touch, obstacles that the map does
not show, ramps.

Maps are the image and YAML pair of ROS's map_server; only occupied cells matter here (unknown ones are empty). Outside
the image there is nothing but obstacles.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import yaml

from sara_common.config import is_number
from sara_common.grids.images import ImageError, read_image
from sara_sim.world import rays, smooth
from sara_sim.world.obstacles import Obstacles
from sara_sim.world.rays import Cone, Walls
from sara_sim.world.terrain import Threshold

# Walls on a grid are stairs: their direction is that of the occupancy blurred over this many cells.
_BLUR_CELLS = 1.5
MODES = ('trinary', 'scale', 'raw')  # of map_server
RAW_OCCUPIED, RAW_UNKNOWN = 100, 255  # values of cells, from there on occupied, in maps of the mode raw


class WorldError(ValueError):
    """A map that cannot be read, or a chair put into a wall."""


class World:
    """An occupancy grid with sonar and contact queries.

    `occupied`: (rows, columns) bool, row 0 at the lowest y. `resolution`: m per cell. `origin`: (x, y) of the lower
    left corner, m, map frame.
    `obstacles`: `Obstacles` at one time; whoever steps the world moves them. `ramps`: list of `terrain.Ramp`.
    """

    def __init__(
        self,
        occupied: np.ndarray,
        resolution: float = 0.05,
        origin: tuple[float, float] = (0.0, 0.0),
        obstacles=(),
        ramps=(),
    ):
        self.occupied = np.ascontiguousarray(occupied, dtype=np.bool_)
        if self.occupied.ndim != 2 or self.occupied.size == 0:
            raise WorldError(
                f'the map has shape {self.occupied.shape}, allowed is one of two dimensions that is not empty'
            )
        if not (math.isfinite(resolution) and resolution > 0):
            raise WorldError(f'resolution is {resolution!r}, allowed are numbers above 0 (m per cell)')
        self.resolution = float(resolution)
        self.origin = (float(origin[0]), float(origin[1]))
        self.obstacles = Obstacles(obstacles)
        self.ramps = list(ramps)
        self.thresholds: list[Threshold] = []
        self._walls = Walls(self.occupied, *_wall_normals(self.occupied), self.resolution)
        self._reach: dict = {}
        rays.warm()  # here and not in the middle of a drive

    @classmethod
    def empty(cls) -> World:
        """A floor without walls or end."""
        return cls(np.zeros((1, 1), bool))

    @classmethod
    def from_yaml(cls, path: str | Path) -> World:
        """The map of a map_server YAML file. Raises WorldError with one sentence per fault found."""
        path = Path(path)
        try:
            text = yaml.safe_load(path.read_text())
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise WorldError(f'the map {path} cannot be read: {error}.') from error
        faults, values = _checked(text, path)
        if faults:
            raise WorldError('; '.join(faults))
        image, resolution, origin, negate, threshold, mode = values
        try:
            pixels = read_image(path.parent / image)
        except ImageError as error:
            raise WorldError(f'image is {image!r}, but the {error}.') from None
        if pixels.ndim == 3:
            pixels = pixels[:, :, :3].mean(axis=2)
        shade = 255 - pixels if negate else pixels
        if mode == 'raw':
            return cls((shade[::-1] >= RAW_OCCUPIED) & (shade[::-1] != RAW_UNKNOWN), resolution, origin)
        return cls((255.0 - shade[::-1]) / 255.0 > threshold, resolution, origin)

    @classmethod
    def from_grid(
        cls, cells: np.ndarray, resolution: float, origin: tuple[float, float, float], threshold: int = 65
    ) -> World:
        """The map of a nav_msgs/OccupancyGrid. cells: (rows, columns), occupied from `threshold` per cent on; origin:
        (x, y, yaw) of its lower left corner, m, rad. Raises WorldError.
        """
        if not all(map(is_number, origin)) or abs(origin[2]) > 1e-6:
            raise WorldError(f'origin is {tuple(origin)!r}, allowed is [x, y, 0] (turned maps are not simulated)')
        return cls(cells >= threshold, resolution, origin[:2])

    def sonar(self, x: float, y: float, axis: float, cone: Cone) -> float:
        """Distance (m) to the nearest wall or obstacle in a cone that sends an echo back, inf without one.

        `x`, `y`: m, map frame. `axis`: rad.
        """
        size = self.resolution
        place = (x - self.origin[0]) / size, (y - self.origin[1]) / size, axis
        if len(self.obstacles.shapes):
            return size * rays.echo_with_shapes(self._walls, place, cone, self._shapes_in_cells())
        return size * rays.echo(self._walls, place, cone)

    def laser(self, places: np.ndarray, limit: float) -> np.ndarray:
        """(n,) m to the nearest wall or obstacle on each ray, up to `limit` (m); inf where there is none.

        `places`: (n, 3): x, y (m, map frame) where a ray begins, and its direction (rad).
        """
        size, found = self.resolution, np.empty(len(places))
        cells = (places - (*self.origin, 0.0)) / (size, size, 1.0)
        rays.laser(self._walls, cells, limit / size, self._shapes_in_cells(), found)
        return size * found

    def _shapes_in_cells(self):
        size, shapes = self.resolution, self.obstacles.shapes
        return (shapes - (*self.origin, 0.0, 0.0, 0.0, 0.0)) / (size, size, 1.0, 1.0, size, size)

    def overlaps(self, x: float, y: float, yaw: float, length: float, width: float) -> bool:
        """True if a rectangle (m) centred on (x, y, yaw) overlaps an occupied cell."""
        size = self.resolution
        column, row = (x - self.origin[0]) / size, (y - self.origin[1]) / size
        if rays.is_clear(self.clear_of(length, width), column, row):
            return False
        return rays.rectangle_overlaps(self.occupied, column, row, yaw, 0.5 * length / size, 0.5 * width / size)

    def clear_of(self, length: float, width: float) -> np.ndarray:
        """(rows, columns) bool: cells from which a rectangle (m) reaches no occupied cell, however it is turned; worked
        out once for a rectangle.
        """
        clear = self._reach.get((length, width))
        if clear is None:
            # One cell more, for where in its own cell the rectangle's centre is.
            clear = self._reach[length, width] = smooth.none_within(
                self.occupied, math.ceil(0.5 * math.hypot(length, width) / self.resolution) + 1
            )
        return clear

    def meets(self, x: float, y: float, yaw: float, length: float, width: float) -> np.ndarray:
        """Which obstacles (rows of `obstacles.shapes`, bool) a rectangle (m) centred on (x, y, yaw) overlaps."""
        shapes = self.obstacles.shapes
        met = np.zeros(len(shapes), np.bool_)
        if len(shapes):
            rays.rectangle_meets_shapes(shapes, (x, y, yaw), (0.5 * length, 0.5 * width), met)
        return met

    def has_room(self, x: float, y: float, yaw: float, length: float, width: float) -> bool:
        """Whether a rectangle (m) centred on (x, y, yaw) overlaps neither an occupied cell nor an obstacle."""
        return not (self.overlaps(x, y, yaw, length, width) or self.meets(x, y, yaw, length, width).any())

    def may_move(
        self,
        before: tuple[float, float, float],
        after: tuple[float, float, float],
        length: float,
        width: float,
    ) -> bool:
        """Whether a rectangle (m) whose centre is at the pose `before` (x, y, yaw) may move to `after`: it meets no
        occupied cell there, nor an obstacle. Somebody who walked into it does not hold it: it may leave, but not press
        on.
        """
        if self.overlaps(*after, length, width):
            return False
        met = self.meets(*after, length, width)
        if not met.any():
            return True
        if (met & ~self.meets(*before, length, width)).any():
            return False
        shapes = self.obstacles.shapes[met]
        far = (shapes[:, 0] - before[0]) ** 2 + (shapes[:, 1] - before[1]) ** 2
        return bool(((shapes[:, 0] - after[0]) ** 2 + (shapes[:, 1] - after[1]) ** 2 >= far).all())


def _wall_normals(occupied: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (x, y), each (rows, columns) float32, that point from a cell to the wall near it; zero far from
    walls.
    """
    if not occupied.any():
        return np.zeros(occupied.shape, np.float32), np.zeros(occupied.shape, np.float32)
    slope_x, slope_y = smooth.slopes(smooth.gaussian(occupied, _BLUR_CELLS))
    length = np.hypot(slope_x, slope_y)
    known = length > 1e-6
    scale = np.where(known, 1.0 / np.where(known, length, 1.0), 0.0)
    return (slope_x * scale).astype(np.float32), (slope_y * scale).astype(np.float32)


def _checked(text, path: Path) -> tuple[list[str], tuple | None]:
    """Every fault in a map's YAML, and its values when there is none."""
    if not isinstance(text, dict):
        return [f'the map {path} holds {type(text).__name__} but must hold parameters.'], None
    faults = []
    image, resolution, origin = text.get('image'), text.get('resolution'), text.get('origin')
    negate, threshold = text.get('negate', 0), text.get('occupied_thresh', 0.65)
    mode = text.get('mode', 'trinary')
    if not isinstance(image, str):
        faults.append(f'image is {image!r}, allowed is the name of a file')
    if not is_number(resolution) or resolution <= 0:
        faults.append(f'resolution is {resolution!r}, allowed are numbers above 0 (m per cell)')
    if not (isinstance(origin, (list, tuple)) and len(origin) == 3 and all(map(is_number, origin)) and origin[2] == 0):
        faults.append(f'origin is {origin!r}, allowed is [x, y, 0] (turned maps are not simulated)')
    if negate not in (0, 1, True, False):
        faults.append(f'negate is {negate!r}, allowed are 0 and 1')
    if not is_number(threshold) or not 0 <= threshold <= 1:
        faults.append(f'occupied_thresh is {threshold!r}, allowed are numbers from 0 to 1')
    if mode not in MODES:
        faults.append(f'mode is {mode!r}, allowed are {", ".join(MODES)}')
    return faults, None if faults else (
        image,
        float(resolution),
        (origin[0], origin[1]),
        bool(negate),
        float(threshold),
        mode,
    )
