"""The magnetic declination by place and date, against the model's own test values, and where it is not known."""

import datetime
import math
from pathlib import Path

import ahrs
import pytest

from sara_localization.gps.declination import declination

VALUES = Path(ahrs.__file__).parent / 'utils' / 'WMM2025' / 'WMM2025_TEST_VALUES.txt'


def test_the_model_s_own_test_values():
    rows = [line.split() for line in VALUES.read_text().splitlines() if line.strip()[:1].isdigit()]
    assert len(rows) == 12
    checked = 0
    for row in rows:
        year, kilometres, latitude, longitude = map(float, row[:4])
        date = datetime.date(int(year), 1, 1) + datetime.timedelta(days=365.0 * (year - int(year)))
        try:
            found = declination(latitude, longitude, 1000.0 * kilometres, date)
        except ValueError as error:
            assert 'pole' in str(error)
            continue
        assert math.degrees(found) == pytest.approx(float(row[10]), abs=0.06)  # the package rounds dates to 0.1 year
        checked += 1
    assert checked == 12


def test_east_is_positive_and_the_year_counts():
    edinburgh = (55.944831, -3.186998, 50.0)
    assert math.degrees(declination(*edinburgh, datetime.date(2015, 6, 1))) == pytest.approx(-2.7, abs=0.2)
    assert math.degrees(declination(*edinburgh, datetime.date(2026, 6, 1))) == pytest.approx(-0.7, abs=0.4)
    assert math.degrees(declination(-43.5, 172.6, 0.0, datetime.date(2026, 6, 1))) == pytest.approx(24.0, abs=1.0)


@pytest.mark.parametrize(
    'latitude, date, why',
    [
        (45.0, datetime.date(2014, 12, 31), 'covers 2015 to 2029, not 2014-12-31'),
        (45.0, datetime.date(2030, 1, 1), 'not 2030-01-01'),
        (85.8, datetime.date(2026, 1, 1), 'too weak for a compass'),
    ],
)
def test_where_it_is_not_known(latitude, date, why):
    with pytest.raises(ValueError, match=why):
        declination(latitude, 139.0, 0.0, date)


def test_an_altitude_that_is_no_number_counts_as_none():
    date = datetime.date(2026, 1, 1)
    assert declination(45.0, 7.0, math.nan, date) == declination(45.0, 7.0, 0.0, date)
