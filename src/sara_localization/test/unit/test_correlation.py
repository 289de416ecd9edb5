"""Errors that persist: what is left of a measurement's information, and honest covariances; outliers in words."""

import numpy as np
import pytest

from sara_common.diagnostics import OK, WARN
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.diagnostics import FilterDiagnostics
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import X, Y
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.correlation import LARGEST, Correlation
from sara_localization.inputs.data import PoseData

SIGMA, TIME, DT = 1.5, 60.0, 0.4


def wandering(rng, count):
    """(count, 2) m: first-order Gauss-Markov."""
    a = np.exp(-DT / TIME)
    errors = [SIGMA * rng.standard_normal(2)]
    for _ in range(count - 1):
        errors.append(a * errors[-1] + SIGMA * np.sqrt(1.0 - a * a) * rng.standard_normal(2))
    return np.array(errors)


def make(backend='compiled', said=None, **extra):
    params = {
        'frequency': 10.0,
        'two_d_mode': True,
        'pose0': 'gps',
        'pose0_config': [True, True] + [False] * 13,
        'process_noise_covariance': [1e-9] * 15,
        'initial_estimate_covariance': [1e6, 1e6] + [1e-9] * 13,
        'backend': backend,
        **extra,
    }
    report = None if said is None else said.append
    return FilterEngine(FilterConfig.from_params(params, 'ekf'), TransformBuffer(), report=report)


def fix(stamp, x, y, sigma=SIGMA):
    covariance = np.diag([sigma**2, sigma**2, 1.0, 1.0, 1.0, 1.0])
    return PoseData(stamp, 'odom', (float(x), float(y), 0.0), (0.0, 0.0, 0.0, 1.0), covariance)


def estimate(places, **extra):
    """(x, y) and their covariance after fixes of one place."""
    engine = make(**extra)
    for k, (x, y) in enumerate(places):
        engine.add_pose('pose0', fix(1.0 + DT * k, x, y))
        engine.tick(1.0 + DT * k)
    return engine.filter.x[[X, Y]].copy(), engine.filter.P[X, X]


def test_information_is_that_of_the_best_linear_estimate():
    count = 50
    a = np.exp(-DT / TIME)
    matrix = a ** np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    best = np.ones(count) @ np.linalg.solve(matrix, np.ones(count))
    correlation = Correlation(TIME)
    assert sum(1.0 / correlation.inflation(DT * k) for k in range(count)) == pytest.approx(best)


def test_factors_of_far_apart_late_and_simultaneous_measurements():
    correlation = Correlation(TIME)
    assert correlation.inflation(10.0) == 1.0
    assert correlation.inflation(10.0) == LARGEST
    assert correlation.inflation(10.0 + 20.0 * TIME) == pytest.approx(1.0)
    assert correlation.inflation(10.0 + 19.0 * TIME) == pytest.approx(1.0 / np.tanh(0.5))  # late
    correlation.forget()
    assert correlation.inflation(5.0) == 1.0


@pytest.mark.parametrize('backend', ['compiled', 'filterpy'])
def test_covariance_is_honest_where_white_noise_is_claimed_otherwise(backend):
    rng = np.random.default_rng(4)
    scores = {TIME: [], 0.0: []}
    for _ in range(12 if backend == 'compiled' else 4):
        places = wandering(rng, 60)
        for time, found in scores.items():
            error, variance = estimate(places, pose0_correlation_time=time, backend=backend)
            found.append(error @ error / variance)
    assert np.mean(scores[TIME]) < 4.0  # two degrees of freedom
    assert np.mean(scores[0.0]) > 20.0


def test_the_gate_judges_by_the_variance_of_a_single_fix():
    said = []
    engine = make(said=said, pose0_correlation_time=TIME, pose0_rejection_threshold=4.0)
    for k in range(100):
        away = 10.0 if 50 <= k < 60 else 0.0
        engine.add_pose('pose0', fix(1.0 + DT * k, away, 0.0))
        engine.tick(1.0 + DT * k)
    status = engine.inputs['pose0']
    assert (status.used, status.rejected) == (90, 10)
    assert said == [
        'pose0 (gps): outliers are rejected, 4.9 sigmas off (the gate is 4)',
        'pose0 (gps): taken again, after 10 outliers in 4.0 s',
    ]


def test_outliers_are_in_the_diagnostics_while_they_last():
    engine = make(pose0_rejection_threshold=4.0)
    diagnostics = FilterDiagnostics(engine.config)
    for k, (away, level) in enumerate([(0.0, OK), (30.0, OK), (30.0, WARN), (0.0, OK)]):
        engine.add_pose('pose0', fix(1.0 + k, away, 0.0))
        engine.tick(1.0 + k)
        told = diagnostics.status(1.0 + k, engine.inputs.values(), None)
        assert told.level == level
        assert ('in a row until now' in told.message) == (level == WARN)


def test_outliers_between_two_reports_are_in_the_second():
    engine = make(pose0_rejection_threshold=4.0)
    diagnostics = FilterDiagnostics(engine.config)

    def told_after(*away):
        for place in away:
            now = 1.0 + engine.inputs['pose0'].received * DT
            engine.add_pose('pose0', fix(now, place, 0.0))
            engine.tick(now)
        told = diagnostics.status(now + 0.1, engine.inputs.values(), None)
        return told.level, dict(told.values)['pose0']

    assert told_after(0.0) == (OK, 'pose0 (gps): 1 used')
    level, line = told_after(30.0, 0.0)  # a single one: in the line, and no reason to warn
    assert level == OK and line.startswith('pose0 (gps): 2 used, 1 rejected by the gate (the last 0.5 s ago, ')
    level, line = told_after(30.0, 30.0, 0.0)
    assert level == WARN and line.startswith('pose0 (gps): 3 used, 3 rejected by the gate (the last 0.5 s ago, ')
    assert told_after(0.0)[0] == OK


def test_after_set_pose_the_next_fix_counts_in_full():
    engine = make(pose0_correlation_time=TIME)
    for k in range(3):
        engine.add_pose('pose0', fix(1.0 + DT * k, 0.0, 0.0))
        engine.tick(1.0 + DT * k)
    engine.set_pose(fix(2.0, 5.0, 0.0, sigma=100.0)._replace(frame_id='odom'), 2.0)
    engine.add_pose('pose0', fix(2.1, 0.0, 0.0))
    engine.tick(2.1)
    assert engine.filter.P[X, X] == pytest.approx(SIGMA**2, rel=0.01)


def test_wrong_and_useless_correlation_times_are_told():
    base = {'pose0': 'gps', 'pose0_config': [True, True] + [False] * 13}
    with pytest.raises(ValueError, match='pose0_correlation_time'):
        FilterConfig.from_params({**base, 'pose0_correlation_time': -1.0}, 'ekf')
    config = FilterConfig.from_params({**base, 'pose0_correlation_time': 1.0, 'pose0_differential': True}, 'ekf')
    assert any('pose0_correlation_time has no effect' in sentence for sentence in config.warnings)
