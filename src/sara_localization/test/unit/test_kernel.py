"""The compiled algebra against the formulas as they stand in the books, and filterpy as the oracle of both filters."""

import math
import sys

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import wrap_exact
from sara_localization.filters import covariance, kernel
from sara_localization.filters.ekf import Ekf
from sara_localization.filters.motion_model import advance, jacobian
from sara_localization.filters.residual import Measured
from sara_localization.filters.ukf import Ukf

Q = np.diag([0.05, 0.05, 0.06, 0.03, 0.03, 0.06, 0.025, 0.025, 0.04, 0.01, 0.01, 0.02, 0.01, 0.01, 0.015])
SEEDS = st.integers(0, 2**32 - 1)
STEPS = st.floats(1e-4, 1.0)


def random_covariance(rng, n, size=1.0):
    A = rng.normal(size=(n, n))
    scale = np.sqrt(size * 10.0 ** rng.uniform(-3, 0, n))
    C = A @ A.T + 0.3 * n * np.eye(n)
    d = np.sqrt(C.diagonal())
    return C / np.outer(d, d) * np.outer(scale, scale)


def random_state(rng, n=15, steepest=1.2):
    x = rng.normal(size=n) * 2.0
    x[3:6] = rng.uniform(-1.4, 1.4), rng.uniform(-steepest, steepest), rng.uniform(-3.1, 3.1)
    x[9:12] *= steepest / 2.0
    return x


def random_measurement(rng, n=15, correlated=None):
    k = rng.integers(1, 8)
    indices = np.sort(rng.choice(15, k, replace=False))
    correlated = rng.random() < 0.5 if correlated is None else correlated
    R = random_covariance(rng, k, 0.5) if correlated else np.diag(10.0 ** rng.uniform(-6, 0, k))
    extra = np.where(rng.random(k) < 0.4, 15, -1) if n > 15 else np.full(k, -1)
    return indices.astype(np.int64), extra.astype(np.int64), rng.normal(size=k), R


def joseph(x, P, indices, extra, z, R):
    H = np.zeros((len(z), len(x)))
    H[range(len(z)), indices] = 1.0
    for k, b in enumerate(extra):
        if b >= 0:
            H[k, b] = 1.0
    y = z - H @ x
    for k, i in enumerate(indices):
        if 3 <= i <= 5:
            y[k] = wrap_exact(y[k])
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    G = np.eye(len(x)) - K @ H
    x = x + K @ y
    x[3:6] = [wrap_exact(a) for a in x[3:6]]
    return x, G @ P @ G.T + K @ R @ K.T, float(y @ np.linalg.solve(S, y))


def scaled_difference(P, expected):
    sigma = np.sqrt(expected.diagonal())
    return np.abs((P - expected) / np.outer(sigma, sigma)).max()


def almost_singular(rng, n):
    """A covariance whose correlations have eigenvalues down to about round-off, on either side of zero."""
    vectors, _ = np.linalg.qr(rng.normal(size=(n, n)))
    values = 10.0 ** rng.uniform(-4, 0, n)
    values[: min(n - 1, rng.integers(1, 4))] = rng.choice([-1.0, 0.0, 1.0]) * 10.0 ** rng.uniform(-17, -11)
    C = (vectors * values) @ vectors.T
    sigma = 10.0 ** rng.uniform(-4, 10, n)
    scale = sigma / np.sqrt(C.diagonal())
    return 0.5 * (C + C.T) * np.outer(scale, scale)


def smallest_correlation(P):
    sigma = np.sqrt(P.diagonal())
    return np.linalg.eigvalsh(P / np.outer(sigma, sigma))[0]


@given(SEEDS, st.integers(2, 20))
def test_what_is_called_positive_definite_has_positive_eigenvalues_and_so_have_its_leading_blocks(seed, n):
    P = almost_singular(np.random.default_rng(seed), n)
    if covariance.positive_definite(P):
        assert smallest_correlation(P) > 0.0
        for k in range(1, n):
            assert covariance.positive_definite(P[:k, :k].copy())
    else:
        assert smallest_correlation(P) < 2.0 * covariance.MARGIN
        covariance.repair(P)
        assert (P == P.T).all() and covariance.positive_definite(P)


