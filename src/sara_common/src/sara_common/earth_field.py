"""The earth's magnetic field by place and date: the World Magnetic Model (NOAA and BGS), as the package ahrs has it.

No network is needed. The model's own error is about 0.4 deg of declination; iron nearby can do far more.
"""

from __future__ import annotations

import datetime
import math
from typing import NamedTuple

FIRST, LAST = datetime.date(2015, 1, 1), datetime.date(2029, 12, 31)
"""What the coefficients in the package are for."""
WEAKEST = 2.0e-6
"""T of horizontal field below which a compass is of no use (the model's blackout zone about the magnetic poles)."""
_NANOTESLA = 1e-9


class EarthField(NamedTuple):
    """The field at a place, along north, east and down, T."""

    north: float
    east: float
    down: float

    @property
    def horizontal(self) -> float:
        """Strength in the horizontal plane, T."""
        return math.hypot(self.north, self.east)

    @property
    def declination(self) -> float:
        """rad by which a compass needle points east of true north; negative: west."""
        return math.atan2(self.east, self.north)


def earth_field(latitude: float, longitude: float, altitude: float, date: datetime.date) -> EarthField:
    """The field at a place and date.

    Args:
        latitude, longitude: deg.
        altitude: m above the ellipsoid; what is no number counts as 0.

    Raises:
        ValueError: with a sentence, for a place that is none, a date without coefficients, or where a compass is of no
            use.
    """
    from ahrs.utils.wmm import WMM  # a quarter of a second, for the few who ask

    if not (abs(latitude) <= 90.0 and abs(longitude) <= 360.0):
        raise ValueError(f'a place is {latitude!r}, {longitude!r}, allowed are a latitude and a longitude in deg')
    if not FIRST <= date <= LAST:
        raise ValueError(f'the magnetic model covers {FIRST.year} to {LAST.year}, not {date.isoformat()}')
    kilometres = altitude / 1000.0 if math.isfinite(altitude) else 0.0
    model = WMM(date=date)
    model.magnetic_field(latitude, longitude, min(max(kilometres, -1.0), 100.0), date=date)
    field = EarthField(*(float(value) * _NANOTESLA for value in (model.X, model.Y, model.Z)))
    if field.horizontal < WEAKEST:
        raise ValueError(
            f'the field is too weak for a compass ({field.horizontal / _NANOTESLA:.0f} nT): a magnetic pole is near'
        )
    return field
