"""Which of a map's walls range sensors with wide cones hear: of what is in a cone the nearest surface that is not too
steep, as the simulated ultrasonic sensors do.
"""

from __future__ import annotations

import math

import numpy as np

from sara_common.repeatable import cos_sin
from sara_lab.judge.passed_walls import REACH
from sara_nav.maps.map_io import OCCUPIED, GridMap

NEAREST = 0.2
"""m from which on they measure."""
HALF_CONE = math.radians(30.0)
STEEPEST = math.radians(60.0)
"""Between a cone's axis and the normal of a wall that still answers."""
RAYS = 13
"""In a cone."""
SAME = 0.02
"""m by which what is heard may be farther than the nearest surface."""
AT_ONCE = 400
"""Sensors whose rays are cast together."""


class HeardWalls:
    """The walls of a map; places and axes are in its frame, m and rad."""

    def __init__(self, true: GridMap):
        self.geometry = true.geometry
        self._occupied = true.data == OCCUPIED

    def heard(self, sensors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of sensors (n, 3), x, y, axis: (k, 2) places on walls that they hear, and (k,) the sensor of each."""
        parts = [self._heard(sensors[first : first + AT_ONCE]) for first in range(0, len(sensors), AT_ONCE)]
        if not parts:
            return np.empty((0, 2)), np.empty(0, int)
        numbers = [number + AT_ONCE * part for part, (_, number) in enumerate(parts)]
        return np.concatenate([places for places, _ in parts]), np.concatenate(numbers)

    def _heard(self, sensors):
        g = self.geometry
        angle = sensors[:, 2:3] + np.linspace(-HALF_CONE, HALF_CONE, RAYS)
        dx, dy = np.cos(angle), np.sin(angle)
        x, y = (sensors[:, 0:1] - g.origin_x) / g.resolution, (sensors[:, 1:2] - g.origin_y) / g.resolution
        far, across = self._cast(x, y, dx, dy)
        far = far * g.resolution
        along_x, along_y = map(np.abs, cos_sin(sensors[:, 2:3]))
        facing = np.where(across, along_x, along_y)
        far[(facing < math.cos(STEEPEST)) | (far > REACH)] = math.inf
        nearest = far.min(1, keepdims=True)
        sensor, ray = np.nonzero((far <= nearest + SAME) & (far < math.inf) & (nearest >= NEAREST))
        reach = far[sensor, ray]
        places = sensors[sensor, :2] + reach[:, None] * np.stack((dx[sensor, ray], dy[sensor, ray]), 1)
        return places, sensor

    def _cast(self, x, y, dx, dy):
        """Cells to the first occupied one, inf where there is none, and whether its face is across x."""
        rows, columns = self._occupied.shape
        steps = np.arange(0.0, REACH / self.geometry.resolution + 1.0, 0.5)
        column = np.floor(x[..., None] + dx[..., None] * steps).astype(int)
        row = np.floor(y[..., None] + dy[..., None] * steps).astype(int)
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        hit = inside & self._occupied[row.clip(0, rows - 1), column.clip(0, columns - 1)]
        first, met = hit.argmax(-1), hit.any(-1)
        at_column, at_row = (np.take_along_axis(index, first[..., None], -1)[..., 0] for index in (column, row))
        with np.errstate(divide='ignore', invalid='ignore'):
            to_x = np.where(dx > 0.0, at_column - x, at_column + 1 - x) / dx
            to_y = np.where(dy > 0.0, at_row - y, at_row + 1 - y) / dy
        to_x, to_y = (np.where(np.isfinite(to), to, -math.inf) for to in (to_x, to_y))
        beside = (at_column - np.where(dx > 0.0, 1, -1)).clip(0, columns - 1)
        hidden = self._occupied[at_row.clip(0, rows - 1), beside]
        across = (to_x > to_y) & ~(hidden & (to_y > 0.0))  # a ray that comes along a wall came in by its face
        return np.where(met, np.where(across, to_x, to_y), math.inf), across