@given(SEEDS, STEPS, st.sampled_from([15, 16, 18]))
def test_prediction_is_f_p_f_transposed(seed, dt, n):
    rng = np.random.default_rng(seed)
    x, P, noise = random_state(rng, n), random_covariance(rng, n), np.eye(n) * 0.01
    F = np.eye(n)
    F[:15, :15] = jacobian(x, dt)
    expected = F @ P @ F.T + noise * dt
    at = x.copy()
    assert kernel.predict(x, P, noise, dt, at)
    assert (P == P.T).all() and scaled_difference(P, expected) < 1e-12
    advance(at, dt)
    difference = x - at
    difference[3:6] = [wrap_exact(a) for a in difference[3:6]]
    np.testing.assert_allclose(difference, 0.0, atol=1e-12)


@given(SEEDS, st.sampled_from([15, 16]))
def test_scalars_one_at_a_time_are_josephs_form(seed, n):
    rng = np.random.default_rng(seed)
    x, P = random_state(rng, n), random_covariance(rng, n)
    indices, extra, z, R = random_measurement(rng, n)
    expected_x, expected_P, nis = joseph(x, P, indices, extra, z, R)
    result, distance, positive = kernel.correct(x, P, Measured(indices, extra, z, R, math.inf))
    assert result == kernel.TAKEN and positive and (P == P.T).all()
    difference = x - expected_x
    difference[3:6] = [wrap_exact(a) for a in difference[3:6]]
    np.testing.assert_allclose(difference, 0.0, atol=1e-10)
    assert scaled_difference(P, expected_P) < 1e-9
    assert distance == pytest.approx(nis, rel=1e-8)


@given(SEEDS)
def test_the_gate_rejects_at_the_mahalanobis_distance_and_changes_nothing(seed):
    rng = np.random.default_rng(seed)
    x, P = random_state(rng), random_covariance(rng, 15)
    indices, extra, z, R = random_measurement(rng)
    _, _, nis = joseph(x, P, indices, extra, z, R)
    before = x.copy(), P.copy()
    result, _, _ = kernel.correct(x, P, Measured(indices, extra, z, R, math.sqrt(nis) * 0.999))
    assert result == kernel.REJECTED
    np.testing.assert_array_equal(x, before[0])
    np.testing.assert_array_equal(P, before[1])
    assert kernel.correct(x, P, Measured(indices, extra, z, R, math.sqrt(nis) * 1.001))[0] == kernel.TAKEN


@given(SEEDS, st.integers(-3, 3))
def test_whole_turns_of_a_measured_angle_change_nothing(seed, turns):
    rng = np.random.default_rng(seed)
    x, P = random_state(rng), random_covariance(rng, 15)
    a, b = (x.copy(), P.copy()), (x.copy(), P.copy())
    indices, extra, R = np.array([3, 5]), np.array([-1, -1]), np.eye(2) * 0.1
    z = np.array([x[3] + 0.2, x[5] - 0.3])
    kernel.correct(*a, Measured(indices, extra, z, R, math.inf))
    kernel.correct(*b, Measured(indices, extra, z + turns * 2 * math.pi, R, math.inf))
    np.testing.assert_allclose(a[0], b[0], atol=1e-9)
    np.testing.assert_allclose(a[1], b[1], atol=1e-12)


@given(SEEDS, st.floats(-12, 12))
def test_repair_gives_a_covariance_and_leaves_a_sound_one_alone(seed, exponent):
    rng = np.random.default_rng(seed)
    sound = random_covariance(rng, 15, 10.0**exponent)
    repaired = sound.copy()
    covariance.repair(repaired)
    assert scaled_difference(repaired, sound) < 1e-12
    broken = rng.normal(size=(15, 15)) * 10.0**exponent
    broken[rng.integers(15), rng.integers(15)] = rng.choice([np.nan, np.inf, -1.0, 0.0])
    covariance.repair(broken)
    assert (broken == broken.T).all() and covariance.positive_definite(broken)


def test_positive_definite_is_independent_of_units():
    P = np.diag(10.0 ** np.linspace(-20, 20, 15))
    assert covariance.positive_definite(P)
    P[0, 1] = P[1, 0] = 1.01 * math.sqrt(P[0, 0] * P[1, 1])
    assert not covariance.positive_definite(P)


# filterpy


class FilterpyEkf(ExtendedKalmanFilter):
    dt = 0.0

    def predict_x(self, u=0):
        self.F = jacobian(self.x, self.dt)
        advance(self.x, self.dt)


def _wrapped(a, b, angles):
    y = np.subtract(a, b)
    y[angles] = [wrap_exact(v) for v in y[angles]]
    return y


def run(kf, oracle_predict, oracle_correct, rng, compare):
    kf.initialised = True
    for _ in range(6):
        dt = rng.uniform(0.001, 0.05)
        kf.predict(dt)
        oracle_predict(dt)
        compare()
        indices, _, z, R = random_measurement(rng)
        z = kf.x[indices] + 0.1 * z
        kf.correct(indices, z, R)
        oracle_correct(indices, z, R)
        compare()


