"""Does the filter know how wrong it is? NEES and NIS (Y. Bar-Shalom, "Estimation with Applications to Tracking", 2001,
ch. 5.4).

The normalised estimation error squared e' P^-1 e of an honest filter is chi-square distributed with as many degrees of
freedom as e has elements, and so is the normalised innovation squared; their means lie within `interval`. Above it a
filter claims to know more than it does, below it less.

Of all moments at which a probability was said to be about p, what it is of happens in the share p, where it is honest
(A. Niculescu-Mizil, R. Caruana, "Predicting good probabilities with supervised learning", 2005).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from sara_common.planar import wrap_exact
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.motion_model import advance
from sara_localization.filters.state import SIZE, VX, VYAW, YAW, X, Y
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import TwistData

PLANAR_POSE = (X, Y, YAW)
# Process noise per second of the trial's robot: it turns and drives as it likes, and slips a little.
TRIAL_NOISE = {X: 1e-4, Y: 1e-4, YAW: 1e-5, VX: 0.05, VYAW: 0.02}
TRIAL_VARIANCES = {VX: 4e-4, VYAW: 1e-4}
TRIAL_START = {X: 1e-4, Y: 1e-4, YAW: 1e-4, VX: 0.04, VYAW: 0.01}
BINS = 10  # of a reliability curve
QUANTILE, CONSISTENT = 7.815, 0.95
"""Of chi-square with as many degrees of freedom as PLANAR_POSE has elements, and of which probability."""


def nees(error: np.ndarray, P: np.ndarray) -> float:
    """e' P^-1 e of an error (k,) and its covariance (k, k); inf where that is singular, or is but for rounding."""
    try:
        found = float(np.asarray(error) @ np.linalg.solve(P, error))
    except np.linalg.LinAlgError:
        return math.inf
    return found if found >= 0.0 else math.inf


def interval(dof: int, samples: int, probability: float = 0.95) -> tuple[float, float]:
    """Bounds of the mean of `samples` independent chi-square values of `dof` degrees of freedom."""
    from scipy.special import chdtri

    tail, all_dof = 0.5 * (1.0 - probability), dof * samples
    return float(chdtri(all_dof, 1.0 - tail)) / samples, float(chdtri(all_dof, tail)) / samples


def nees_trial(seed: int, filter: str = 'ekf', seconds: float = 30.0, rate: float = 20.0) -> float:
    """NEES of (x, y, yaw) after a drive of a robot drawn from the filter's own model; vx and vyaw are measured."""
    rng, dt = np.random.default_rng(seed), 1.0 / rate
    noise, start = np.full(SIZE, 1e-12), np.full(SIZE, 1e-9)
    for variances, given in ((noise, TRIAL_NOISE), (start, TRIAL_START)):
        for i, variance in given.items():
            variances[i] = variance
    config = FilterConfig.from_params(
        {
            'frequency': rate,
            'two_d_mode': True,
            'process_noise_covariance': noise.tolist(),
            'initial_estimate_covariance': start.tolist(),
            'twist0': '/twist',
            'twist0_config': [i in TRIAL_VARIANCES for i in range(SIZE)],
        },
        filter,
    )
    engine = FilterEngine(config, TransformBuffer())
    R = np.diag([TRIAL_VARIANCES.get(i, 1.0) for i in range(6, 12)])
    moving = list(TRIAL_NOISE)
    truth, now, output = np.zeros(SIZE), 1000.0, None
    truth[list(TRIAL_START)] = rng.normal(size=len(TRIAL_START)) * np.sqrt(list(TRIAL_START.values()))
    for step in range(round(seconds * rate)):
        if step:
            advance(truth, dt)
            truth[moving] += rng.normal(size=len(moving)) * np.sqrt(noise[moving] * dt)
            now += dt
        z = truth[6:12] + rng.normal(size=6) * np.sqrt(R.diagonal())
        engine.add_twist('twist0', TwistData(now, 'base_link', tuple(z[:3]), tuple(z[3:]), R))
        output = engine.tick(now)
    error = truth[list(PLANAR_POSE)] - output.state[list(PLANAR_POSE)]
    error[2] = wrap_exact(error[2])
    return nees(error, output.covariance[np.ix_(PLANAR_POSE, PLANAR_POSE)])


def nees_campaign(seeds: Iterable[int], filter: str = 'ekf') -> tuple[float, float, float]:
    """(mean NEES of (x, y, yaw) over the seeds, and the two ends of its 95 % interval)."""
    values = [nees_trial(seed, filter) for seed in seeds]
    return (float(np.mean(values)),) + interval(len(PLANAR_POSE), len(values))


def reliability(moments: Sequence[tuple[float, bool]]) -> tuple[list[tuple[int, float, float]], float]:
    """[(how many, mean probability, share of wrong poses)] of each of BINS bins that holds some; and the expected
    calibration error, their mean distance by how many they hold.
    """
    bins: list[list] = [[] for _ in range(BINS)]
    for moment in moments:
        bins[min(int(moment[0] * BINS), BINS - 1)].append(moment)
    rows = [(len(of), sum(p for p, _ in of) / len(of), sum(wrong for _, wrong in of) / len(of)) for of in bins if of]
    return rows, sum(n * abs(p - wrong) for n, p, wrong in rows) / len(moments)
