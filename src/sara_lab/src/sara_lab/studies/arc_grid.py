"""A plain grid of arcs, to compare with: every reading makes its cone free up to its range and the arc at its range
occupied, cell by cell, at the pose that the odometry says (A. Elfes, "Sonar-based real-world mapping and navigation",
1987).
"""

from __future__ import annotations

import numpy as np

from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap

RESOLUTION, MARGIN = 0.05, 3.0
FARTHEST = 2.4
"""m that readings are used."""
RAYS = 25
"""In a cone."""
FREE_ODDS, OCCUPIED_ODDS = -0.3, 0.6
"""Logarithms that a reading adds to its cells."""
SURE = 1.0
"""From which on a cell is occupied, or free."""


def draw(sensors: np.ndarray, ranges: np.ndarray, field_of_view: float) -> GridMap:
    """The map of readings: sensors (n, 3), x, y, axis (m, rad), ranges (n,) m, inf without an echo; full cone, rad."""
    low = np.floor((sensors[:, :2].min(0) - MARGIN) / RESOLUTION).astype(int)
    columns, rows = (np.ceil((sensors[:, :2].max(0) + MARGIN) / RESOLUTION).astype(int) - low).tolist()
    odds = np.zeros(rows * columns)
    fan = np.linspace(-0.5 * field_of_view, 0.5 * field_of_view, RAYS)
    steps = np.arange(0.0, FARTHEST, 0.5 * RESOLUTION)
    for (x, y, axis), distance in zip(sensors.tolist(), ranges.tolist()):
        reach = min(distance, FARTHEST)
        if not reach > 0.0:
            continue

        def cells(away, x=x, y=y, axis=axis):
            column = np.floor((x + np.outer(away, np.cos(axis + fan))) / RESOLUTION).astype(int) - low[0]
            row = np.floor((y + np.outer(away, np.sin(axis + fan))) / RESOLUTION).astype(int) - low[1]
            return np.unique(row * columns + column)

        odds[cells(steps[steps < reach - RESOLUTION])] += FREE_ODDS
        if distance <= FARTHEST:
            odds[cells(np.array([distance]))] += OCCUPIED_ODDS
    data = np.full(odds.shape, UNKNOWN, np.int8)
    data[odds <= -SURE], data[odds >= SURE] = FREE, OCCUPIED
    geometry = GridGeometry(columns, rows, RESOLUTION, float(low[0]) * RESOLUTION, float(low[1]) * RESOLUTION)
    return GridMap(data.reshape(rows, columns), geometry)
