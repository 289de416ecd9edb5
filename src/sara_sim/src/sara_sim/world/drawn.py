"""Shapes drawn into a grid of cells, as a map has them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from sara_sim.world.obstacles import Obstacle

TINY = 1e-9  # m: a middle exactly on an edge is not covered, but by what is as thin as a cell


def draw(occupied: np.ndarray, size: float, origin: Sequence[float], shapes: Iterable[Obstacle]) -> None:
    """Mark the cells whose middle a standing Obstacle covers. What is thinner than a cell is drawn as thick as one, so
    that nothing vanishes.

    occupied: (rows, columns) bool, row 0 lowest; its cells are `size` m wide and begin at `origin` (x, y; m).
    """
    rows, columns = occupied.shape
    for shape in shapes:
        half = [max(0.5 * side - TINY, 0.5 * size + TINY) for side in shape.size or (2.0 * shape.radius,) * 2]
        reach = math.hypot(*half)
        c0, c1 = (_index(shape.at[0] + far, origin[0], size, columns) for far in (-reach, reach))
        r0, r1 = (_index(shape.at[1] + far, origin[1], size, rows) for far in (-reach, reach))
        x, y = np.meshgrid(
            origin[0] + size * (np.arange(c0, c1 + 1) + 0.5) - shape.at[0],
            origin[1] + size * (np.arange(r0, r1 + 1) + 0.5) - shape.at[1],
        )
        if shape.radius is not None:
            covered = np.hypot(x, y) <= half[0]
        else:
            c, s = math.cos(shape.yaw), math.sin(shape.yaw)
            covered = (np.abs(c * x + s * y) <= half[0]) & (np.abs(c * y - s * x) <= half[1])
        if not covered.any():  # it stands between the middles of cells
            column, row = (_cell(at, low, size) for at, low in zip(shape.at, origin))
            if 0 <= column < columns and 0 <= row < rows:
                occupied[row, column] = True
        occupied[r0 : r1 + 1, c0 : c1 + 1] |= covered


def _index(value, origin, size, count):
    """The cell's number along an axis, the nearest that there is."""
    return min(max(_cell(value, origin, size), 0), count - 1)


def _cell(value, origin, size):
    """The cell's number along an axis without ends."""
    return math.floor((value - origin) / size)
