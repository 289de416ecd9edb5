"""Which of a map's walls range sensors with wide cones hear: of what is in a cone the nearest surface that is not too
steep, as the simulated ultrasonic sensors do.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
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


class HeardWalls:
    """The walls of a map; places and axes are in its frame, m and rad."""

    def __init__(self, true: GridMap):
        self.geometry = true.geometry
        self._occupied = true.data == OCCUPIED

    def heard(self, sensors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of sensors (n, 3), x, y, axis: (k, 2) places on walls that they hear, and (k,) the sensor of each."""
        g = self.geometry
        angle = sensors[:, 2:3] + np.linspace(-HALF_CONE, HALF_CONE, RAYS)
        dx, dy = np.cos(angle), np.sin(angle)
        x, y = (sensors[:, 0:1] - g.origin_x) / g.resolution, (sensors[:, 1:2] - g.origin_y) / g.resolution
        far, across = cast(self._occupied, REACH / g.resolution, (x[:, 0], y[:, 0]), (dx, dy))
        far = far * g.resolution
        along_x, along_y = map(np.abs, cos_sin(sensors[:, 2:3]))
        facing = np.where(across, along_x, along_y)
        far[(facing < math.cos(STEEPEST)) | (far > REACH)] = math.inf
        nearest = far.min(1, keepdims=True)
        sensor, ray = np.nonzero((far <= nearest + SAME) & (far < math.inf) & (nearest >= NEAREST))
        reach = far[sensor, ray]
        places = sensors[sensor, :2] + reach[:, None] * np.stack((dx[sensor, ray], dy[sensor, ray]), 1)
        return places, sensor


@kernel
def cast(
    occupied: np.ndarray,
    reach: float,
    begin: tuple[np.ndarray, np.ndarray],
    ahead: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Cells to the first occupied one, inf where there is none within ``reach`` cells, and whether its face is across
    x; both (n, rays). begin: (n,) columns and rows, ahead: (n, rays), unit vectors.
    """
    rows, columns = occupied.shape
    n, rays = ahead[0].shape
    far, across = np.full((n, rays), np.inf), np.zeros((n, rays), np.bool_)
    steps = math.ceil(2.0 * (reach + 1.0))
    for i in range(n):
        x, y = begin[0][i], begin[1][i]
        for k in range(rays):
            dx, dy = ahead[0][i, k], ahead[1][i, k]
            for step in range(steps):
                column, row = int(math.floor(x + dx * (0.5 * step))), int(math.floor(y + dy * (0.5 * step)))
                if not (0 <= column < columns and 0 <= row < rows) or not occupied[row, column]:
                    continue
                to_x = -np.inf if dx == 0.0 else (column - x if dx > 0.0 else column + 1 - x) / dx
                to_y = -np.inf if dy == 0.0 else (row - y if dy > 0.0 else row + 1 - y) / dy
                hidden = occupied[row, min(max(column - (1 if dx > 0.0 else -1), 0), columns - 1)]
                # A ray that comes along a wall came in by its face.
                across[i, k] = to_x > to_y and not (hidden and to_y > 0.0)
                far[i, k] = to_x if across[i, k] else to_y
                break
    return far, across


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    cast(np.zeros((2, 2), np.bool_), 1.0, (np.zeros(1), np.zeros(1)), (np.ones((1, 2)), np.zeros((1, 2))))
