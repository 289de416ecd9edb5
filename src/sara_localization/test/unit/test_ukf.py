"""What both filters must do, and the defects of robot_localization's UKF that ours does not have."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_localization.filters import covariance
from sara_localization.filters.ekf import Ekf
from sara_localization.filters.sigma_points import UNSURE_ANGLE
from sara_localization.filters.state import OFF_PLANE, VX, VYAW, YAW, X, Y
from sara_localization.filters.ukf import Ukf

Q = np.diag([0.05, 0.05, 0.06, 0.03, 0.03, 0.06, 0.025, 0.025, 0.04, 0.01, 0.01, 0.02, 0.01, 0.01, 0.015])
BOTH = pytest.mark.parametrize('make', [Ekf, Ukf])
SPREADS = pytest.mark.parametrize('alpha', [0.001, 0.1, 1.0])


def begun(make, P, x=None, **arguments):
    kf = make(Q, P, x, **arguments)
    kf.initialised = True
    return kf


@BOTH
def test_the_first_measurement_is_the_state_and_the_second_is_fused(make):
    """robot_localization's own test of its filters."""
    kf = make(Q, np.eye(15) * 1e-9)
    z = np.arange(15) * 0.01
    kf.process(1000.0, range(15), z, np.eye(15) * 1e-9)
    np.testing.assert_array_equal(kf.x, z)
    np.testing.assert_array_equal(kf.P, np.eye(15) * 1e-9)
    kf.process(1002.0, range(15), z * 2.0, np.eye(15) * 1e-9)
    np.testing.assert_allclose(kf.x, z * 2.0, atol=1e-3)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.sampled_from([Ekf, Ukf]))
def test_covariance_is_symmetric_and_positive_definite_at_every_step(seed, make):
    rng = np.random.default_rng(seed)
    kf, now = make(Q * 10.0 ** rng.uniform(-6, 2), np.eye(15) * 1e-9), 0.0
    for _ in range(25):
        now += float(rng.choice([0.0, 0.01, 1.0, 1000.0, 1e6]))
        indices = np.sort(rng.choice(15, rng.integers(1, 16), replace=False))
        A = rng.normal(size=(len(indices), len(indices))) * 10.0 ** rng.uniform(-8, 4)
        R = rng.choice([0, 1, 2])
        R = (
            A @ A.T
            if R == 0
            else np.diag(rng.choice([0.0, -1.0, 1e-18, 1e-9, 1.0, 1e12], len(indices)))
            if R == 1
            else A
        )
        kf.process(now, indices, rng.normal(size=len(indices)) * 10.0 ** rng.uniform(-3, 4), R)
        assert (kf.P == kf.P.T).all() and covariance.positive_definite(kf.P)
        assert np.isfinite(kf.x).all() and np.abs(kf.x[3:6]).max() <= math.pi


@SPREADS
def test_a_posterior_holds_the_measurements_noise(alpha):
    """The peer leaves R out: prior 1 and R 1 leave 0.75."""
    kf = begun(Ukf, np.eye(15), alpha=alpha)
    kf.correct((VX,), [1.0], [[1.0]])
    assert kf.P[VX, VX] == pytest.approx(0.5) and kf.x[VX] == pytest.approx(0.5)


@SPREADS
@pytest.mark.parametrize('yaw', [0.0, 3.0, -3.1])
def test_an_angles_difference_is_wrapped_where_the_angle_is(alpha, yaw):
    """The peer wraps the difference of x in its place, and x moves the wrong way."""
    P, x = np.eye(15), np.zeros(15)
    P[YAW, YAW], P[X, YAW], P[YAW, X] = 0.04, 0.125, 0.125
    x[X], x[YAW] = 50.0, yaw
    kf = begun(Ukf, P, x, alpha=alpha)
    kf.correct((YAW,), [math.remainder(yaw + 0.1, 2 * math.pi)], [[0.01]])
    assert kf.x[X] == pytest.approx(50.25)
    assert math.remainder(kf.x[YAW] - yaw, 2 * math.pi) == pytest.approx(0.08)


@SPREADS
def test_it_survives_a_yaw_that_nobody_measures(alpha):
    """The peer's yaw jumps by pi and its variance becomes negative, then NaN, once that is above 2 rad2."""
    kf, now, begin = begun(Ukf, np.eye(15) * 1e-9, alpha=alpha), 0.0, None
    for _ in range(6000):
        now += 0.02
        kf.process(now, (*OFF_PLANE, VX, VX + 1, VYAW), [0.0] * 7 + [0.5, 0.0, 0.1], np.diag([1e-6] * 7 + [1e-3] * 3))
        if begin is None and kf.P[YAW, YAW] > UNSURE_ANGLE:
            begin = now
        elif kf.P[YAW, YAW] > UNSURE_ANGLE:
            assert abs(math.remainder(kf.x[YAW] - 0.1 * now, 2 * math.pi)) < 0.2
    assert begin is not None and kf.repairs == 0
    assert kf.P[YAW, YAW] > 5.0 and np.linalg.eigvalsh(kf.P).min() > 0.0
    assert math.hypot(kf.x[X], kf.x[Y]) < 15.0  # a circle of 10 m, as unsure as it is


@pytest.mark.parametrize('variance, off', [(0.1, 2e-3), (0.5, 0.03), (1.9, 0.35), (2.1, 0.1), (3.0, 0.2), (9.0, 1.0)])
def test_an_unsure_heading_shortens_the_step_and_never_turns_it_round(variance, off):
    """E cos of a Gaussian angle is exp(-variance/2)."""
    P, x = np.eye(15) * 1e-9, np.zeros(15)
    P[YAW, YAW], x[VX] = variance, 1.0
    kf = begun(Ukf, P, x)
    kf.predict(1.0)
    assert abs(kf.x[X] - math.exp(-0.5 * variance)) < off
    assert 0.0 < kf.x[X] <= 1.0


@BOTH
def test_a_second_measurement_of_the_first_stamp_counts(make):
    """The peer ignores it: its sigma points are still zero."""
    kf = make(Q, np.eye(15) * 1e-2)
    kf.process(10.0, (VX,), [1.0], [[0.1]])
    kf.process(10.0, (VX,), [2.0], [[0.1]])
    assert kf.x[VX] == pytest.approx(1.5)


@BOTH
def test_an_old_measurement_only_corrects_and_time_does_not_go_back(make):
    kf = make(Q, np.eye(15) * 1e-2)
    kf.process(10.0, (VX,), [1.0], [[0.1]])
    kf.process(9.0, (VX,), [2.0], [[0.1]])
    assert kf.last_measurement_time == 10.0 and kf.x[X] == 0.0 and kf.x[VX] == pytest.approx(1.5)


@BOTH
def test_a_clock_that_was_set_is_no_time_step(make):
    kf = make(Q, np.eye(15) * 1e-2)
    kf.process(10.0, (VX,), [1.0], [[0.1]])
    kf.process(1.6e9, (VX,), [1.0], [[0.1]])
    assert kf.x[X] == pytest.approx(0.01, rel=0.02)