@settings(max_examples=60)
@given(SEEDS)
def test_ekf_agrees_with_filterpy(seed):
    rng = np.random.default_rng(seed)
    x, P = random_state(rng, steepest=0.5), random_covariance(rng, 15, 0.01)
    kf, oracle = Ekf(Q, P, x), FilterpyEkf(15, 15)
    oracle.x, oracle.P = x.copy(), P.copy()

    def predict(dt):
        oracle.dt, oracle.Q = dt, Q * dt
        oracle.predict()

    def correct(indices, z, R):
        H = np.eye(15)[indices]
        angles = [k for k, i in enumerate(indices) if 3 <= i <= 5]
        oracle.update(z, lambda _: H, lambda s: s[indices], R=R, residual=lambda a, b: _wrapped(a, b, angles))

    def compare():
        np.testing.assert_allclose(_wrapped(kf.x, oracle.x, [3, 4, 5]), 0.0, atol=1e-9)
        assert scaled_difference(kf.P, oracle.P) < 1e-9

    run(kf, predict, correct, rng, compare)


@settings(max_examples=60)
@given(SEEDS, st.sampled_from([(1.0, 2.0, 0.0), (0.5, 2.0, 1.0), (0.1, 2.0, 0.0), (0.03, 2.0, 3.0)]))
def test_ukf_agrees_with_filterpy(seed, spread):
    rng = np.random.default_rng(seed)
    alpha, beta, kappa = spread
    x, P = random_state(rng, steepest=0.5), random_covariance(rng, 15, 0.01)
    kf = Ukf(Q, P, x, alpha=alpha, beta=beta, kappa=kappa)

    def fx(point, dt):
        point = point.copy()
        advance(point, dt)
        return point

    oracle = UnscentedKalmanFilter(15, 15, 0.1, lambda s: s, fx, MerweScaledSigmaPoints(15, alpha, beta, kappa))
    oracle.x, oracle.P = x.copy(), P.copy()

    def predict(dt):
        oracle.Q = Q * dt
        oracle.predict(dt)

    def correct(indices, z, R):
        angles = [k for k, i in enumerate(indices) if 3 <= i <= 5]
        oracle.residual_z = lambda a, b: _wrapped(a, b, angles)
        oracle.update(z, R=R, hx=lambda s: s[indices])

    def compare():
        np.testing.assert_allclose(_wrapped(kf.x, oracle.x, [3, 4, 5]), 0.0, atol=1e-8)
        assert scaled_difference(kf.P, oracle.P) < 1e-8

    run(kf, predict, correct, rng, compare)


@settings(max_examples=60)
@given(SEEDS)
def test_ukf_with_points_close_to_the_centre_agrees_as_far_as_filterpys_weights_carry(seed):
    """alpha 0.001: filterpy's weights are of the order of 1e6 and cost it six digits and more; ours do not."""
    rng = np.random.default_rng(seed)
    x, P = random_state(rng, steepest=0.5), random_covariance(rng, 15, 0.01)
    narrow, wide = Ukf(Q, P, x, alpha=0.001), Ukf(Q, P, x, alpha=0.003)
    narrow.predict(0.05)
    wide.predict(0.05)
    np.testing.assert_allclose(_wrapped(narrow.x, wide.x, [3, 4, 5]), 0.0, atol=1e-5)
    oracle = UnscentedKalmanFilter(
        15,
        15,
        0.1,
        lambda s: s,
        lambda p, dt: (advance(p := p.copy(), dt), p)[1],
        MerweScaledSigmaPoints(15, 0.001, 2.0, 0.0),
    )
    oracle.x, oracle.P, oracle.Q = x.copy(), P.copy(), Q * 0.05
    oracle.predict(0.05)
    np.testing.assert_allclose(_wrapped(narrow.x, oracle.x, [3, 4, 5]), 0.0, atol=1e-8)
    assert scaled_difference(narrow.P, oracle.P) < 1e-7


def test_the_filters_do_not_load_filterpy_or_scipy():
    import subprocess

    code = (
        'import sys; import sara_localization.engine.engine; print([m for m in ("filterpy", "scipy.stats") if m '
        'in sys.modules])'
    )
    out = subprocess.run(
        [sys.executable, '-c', code],
        capture_output=True,
        text=True,
        check=True,
        env={'PYTHONPATH': ':'.join(sys.path), 'HOME': '/tmp'},
    )
    assert out.stdout.strip() == '[]'
