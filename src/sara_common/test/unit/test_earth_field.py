"""The earth's magnetic field: the model's own test values, and where there is none."""

import datetime
import math
from pathlib import Path

import ahrs
import pytest

from sara_common.earth_field import earth_field

VALUES = Path(ahrs.__file__).parent / 'utils' / 'WMM2025' / 'WMM2025_TEST_VALUES.txt'
DATE = datetime.date(2026, 1, 1)


def test_the_model_s_own_test_values():
    rows = [line.split() for line in VALUES.read_text().splitlines() if line.strip()[:1].isdigit()]
    assert len(rows) == 12
    for row in rows:
        year, kilometres, latitude, longitude, north, east, down, horizontal = map(float, row[:8])
        date = datetime.date(int(year), 1, 1) + datetime.timedelta(days=365.0 * (year - int(year)))
        found = earth_field(latitude, longitude, 1000.0 * kilometres, date)
        assert [1e9 * value for value in found] == pytest.approx([north, east, down], abs=15.0)
        assert 1e9 * found.horizontal == pytest.approx(horizontal, abs=15.0)
        assert math.degrees(found.declination) == pytest.approx(float(row[10]), abs=0.06)


@pytest.mark.parametrize('latitude, longitude', [(90.1, 0.0), (math.nan, 0.0), (0.0, 361.0), (0.0, math.inf)])
def test_a_place_that_is_none(latitude, longitude):
    with pytest.raises(ValueError, match='allowed are a latitude and a longitude'):
        earth_field(latitude, longitude, 0.0, DATE)
