"""Laws of the filter: turned worlds, exact data, an honest covariance, measurements that are none."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import wrap_exact
from sara_localization.config.filter_config import DEFAULT_PROCESS_NOISE
from sara_localization.filters import motion_model
from sara_localization.filters.ekf import Ekf
from sara_localization.filters.estimator import Estimator, measured
from sara_localization.filters.state import VX, VYAW, YAW

Q = np.diag(DEFAULT_PROCESS_NOISE)


def a_filter(yaw=0.0):
    x = np.zeros(15)
    x[YAW] = yaw
    ekf = Ekf(Q, np.eye(15) * 0.1, x)
    ekf.initialised = True
    return ekf


@settings(max_examples=50)
@given(st.floats(-3.0, 3.0), st.integers(-3, 3))
def test_a_whole_turn_in_the_measured_yaw_changes_nothing(yaw, k):
    a, b = a_filter(), a_filter()
    a.process(0.1, (YAW,), [yaw], [[0.01]])
    b.process(0.1, (YAW,), [yaw + 2 * math.pi * k], [[0.01]])
    np.testing.assert_allclose(wrap_exact(a.x[YAW] - b.x[YAW]), 0.0, atol=1e-9)
    np.testing.assert_allclose(a.P, b.P, atol=1e-12)


@settings(max_examples=50)
@given(st.floats(-math.pi, math.pi), st.lists(st.floats(-0.5, 0.5), min_size=5, max_size=5))
def test_turning_the_world_turns_the_estimate(turn, rates):
    a, b = a_filter(0.3), a_filter(wrap_exact(0.3 + turn))
    for k, rate in enumerate(rates, 1):
        for ekf in (a, b):
            ekf.process(0.1 * k, (VX, VYAW), [0.5, rate], np.eye(2) * 0.01)
    c, s = math.cos(turn), math.sin(turn)
    np.testing.assert_allclose(b.x[:2], (c * a.x[0] - s * a.x[1], s * a.x[0] + c * a.x[1]), atol=1e-9)
    np.testing.assert_allclose(wrap_exact(b.x[YAW] - a.x[YAW] - turn), 0.0, atol=1e-9)


def test_exact_data_give_the_exact_path():
    truth = np.zeros(15)
    truth[VX], truth[VYAW] = 0.5, 0.3
    ekf = Ekf(Q, np.eye(15) * 1e-9, truth)
    ekf.initialised = True
    for k in range(1, 200):
        truth, _ = motion_model.predict(truth, 0.05)
        ekf.process(0.05 * k, (YAW, VX, VYAW), [wrap_exact(truth[YAW]), 0.5, 0.3], np.eye(3) * 1e-4)
    np.testing.assert_allclose(ekf.x[:2], truth[:2], atol=1e-9)
    np.testing.assert_allclose(wrap_exact(ekf.x[YAW] - truth[YAW]), 0.0, atol=1e-9)


@settings(max_examples=50)
@given(
    st.lists(
        st.tuples(st.sets(st.integers(0, 14), min_size=1), st.floats(1e-12, 1e3), st.floats(-10, 10)),
        min_size=1,
        max_size=20,
    )
)
def test_covariance_stays_symmetric_and_positive(steps):
    ekf = a_filter()
    for k, (variables, variance, value) in enumerate(steps, 1):
        indices = tuple(sorted(variables))
        ekf.process(0.1 * k, indices, np.full(len(indices), value), np.eye(len(indices)) * variance)
        assert (ekf.P == ekf.P.T).all()
        assert np.linalg.eigvalsh(ekf.P).min() > -1e-9 * np.abs(ekf.P).max()


def test_what_is_no_number_is_left_out_of_the_first_measurement_and_of_later_ones():
    ekf = Ekf(Q, np.eye(15) * 0.1)
    ekf.process(1.0, (VX, VYAW), [math.nan, 0.2], np.eye(2) * 0.01)
    ekf.process(1.1, (VX, VYAW), [math.inf, 0.2], np.eye(2) * 0.01)
    assert np.isfinite(ekf.x).all() and ekf.x[VYAW] > 0.1
    assert not ekf.correct((VX,), [math.nan], [[0.01]])


def test_a_variance_that_is_no_number_leaves_its_variable_out():
    a, b = a_filter(), a_filter()
    assert a.correct((VX, VYAW), [1.0, 1.0], [[math.inf, 0.0], [0.0, 1.0]])
    assert b.correct((VYAW,), [1.0], [[1.0]])
    np.testing.assert_array_equal(a.x, b.x)
    np.testing.assert_array_equal(a.P, b.P)
    assert not a.correct((VX,), [1.0], [[math.nan]])


def test_the_gate_rejects_beyond_its_sigmas():
    ekf = a_filter()
    assert not ekf.correct((VX,), [10.0], [[0.1]], threshold=3.0)
    assert ekf.correct((VX,), [0.5], [[0.1]], threshold=3.0)


@pytest.mark.parametrize('kept', [True, False])
def test_prediction_and_correction_in_one_call_are_the_two_of_them(kept):
    rng = np.random.default_rng(4)
    for trial in range(300):
        one, two = (Ekf(np.eye(15) * 0.01, np.eye(15) * 0.1) for _ in range(2))
        one.keep_positive = two.keep_positive = kept
        k = int(rng.integers(1, 4))
        indices = tuple(int(i) for i in rng.permutation(15)[:k])
        for step in range(1, 6):
            z, R = rng.normal(size=k), np.diag(rng.uniform(1e-9, 1.0, k))
            if trial % 5 == 1:
                z[0] = rng.choice([math.nan, math.inf])
            if trial % 5 == 2:
                R = rng.normal(size=(k, k))  # no covariance
            if trial % 5 == 3:
                for kf in (one, two):  # nor is the filter's
                    kf.P = -kf.P if step == 3 else kf.P
            threshold = 1.0 if trial % 7 == 0 else math.inf
            done = one.process(0.1 * step, indices, z, R, threshold)
            if two.initialised:
                assert done == Estimator._predict_and_correct(
                    two, 0.1 * step - two.last_measurement_time, 0.1 * step, measured(indices, z, R, threshold)
                )
                two.last_measurement_time = 0.1 * step
            else:
                two.process(0.1 * step, indices, z, R, threshold)
            assert np.array_equal(one.x, two.x, equal_nan=True) and np.array_equal(one.P, two.P, equal_nan=True)
            assert one.repairs == two.repairs and (one.nis == two.nis or math.isnan(one.nis) and math.isnan(two.nis))
