"""A map and a reading of a range sensor, as plain data."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_localization.ranges import map_echo

SMALLEST_CELL, FARTHEST = 1e-3, 1e7
"""m: of a map's cells at least, and of its size and of poses at most: a float's last digits are fine there."""


def turned_back(x: float, y: float, back: tuple[float, float]) -> tuple[float, float]:
    """A vector turned by minus an angle. back: (cosine, sine) of that."""
    return back[0] * x + back[1] * y, back[0] * y - back[1] * x


class RangeMap(NamedTuple):
    """Cells of a map: uint8 (rows, columns) as map_echo has them, row 0 lowest; m per cell; origin (x, y, yaw) of its
    lower left corner, m, rad.
    """

    cells: np.ndarray
    resolution: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def back(self) -> tuple[float, float]:
        """(cosine, sine) of the origin's yaw, for turned_back."""
        return math.cos(self.origin[2]), math.sin(self.origin[2])

    def in_grid(self, pose: tuple[float, float, float]) -> tuple[float, float, float]:
        """A pose (x, y, yaw) in the map's frame, as seen from the corner of its grid."""
        x, y, yaw = self.origin
        return (*turned_back(pose[0] - x, pose[1] - y, self.back), pose[2] - yaw)

    @classmethod
    def from_occupancy(
        cls, data: np.ndarray, resolution: float, origin: tuple[float, float, float], occupied_above: int
    ) -> RangeMap:
        """From nav_msgs/OccupancyGrid's data, int8 (rows, columns): -1 unknown, 0..100. Raises ValueError with a
        sentence.
        """
        data = np.asarray(data)
        if data.ndim != 2 or not data.size:
            raise ValueError('the map has no cells')
        if not (math.isfinite(resolution) and resolution > 0.0 and all(map(math.isfinite, origin))):
            raise ValueError(f'the map has a resolution of {resolution!r} and its origin at {tuple(origin)!r}')
        if (
            not SMALLEST_CELL <= resolution <= resolution * max(data.shape) <= FARTHEST
            or max(map(abs, origin)) > FARTHEST
        ):
            raise ValueError(f'its cells are of {resolution:g} m and its origin is at {tuple(origin)!r}')
        cells = np.where(data > occupied_above, map_echo.OCCUPIED, np.where(data < 0, map_echo.UNKNOWN, map_echo.FREE))
        return cls(np.ascontiguousarray(cells, dtype=np.uint8), float(resolution), tuple(map(float, origin)))


class RangeData(NamedTuple):
    """A reading: sensor's name; time, s; the sensor in the robot (x, y, yaw; m, rad); range, m (REP-117); what it can
    measure, m; its full cone, rad.
    """

    name: str
    stamp: float
    mount: tuple[float, float, float]
    range: float
    least: float
    most: float
    field_of_view: float


class BeamModel(NamedTuple):
    """How readings scatter about what a map predicts: sigma, m; shares of readings as predicted, shorter, without an
    echo, and anything; their sum need not be 1.
    """

    sigma: float
    hit: float
    short: float
    lost: float
    random: float
