"""Local cartesian coordinates: metres east and north of a place, in the plane that touches the ellipsoid there.

The plane is not bent as the earth is: 10 km away the ground is 8 m below it. The third coordinate is therefore not the
height above the plane but the altitude (as in robot_localization), and `inverse` finds the place at that altitude.
"""

from __future__ import annotations

import math

from sara_localization.gps.grid import NoPlace, finite, place
from sara_localization.gps.projections import TransformDirection, Transformer

MOST = 1e6
"""m from the origin, east or north, that are converted."""
NEAREST_POLE = 89.9
"""deg of latitude up to which there is an east to speak of."""
_PRECISION = 1e-6
"""m of altitude."""
_STEPS = 20


class TangentPlane:
    """Coordinates about an origin (deg) on the ellipsoid. Raises NoPlace for an origin at a pole."""

    def __init__(self, latitude: float, longitude: float):
        latitude, longitude = _within(latitude, longitude)
        self.name = f'the plane at latitude {latitude:.7f}, longitude {longitude:.7f}'
        self._pipeline = Transformer.from_pipeline(
            '+proj=pipeline +step +proj=cart +ellps=WGS84 '
            f'+step +proj=topocentric +ellps=WGS84 +lat_0={latitude!r} +lon_0={longitude!r} +h_0=0'
        )

    def forward(self, latitude: float, longitude: float, altitude: float = 0.0) -> tuple[float, float]:
        """Metres east and north of the origin of a place at an altitude (m). Raises NoPlace."""
        latitude, longitude = _within(latitude, longitude)
        east, north, up = self._pipeline.transform(longitude, latitude, altitude)
        self._near(east, north)
        if not up > -MOST:
            raise NoPlace(
                f'latitude {latitude:g}, longitude {longitude:g} is on the other side of the earth from {self.name}'
            )
        return east, north

    def inverse(self, x: float, y: float, altitude: float = 0.0) -> tuple[float, float]:
        """Latitude and longitude of a point at an altitude (m). Raises NoPlace."""
        finite(x, y)
        self._near(x, y)
        up = altitude
        for _ in range(_STEPS):
            longitude, latitude, found = self._pipeline.transform(x, y, up, direction=TransformDirection.INVERSE)
            if not math.isfinite(found):
                break
            if abs(found - altitude) < _PRECISION:
                return _within(latitude, longitude)
            up += altitude - found
        raise NoPlace(f'the point ({x:.0f}, {y:.0f}) m is no place at an altitude of {altitude:.0f} m')

    def convergence(self, latitude: float, longitude: float) -> float:
        """0: y is true north at the origin, which is where the world frame is laid."""
        return 0.0

    def _near(self, x, y):
        if not (abs(x) <= MOST and abs(y) <= MOST):
            raise NoPlace(f'({x:.0f}, {y:.0f}) m is too far from {self.name}: allowed are {MOST:.0f} m')


def _within(latitude, longitude):
    latitude, longitude = place(latitude, longitude)
    if not abs(latitude) <= NEAREST_POLE:
        raise NoPlace(
            f'latitude {latitude:g} is too near to a pole: allowed are {-NEAREST_POLE:g} to {NEAREST_POLE:g} deg'
        )
    return latitude, longitude
