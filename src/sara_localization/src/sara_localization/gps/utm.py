"""Universal Transverse Mercator: which zone a place is in, and coordinates in one zone.

A zone's coordinates go on beyond its edges and over the equator, so that a robot that leaves it sees no jump. Zones and
letters: DMA TM 8358.2, "The Universal Grids"; the projection is PROJ's (Poder and Engsager's series).
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

from sara_localization.gps.grid import NoPlace, finite, place
from sara_localization.gps.projections import Proj

SOUTHMOST, NORTHMOST = -80.0, 84.0
"""deg of latitude between which UTM is defined; nearer to the poles is polar stereographic."""
WEST, EAST = 0.0, 1e6
"""m of easting: about 1.5 deg beyond the edges of a zone on the equator, more elsewhere."""
_FARTHEST, _FALSE_NORTHING = 9.4e6, 1e7
"""m of northing from the equator, a little beyond NORTHMOST; and of the equator in southern zones."""
_LETTERS = 'CDEFGHJKLMNPQRSTUVWX'
"""Bands of 8 deg of latitude from 80 S on; the last has 12."""
_FIRST_NORTH = 'N'
_POLAR = 'ABYZ'
_LONGEST = math.radians(60.0)


class Zone(NamedTuple):
    """A zone (1 to 60) and its hemisphere, which says whether northings count from the equator or 10 000 km south."""

    number: int
    north: bool

    @classmethod
    def from_text(cls, text: str) -> Zone:
        """From a number and the letter of a band, such as 31U; what follows (a square of the grid) is not needed.

        Raises NoPlace.
        """
        word = text.strip().upper()
        digits = word[: len(word) - len(word.lstrip('0123456789'))]
        letter = word[len(digits) : len(digits) + 1]
        if letter and letter in _POLAR:
            raise NoPlace(f'"{text}" is a zone at a pole, which UTM does not reach')
        if not (1 <= len(digits) <= 2 and 1 <= int(digits) <= 60 and letter and letter in _LETTERS):
            raise NoPlace(f'"{text}" is no UTM zone: a number from 1 to 60 and the letter of a band, such as 31U')
        return cls(int(digits), letter >= _FIRST_NORTH)

    @classmethod
    def of(cls, latitude: float, longitude: float) -> Zone:
        """The zone of a place (deg), with the exceptions of Norway and Svalbard. Raises NoPlace."""
        latitude, longitude = _within(latitude, longitude)
        number = min(int((longitude + 180.0) // 6.0), 59) + 1  # the sum may round up to 360
        if 56.0 <= latitude < 64.0 and 3.0 <= longitude < 12.0:
            number = 32
        elif latitude >= 72.0 and 0.0 <= longitude < 42.0:
            number = 31 if longitude < 9.0 else 33 if longitude < 21.0 else 35 if longitude < 33.0 else 37
        return cls(number, latitude >= 0.0)

    @property
    def meridian(self) -> float:
        """deg of longitude in its middle."""
        return 6.0 * self.number - 183.0

    def __str__(self) -> str:
        return f'{self.number} {"north" if self.north else "south"}'


class Utm:
    """Coordinates in one zone: easting and northing in m, as they are printed on maps."""

    def __init__(self, zone: Zone):
        self.zone, self.name = zone, f'UTM zone {zone}'
        self._projection = _projection(zone)

    def forward(self, latitude: float, longitude: float, altitude: float = 0.0) -> tuple[float, float]:
        """Easting and northing of a place, whatever its altitude; raises NoPlace where the zone is too far."""
        latitude, longitude = self._near(latitude, longitude)
        x, y = self._projection(longitude, latitude)
        if not WEST <= x <= EAST:
            raise NoPlace(
                f'latitude {latitude:g}, longitude {longitude:g} is too far from {self.name}: easting {x:.0f} m'
            )
        return x, y

    def inverse(self, x: float, y: float, altitude: float = 0.0) -> tuple[float, float]:
        """Latitude and longitude of a point, whatever its altitude. Raises NoPlace."""
        finite(x, y)
        if not WEST <= x <= EAST:
            raise NoPlace(f'the easting {x:.0f} m is too far from {self.name}: allowed are {WEST:.0f} to {EAST:.0f} m')
        if abs(y - (0.0 if self.zone.north else _FALSE_NORTHING)) > _FARTHEST:
            raise NoPlace(f'the northing {y:.0f} m is beyond the poles')
        longitude, latitude = self._projection(x, y, inverse=True)
        return _within(latitude, longitude)

    def convergence(self, latitude: float, longitude: float) -> float:
        """rad by which grid north is turned clockwise from true north. Raises NoPlace."""
        latitude, longitude = self._near(latitude, longitude)
        return math.radians(self._projection.get_factors(longitude, latitude).meridian_convergence)

    def _near(self, latitude, longitude):
        latitude, longitude = _within(latitude, longitude)
        if abs(math.remainder(math.radians(longitude - self.zone.meridian), 2.0 * math.pi)) > _LONGEST:
            raise NoPlace(
                f'longitude {longitude:g} is too far from {self.name}, whose middle is {self.zone.meridian:g}'
            )
        return latitude, longitude


def _within(latitude, longitude):
    latitude, longitude = place(latitude, longitude)
    if not SOUTHMOST <= latitude < NORTHMOST:
        raise NoPlace(
            f'latitude {latitude:g} is too near to a pole: UTM is defined from {SOUTHMOST:g} to {NORTHMOST:g} deg; '
            'use_local_cartesian reaches farther'
        )
    return latitude, longitude


@functools.lru_cache(maxsize=8)
def _projection(zone):
    return Proj(proj='utm', zone=zone.number, south=not zone.north, ellps='WGS84')
