"""What readings tell of free space: narrow fans of them went through it, up to what is occupied."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap
from sara_slam.sonar.forward_model import Heard
from sara_slam.sonar.sonar_config import SonarConfig

FREE_HALF, FREE_RAYS = math.radians(12.0), 9
"""Half the cone in which a reading tells of free space, rad, and rays in it."""
FREE_FAR = 1.5
"""m up to which silence tells of free space."""
MARGIN = 2.6
"""m about everything heard."""


class Sheet(NamedTuple):
    """Cells, int8 (rows, columns); low: number of the lowest column and row; size: m."""

    data: np.ndarray
    low: np.ndarray
    size: float

    @classmethod
    def about(cls, size: float, places: np.ndarray) -> Sheet:
        """Cells of which nothing is known, MARGIN about places (n, 2), m."""
        low = np.floor((places.min(0) - MARGIN) / size).astype(int)
        columns, rows = (np.ceil((places.max(0) + MARGIN) / size).astype(int) - low).tolist()
        return cls(np.full((rows, columns), UNKNOWN, np.int8), low, size)

    def cells(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(rows, columns) of places (n, 2), m, not more than MARGIN from those that it is about."""
        columns, rows = (np.floor(places / self.size).astype(int) - self.low).T
        return rows, columns

    def mark(self, places: np.ndarray, value: int) -> None:
        """Put a value where places (n, 2) are, m."""
        self.data[self.cells(places)] = value

    def clear(self, config: SonarConfig, heard: Heard) -> None:
        """Mark free what readings went through, up to what is occupied."""
        fan = np.linspace(-FREE_HALF, FREE_HALF, FREE_RAYS)
        reach = np.where(heard.ranges <= config.range_max_range, heard.ranges, FREE_FAR) - self.size
        x, y, angle = (np.repeat(column, len(fan)) for column in heard.sensors.T)
        angle, reach = angle + np.tile(fan, len(heard.ranges)), np.repeat(reach, len(fan))
        rays = np.column_stack((x, y, np.cos(angle), np.sin(angle), reach))
        distances = np.arange(0.0, config.range_max_range, 0.5 * self.size)
        stops = without_slits(self.data == OCCUPIED)
        _go_through(rays, distances, (self.size, *self.low.tolist()), stops, self.data)

    def grid(self) -> GridMap:
        """The map."""
        rows, columns = self.data.shape
        x, y = (self.size * self.low).tolist()
        return GridMap(self.data, GridGeometry(columns, rows, self.size, x, y))


def known_free(config: SonarConfig, heard: Heard, before: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(n,) whether readings went through places (n, 2), where what they hear stands at those of before (m, 2), m."""
    sheet = Sheet.about(config.resolution, np.concatenate((heard.sensors[:, :2], before, places)))
    sheet.mark(before, OCCUPIED)
    sheet.clear(config, heard)
    return sheet.data[sheet.cells(places)] == FREE


def without_slits(walls: np.ndarray) -> np.ndarray:
    """The cells of walls (bool (rows, columns)), and those beside where two of them touch by a corner alone: a ray
    would pass there.
    """
    closed = walls.copy()
    closed[:-1, 1:] |= walls[:-1, :-1] & walls[1:, 1:]
    closed[:-1, :-1] |= walls[:-1, 1:] & walls[1:, :-1]
    return closed


@kernel
def _go_through(rays, distances, cells, stops, data):
    """Put FREE into data along rays (n, 5): x, y, direction (x, y) and reach, m, up to where stops is True. distances:
    at which is looked; cells: their size, m, and the lowest column and row.
    """
    size, low_column, low_row = cells
    for n in range(len(rays)):
        x, y, dx, dy, reach = rays[n]
        for distance in distances:
            if reach <= distance:
                break
            column = int(math.floor((x + distance * dx) / size)) - low_column
            row = int(math.floor((y + distance * dy) / size)) - low_row
            if stops[row, column]:
                break
            data[row, column] = FREE


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    _go_through(np.zeros((1, 5)), np.zeros(1), (0.05, 0, 0), np.zeros((1, 1), np.bool_), np.zeros((1, 1), np.int8))
