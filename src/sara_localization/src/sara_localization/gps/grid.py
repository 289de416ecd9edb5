"""What a plane coordinate system on the earth has in common, whichever it is."""

from __future__ import annotations

import math
from typing import Protocol


class NoPlace(ValueError):
    """A place or a point that cannot be converted; the text says which and why."""


HIGHEST = 1e5
"""m of altitude, up or down."""


class Grid(Protocol):
    """Latitudes and longitudes in degrees (WGS 84) to plane coordinates in metres, x east and y north, and back."""

    name: str

    def forward(self, latitude: float, longitude: float, altitude: float) -> tuple[float, float]:
        """x, y of a place; altitude: m above the ellipsoid. Raises NoPlace."""

    def inverse(self, x: float, y: float, altitude: float) -> tuple[float, float]:
        """Latitude and longitude of a point at an altitude (m). Raises NoPlace."""

    def convergence(self, latitude: float, longitude: float) -> float:
        """How far (rad, clockwise) the grid's north is turned from the true one at a place. Raises NoPlace."""


def place(latitude: float, longitude: float) -> tuple[float, float]:
    """The latitude, and the longitude from -180 (included) to 180 deg; raises NoPlace for what is none."""
    if not -90.0 <= latitude <= 90.0:
        raise NoPlace(f'the latitude is {latitude:g}, allowed are degrees from -90 to 90')
    if not -360.0 <= longitude <= 360.0:
        raise NoPlace(f'the longitude is {longitude:g}, allowed are degrees from -360 to 360')
    if -180.0 <= longitude < 180.0:
        return latitude, longitude
    return latitude, (longitude + 180.0) % 360.0 - 180.0


def level(altitude: float) -> None:
    """Raises NoPlace for an altitude (m) that no robot has."""
    if not abs(altitude) <= HIGHEST:
        raise NoPlace(f'the altitude is {altitude:g} m, allowed are {-HIGHEST:g} to {HIGHEST:g} m')


def finite(x: float, y: float) -> None:
    """Raises NoPlace for a point that holds what is no number."""
    if not (math.isfinite(x) and math.isfinite(y)):
        raise NoPlace(f'the point ({x:g}, {y:g}) m is not finite')
