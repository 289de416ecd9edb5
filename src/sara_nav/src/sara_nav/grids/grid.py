"""Where the cells of a map are: the geometry of an occupancy grid or costmap.

Arrays are indexed [row, column] = [y, x] with row 0 at the bottom, as nav_msgs/OccupancyGrid has it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255
"""Costs of costmap_2d: free, surely touched by the robot whose centre is there, an obstacle, not known."""


class GridError(ValueError):
    """The geometry of a grid makes no sense."""


class Grid(NamedTuple):
    """Where the cells of an array lie, as kernels take it: its lower left corner and the edge of a cell, m, floats."""

    origin_x: float
    origin_y: float
    resolution: float


@dataclass(frozen=True)
class GridGeometry:
    """Size of a grid in cells, edge of a cell (m), and the world position of its lower left corner (m)."""

    width: int
    height: int
    resolution: float
    origin_x: float
    origin_y: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise GridError(f'resolution is {self.resolution!r}, allowed are numbers above 0')
        if self.width < 1 or self.height < 1:
            raise GridError(f'the map has {self.width:d} x {self.height:d} cells but must have at least one')
        if not (math.isfinite(self.origin_x) and math.isfinite(self.origin_y)):
            raise GridError(f'origin is ({self.origin_x!r}, {self.origin_y!r}), allowed are finite numbers')

    @property
    def grid(self) -> Grid:
        """The same without the size, for kernels."""
        return Grid(float(self.origin_x), float(self.origin_y), float(self.resolution))

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns) of an array over this grid."""
        return self.height, self.width

    @property
    def size(self) -> tuple[float, float]:
        """(width, height) in metres."""
        return self.width * self.resolution, self.height * self.resolution

    def to_cell(self, x: float, y: float) -> tuple[int, int] | None:
        """Return (column, row) of the cell that holds the point (m), or None when it is off the grid."""
        column = (x - self.origin_x) / self.resolution
        row = (y - self.origin_y) / self.resolution
        if 0.0 <= column < self.width and 0.0 <= row < self.height:  # false for NaN and infinities
            return int(column), int(row)
        return None

    def to_cell_unbounded(self, x: float, y: float) -> tuple[int, int]:
        """Return (column, row) of the cell that would hold the point (m) on a grid without edges."""
        return math.floor((x - self.origin_x) / self.resolution), math.floor((y - self.origin_y) / self.resolution)

    def moved(self, columns: int, rows: int) -> GridGeometry:
        """Return the grid moved by whole cells."""
        return GridGeometry(
            self.width,
            self.height,
            self.resolution,
            self.origin_x + columns * self.resolution,
            self.origin_y + rows * self.resolution,
        )

    def to_world(self, column: int, row: int) -> tuple[float, float]:
        """Return (x, y) of the centre of a cell (m); of arrays of them, too."""
        return (self.origin_x + (column + 0.5) * self.resolution, self.origin_y + (row + 0.5) * self.resolution)
