"""The thesis's set measures itself, and by how much is understood: scale = 1 + K s / T."""

import pytest

from sara_lab.studies import thesis_set
from sara_localization.bags.alignment import path_length


@pytest.mark.parametrize(
    'odometry_rate, imu_rate, predict, variance',
    [
        (10, 5, False, 1e-3),
        (10, 20, False, 1e-3),
        (10, 20, False, 1e-2),
        (5, 10, False, 1e-3),
        (20, 5, True, 1e-3),
        (10, 50, True, 1e-2),
    ],
)
def test_the_formula_says_how_much_too_long_legs_come_out(odometry_rate, imu_rate, predict, variance):
    drive = thesis_set.drive(odometry_rate, imu_rate, predict=predict, variance=variance)
    assert drive.scale - 1.0 == pytest.approx(drive.predicted - 1.0, rel=0.1, abs=2e-3)


def test_a_faster_imu_and_a_slower_odometry_make_it_worse():
    assert thesis_set.drive(10, 20).scale > 1.3 > 1.05 > thesis_set.drive(50, 20).scale
    assert thesis_set.drive(10, 20).scale > thesis_set.drive(10, 5).scale + 0.2


@pytest.mark.parametrize('name', [name for name in thesis_set.SETS if name != thesis_set.THESIS])
@pytest.mark.parametrize('predict', [False, True])
def test_the_clean_sets_keep_the_scale(name, predict):
    for rates in ((10, 5), (10, 50)):
        assert thesis_set.drive(*rates, name, predict).scale == pytest.approx(1.0, abs=5e-3)


def test_noise_at_rest_adds_no_way():
    x = [0.0, 0.001, -0.001, 0.0005, 0.1, 0.2, 0.2005, 0.2, 5.0, 5.1]
    assert path_length(x, [0.0] * len(x)) == pytest.approx(0.3)
