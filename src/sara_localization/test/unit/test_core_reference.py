"""The filter's core against robot_localization's own (test/data/README.md)."""
from pathlib import Path

import numpy as np
import pytest

from sara_localization.ekf import Ekf
from sara_localization.geometry import TAU

REFERENCE = np.load(Path(__file__).resolve().parents[1] / 'data' / 'rl_core_ekf.npz')
UPPER = np.triu_indices(15)


@pytest.mark.parametrize('s', range(len(REFERENCE['kind'])), ids=list(REFERENCE['kind']))
def test_state_and_covariance_agree_to_1e6(s):
    data = {name: REFERENCE[name][s] for name in REFERENCE.files if name != 'cov_steps'}
    ekf = Ekf(data['Q'], data['P0'], data['x0'], keep_positive=False)
    checked = list(REFERENCE['cov_steps'])
    for k in range(len(data['op'])):
        measured = np.flatnonzero(data['mask'][k])
        z, R = data['z'][k][measured], data['R'][data['r_index'][k]][np.ix_(measured, measured)]
        if data['op'][k] == 0:
            ekf.predict(data['dt'][k])
        elif data['op'][k] == 1:
            ekf.correct(measured, z, R, data['threshold'][k])
        else:
            ekf.process(data['time'][k], measured, z, R, data['threshold'][k])
        if not data['comparable'][k]:
            continue
        tolerance = np.maximum(1e-6, 100.0 * data['sensitivity'][k])
        expected = data['state'][k]
        difference = ekf.x - expected
        difference[3:6] -= TAU * np.round(difference[3:6] / TAU)
        assert (np.abs(difference) <= tolerance[0] * np.maximum(1.0, np.abs(expected))).all(), k
        assert ekf.last_measurement_time == data['last_measurement_time'][k]
        if k in checked:
            P = np.zeros((15, 15))
            P[UPPER] = data['cov_triu'][checked.index(k)]
            P = P + P.T - np.diag(np.diag(P))
            sigma = np.sqrt(np.abs(np.diag(P)))
            assert (np.abs(ekf.P - P) <= tolerance[1] * np.outer(sigma, sigma) + 1e-300).all(), k
