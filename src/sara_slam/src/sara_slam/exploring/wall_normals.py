"""Which way the walls of a map face, and those that may stand at its borders on the unknown."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from sara_nav.grids.grid import Grid
from sara_slam.exploring.cones import FREE_CELL, WALL_CELL, Cells, strides
from sara_slam.sonar.square_walls import heading_of, squared

SMOOTH = 2.0
"""Cells about a border by which its direction is told."""
ENOUGH, SQUARE = 60, 0.4
"""Cells of walls, and size of their heading_of for each weight, from which on they are those of a building with walls
square to each other.
"""


def with_normals(kinds: np.ndarray, grid: Grid) -> Cells:
    """The Cells of a map, uint8 (rows, columns) FREE_CELL and so on."""
    return Cells(kinds, *normals(kinds), strides(kinds), grid)


def normals(kinds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """float32 (rows, columns) x and y of unit vectors to the free side, of uint8 (rows, columns) FREE_CELL and so on.

    Where free space ends at the unknown tells where sensors looked, and not how a wall beyond lies: in a building with
    walls square to each other it faces the one of their directions that is next.
    """
    free = kinds == FREE_CELL
    y, x = np.gradient(gaussian_filter(free.astype(np.float32), SMOOTH))
    angles, walls = np.arctan2(y, x), kinds == WALL_CELL
    weights = np.hypot(x, y)[walls]
    heading = heading_of(angles[walls], weights)
    if len(weights) >= ENOUGH and abs(heading) > SQUARE * weights.sum():
        angles = np.where(walls, angles, squared(angles, heading))
    return np.cos(angles).astype(np.float32), np.sin(angles).astype(np.float32)
