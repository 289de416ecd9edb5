"""A map as compiled measurement models take it: where its cells are, how far each is from a wall, which are free."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.grids import distances
from sara_localization.ranges.map_echo import FREE, OCCUPIED
from sara_localization.ranges.range_data import RangeMap

MOST_REACH = 4096
"""Cells: the square of a greater reach would not be whole in a float32."""


class Placement(NamedTuple):
    """x, y (m), cosine and sine: a grid's lower left corner and its turn in the map; m per cell."""

    x: float
    y: float
    cosine: float
    sine: float
    resolution: float

    @classmethod
    def of(cls, map_: RangeMap) -> Placement:
        """Of a map."""
        x, y, yaw = map_.origin
        return cls(x, y, math.cos(yaw), math.sin(yaw), map_.resolution)


@kernel(inline='always')
def to_cells(place: Placement, x: float, y: float) -> tuple[float, float]:
    """(column, row), not whole, of a point of the map (m)."""
    dx, dy = (x - place.x) / place.resolution, (y - place.y) / place.resolution
    return place.cosine * dx + place.sine * dy, place.cosine * dy - place.sine * dx


def squares_of(map_: RangeMap, reach: int) -> np.ndarray:
    """int32 (rows, columns): squared distances (cells) to the nearest wall, reach^2 + 1 where none is within `reach`
    cells.
    """
    walls = np.where(map_.cells == OCCUPIED, np.uint8(distances.OBSTACLE), np.uint8(0))
    squares = distances.squared_distances(walls, reach)
    return np.minimum(squares, reach * reach + 1, out=squares)


def reach_of(map_: RangeMap, metres: float) -> int:
    """A distance in cells, as `squares_of` takes it."""
    return int(min(max(metres / map_.resolution, 1.0), MOST_REACH))


def free_cells(map_: RangeMap) -> np.ndarray:
    """(k,) int32: flat indices of the cells where a robot may be."""
    return np.flatnonzero(map_.cells == FREE).astype(np.int32)


def random_poses(map_: RangeMap, free: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, 3) poses in the map, uniform over free cells and headings. free: `free_cells` of the map, not empty."""
    rows, columns = np.divmod(free[rng.integers(len(free), size=count)], map_.cells.shape[1])
    across = (columns + rng.random(count)) * map_.resolution
    along = (rows + rng.random(count)) * map_.resolution
    place = Placement.of(map_)
    x = place.x + place.cosine * across - place.sine * along
    y = place.y + place.sine * across + place.cosine * along
    return np.stack((x, y, rng.uniform(-math.pi, math.pi, count)), 1)
