"""Magnetic declination from place and date, by the World Magnetic Model."""

from __future__ import annotations

import datetime

from sara_common.earth_field import FIRST, LAST, earth_field

__all__ = ['FIRST', 'LAST', 'declination']


def declination(latitude: float, longitude: float, altitude: float, date: datetime.date) -> float:
    """rad by which a compass needle points east of true north; negative: west.

    Args:
        latitude, longitude: deg.
        altitude: m; what is no number counts as 0.

    Raises:
        ValueError: with a sentence, for a date without coefficients, or where a compass is of no use.
    """
    return earth_field(latitude, longitude, altitude, date).declination
