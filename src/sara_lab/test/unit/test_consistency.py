"""The filters tell the truth about their uncertainty."""

import math

import numpy as np
import pytest

from sara_lab.studies import consistency
from sara_lab.studies.consistency import interval, nees, nees_campaign, nees_trial


def test_nees_of_unit_errors():
    assert nees([3.0, 4.0], np.diag([9.0, 4.0])) == pytest.approx(5.0)


def test_no_error_is_small_beside_a_covariance_that_is_singular():
    along = np.array([1.0, 1.0, 0.0])
    for P in (np.zeros((3, 3)), np.outer(along, along), np.outer(along, along) - 1e-17 * np.eye(3)):
        assert nees([1.0, -1.0, 0.1], P) == math.inf


def test_interval_holds_95_percent_of_drawn_means():
    low, high = interval(3, 100)
    means = np.random.default_rng(0).chisquare(3, (4000, 100)).mean(axis=1)
    assert np.mean((means > low) & (means < high)) == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize('filter', ['ekf', 'ukf'])
def test_mean_nees_is_within_its_interval(filter):
    mean, low, high = nees_campaign(range(60), filter)
    assert low < mean < high


def test_a_filter_that_trusts_too_much_is_found_out(monkeypatch):
    monkeypatch.setattr(consistency, 'TRIAL_VARIANCES', {i: v / 10.0 for i, v in consistency.TRIAL_VARIANCES.items()})
    noise = {i: v / 10.0 for i, v in consistency.TRIAL_NOISE.items()}
    original = consistency.FilterConfig.from_params

    def too_sure(params, filter):
        return original({**params, 'process_noise_covariance': [noise.get(i, 1e-12) for i in range(15)]}, filter)

    monkeypatch.setattr(consistency.FilterConfig, 'from_params', staticmethod(too_sure))
    mean, low, high = nees_campaign(range(30))
    assert mean > high


def test_a_seed_is_a_drive():
    assert nees_trial(5) == nees_trial(5) != nees_trial(6)
