"""`backend: filterpy` gives what the compiled filters give: on recorded runs, step by step, and in what it refuses."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).resolve().parent))
from recorded import RecordedBag, Run, play  # noqa: E402
from test_kernel import SEEDS, Q, random_covariance, random_measurement, random_state, scaled_difference  # noqa: E402

from sara_localization.config.filter_config import ConfigError, FilterConfig  # noqa: E402
from sara_localization.engine.make_filter import make_filter  # noqa: E402
from sara_localization.filters import covariance  # noqa: E402
from sara_localization.filters.control import Control, ControlConfig  # noqa: E402
from sara_localization.filters.ekf import Ekf
from sara_localization.filters.estimator import Biases  # noqa: E402
from sara_localization.filters.filterpy_backend import FilterpyEkf, FilterpyUkf  # noqa: E402
from sara_localization.filters.ukf import Ukf  # noqa: E402

TAU = 2.0 * math.pi
# filterpy's weights for alpha 0.001 are of the order of 1e6, which costs its UKF six digits.
AGREEMENT = {'ekf': 1e-8, 'ukf': 1e-6}
COMMANDED = Control(ControlConfig((True, False, False, False, False, True), 0.2))


def differences(ours, theirs):
    difference = np.subtract(ours, theirs)
    difference[..., 3:6] -= TAU * np.round(difference[..., 3:6] / TAU)
    return np.abs(difference)


@pytest.mark.parametrize(
    'name',
    [
        's2_square_chair__thesis',
        's3_gaps_20__predict',
        's4_out_of_order__lag_short',
        's5_spin_setpose__thesis',
        's6_control_two_odoms__control',
        's6_control_two_odoms__odom2_diff',
        's6_control_two_odoms__reject',
        's2_square_chair__ukf_thesis',
        's3_gaps_20__ukf2d_diff',
        's5_spin_setpose__ukf',
    ],
)
def test_recorded_runs_come_out_the_same(name):
    run = Run(name)
    bag, most = RecordedBag(run.bag), AGREEMENT[run.filter]
    _, compiled, _ = play(bag, run.parameters, run.filter)
    engine, outputs, _ = play(bag, run.parameters, run.filter, backend='filterpy')
    assert isinstance(engine.filter, FilterpyUkf if run.filter == 'ukf' else FilterpyEkf)
    assert list(outputs) == list(compiled)
    pairs = [(outputs[k], compiled[k]) for k in outputs]
    assert all(a.stamp == b.stamp and a.published == b.published for a, b in pairs)
    assert differences([a.state for a, _ in pairs], [b.state for _, b in pairs]).max() < most
    assert max(scaled_difference(a.covariance, b.covariance) for a, b in pairs) < most


@settings(max_examples=60)
@given(SEEDS, st.sampled_from([(Ekf, FilterpyEkf, {}), (Ukf, FilterpyUkf, {'alpha': 0.3})]), st.booleans())
def test_every_step_comes_out_the_same(seed, pair, commanded):
    rng = np.random.default_rng(seed)
    x, P = random_state(rng, steepest=0.5), random_covariance(rng, 15, 0.01)
    compiled, book = (
        kind(
            Q,
            P,
            x,
            control=COMMANDED if commanded else None,
            dynamic_process_noise=True,
            biases=Biases((1e-4,), (0.01,)),
            **pair[2],
        )
        for kind in pair[:2]
    )
    COMMANDED.set(rng.normal(size=6), 0.0)
    for k in range(8):
        indices, extra, z, R = random_measurement(rng, 16)
        z = compiled.x[indices] + 0.1 * z + np.where((indices >= 3) & (indices <= 5), TAU, 0.0)
        if rng.random() < 0.2:
            z[0] = np.nan
        if rng.random() < 0.2:
            R = np.diag(-R.diagonal())
        step = 0.05 * k, tuple(indices), z, R, float(rng.choice([math.inf, 1.0])), tuple(extra)
        assert compiled.process(*step) == book.process(*step)
        assert book.nis == pytest.approx(compiled.nis, rel=1e-6, abs=1e-9)
        assert differences(book.x, compiled.x).max() < 1e-8
        assert scaled_difference(book.P, compiled.P) < 1e-7
        assert (book.P == book.P.T).all()


@pytest.mark.parametrize('kind', [FilterpyEkf, FilterpyUkf])
@pytest.mark.parametrize('value', [0.0, -1.0, math.nan, math.inf])
def test_a_covariance_that_is_none_is_repaired(kind, value):
    kf = kind(Q, np.eye(15))
    kf.initialised = True
    kf.P[2, 2] = value
    kf.predict(0.1)
    kf.correct((0, 5), np.array([1.0, 0.1]), np.eye(2))
    assert covariance.positive_definite(kf.P) and np.isfinite(kf.x).all()


@pytest.mark.parametrize('filter', ['ekf', 'ukf'])
def test_another_backend_is_refused_by_name(filter):
    params = {'odom0': '/odom', 'odom0_config': [i == 6 for i in range(15)]}
    with pytest.raises(ConfigError, match="backend is 'numpy', allowed are compiled, filterpy"):
        FilterConfig.from_params({**params, 'backend': 'numpy'}, filter)
    compiled = make_filter(FilterConfig.from_params(params, filter))
    assert isinstance(compiled, (Ekf, Ukf)), 'the default is compiled'
