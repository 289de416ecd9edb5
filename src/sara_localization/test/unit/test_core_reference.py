"""The filters' cores against robot_localization's own (test/data/README.md), on every comparable step of 40
scenarios.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
from peer_ukf import PeerUkf  # noqa: E402

from sara_common.planar import TWO_PI  # noqa: E402
from sara_localization.filters.control import Control, ControlConfig  # noqa: E402
from sara_localization.filters.ekf import Ekf  # noqa: E402
from sara_localization.filters.ukf import Ukf  # noqa: E402

DATA = Path(__file__).resolve().parents[1] / 'data'
EKF, UKF = dict(np.load(DATA / 'rl_core_ekf.npz')), dict(np.load(DATA / 'rl_core_ukf.npz'))
SCENARIOS = pytest.mark.parametrize('s', range(len(EKF['kind'])), ids=list(EKF['kind']))
UPPER = np.triu_indices(15)
# Here the first measurement leaves no covariance: zero variances, or a block that does not fit the cross terms that
# stay.
NO_COVARIANCE = (18, 19, 39)


def arguments(s):
    control = None
    if EKF['use_control'][s]:
        limits, gains, braking_limits, braking_gains = EKF['control_limits'][s]
        control = Control(
            ControlConfig(
                tuple(EKF['control_mask'][s].astype(bool)),
                EKF['control_timeout'][s],
                tuple(limits),
                tuple(braking_limits),
                tuple(gains),
                tuple(braking_gains),
            )
        )
    return dict(
        process_noise=EKF['Q'][s],
        initial_covariance=EKF['P0'][s],
        initial_state=EKF['x0'][s],
        control=control,
        dynamic_process_noise=bool(EKF['dynamic_q'][s]),
    )


def replay(s, kf, control):
    """Yields the step after each of the scenario's 50."""
    for k in range(len(EKF['op'][s])):
        measured = np.flatnonzero(EKF['mask'][s][k])
        z, R = EKF['z'][s][k][measured], EKF['R'][s][EKF['r_index'][s][k]][np.ix_(measured, measured)]
        if control is not None and EKF['u_set'][s][k]:
            control.set(EKF['u'][s][k], EKF['u_time'][s][k])
        op, threshold = EKF['op'][s][k], EKF['threshold'][s][k]
        if op == 0:
            kf.predict(EKF['dt'][s][k], EKF['time'][s][k])
        elif op == 1:
            kf.correct(measured, z, R, threshold)
        else:
            kf.process(EKF['time'][s][k], measured, z, R, threshold)
        yield k


def agree(kf, reference, s, k, least):
    """State and covariance of step k: within `least`, or 100 times `sensitivity`, the reference's own noise there."""
    tolerance = np.maximum(least, 100.0 * reference['sensitivity'][s][k])
    expected = reference['state'][s][k]
    difference = kf.x - expected
    difference[3:6] -= TWO_PI * np.round(difference[3:6] / TWO_PI)
    assert (np.abs(difference) <= tolerance[0] * np.maximum(1.0, np.abs(expected))).all(), k
    assert kf.last_measurement_time == reference['last_measurement_time'][s][k]
    steps = list(reference['cov_steps'])
    if k in steps:
        P = np.zeros((15, 15))
        P[UPPER] = reference['cov_triu'][s][steps.index(k)]
        P = P + P.T - np.diag(np.diag(P))
        sigma = np.sqrt(np.abs(np.diag(P)))
        assert (np.abs(kf.P - P) <= tolerance[1] * np.outer(sigma, sigma) + 1e-300).all(), k


@pytest.mark.filterwarnings('ignore:overflow')
@SCENARIOS
def test_ekf_agrees_to_1e6(s):
    given = arguments(s)
    kf = Ekf(**given)
    kf.keep_positive = s not in NO_COVARIANCE
    for k in replay(s, kf, given['control']):
        if EKF['comparable'][s][k]:
            agree(kf, EKF, s, k, 1e-6)
    assert kf.repairs == 0


@pytest.mark.parametrize('s', [s for s in range(len(EKF['kind'])) if s not in NO_COVARIANCE])
def test_ukf_agrees_to_1e5_once_the_peers_defects_are_put_in(s):
    alpha, kappa, beta = UKF['ukf_alpha_kappa_beta'][s]
    kf = PeerUkf(**arguments(s), alpha=alpha, kappa=kappa, beta=beta)
    for k in replay(s, kf, None):
        if UKF['comparable'][s][k] and not UKF['peer_defect'][s][k]:
            agree(kf, UKF, s, k, 1e-5)


@SCENARIOS
def test_ukf_itself_agrees_before_the_first_fusion(s):
    """The first measurement and predictions after it: there the peer has no defect but its control without effect."""
    given = arguments(s)
    alpha, kappa, beta = UKF['ukf_alpha_kappa_beta'][s]
    kf = Ukf(**{**given, 'control': None}, alpha=alpha, kappa=kappa, beta=beta)
    kf.keep_positive = s not in NO_COVARIANCE
    for k in replay(s, kf, None):
        if k > 0 and EKF['op'][s][k] != 0:
            break
        if UKF['comparable'][s][k] and not UKF['peer_defect'][s][k]:
            agree(kf, UKF, s, k, 1e-5)


@pytest.mark.parametrize('s', NO_COVARIANCE)
def test_a_first_measurement_that_leaves_no_covariance_is_mended(s):
    kf = Ekf(**arguments(s))
    for _ in replay(s, kf, None):
        sigma = np.sqrt(kf.P.diagonal())
        assert (kf.P == kf.P.T).all() and np.linalg.eigvalsh(kf.P / np.outer(sigma, sigma)).min() > 0.0
