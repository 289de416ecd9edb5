"""Magnetic declination from place and date: the World Magnetic Model (NOAA and BGS), as the package ahrs has it.

No network is needed. The model's own error is about 0.4 deg; iron nearby can do far more.
"""

from __future__ import annotations

import datetime
import math

FIRST, LAST = datetime.date(2015, 1, 1), datetime.date(2029, 12, 31)
"""What the coefficients in the package are for."""
WEAKEST = 2000.0
"""nT of horizontal field below which a compass is of no use (the model's blackout zone about the magnetic poles)."""


def declination(latitude: float, longitude: float, altitude: float, date: datetime.date) -> float:
    """rad by which a compass needle points east of true north; negative: west.

    Args:
        latitude, longitude: deg.
        altitude: m; what is no number counts as 0.

    Raises:
        ValueError: with a sentence, for a date without coefficients, or where a compass is of no use.
    """
    from ahrs.utils.wmm import WMM  # a quarter of a second, for the few who ask

    if not FIRST <= date <= LAST:
        raise ValueError(f'the magnetic model covers {FIRST.year} to {LAST.year}, not {date.isoformat()}')
    kilometres = altitude / 1000.0 if math.isfinite(altitude) else 0.0
    model = WMM(date=date)
    model.magnetic_field(latitude, longitude, min(max(kilometres, -1.0), 100.0), date=date)
    if model.H < WEAKEST:
        raise ValueError(f'the field is too weak for a compass ({model.H:.0f} nT): a magnetic pole is near')
    return math.radians(float(model.D))
