"""The filters' core as `make bench` times it: many predicts with a correct each, of the cases that the C++ peer was
timed on.

in_a_loop: the kernels alone, one after the other in compiled code. one_by_one: Estimator.predict and .correct called
from Python; by_filterpy: the same of the filters by filterpy (`backend: filterpy`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ahead_of_time import kernel
from sara_localization.filters.ekf import Ekf
from sara_localization.filters.kernel import predict, take
from sara_localization.filters.residual import Measured
from sara_localization.filters.sigma_points import Spread, unscented_step
from sara_localization.filters.state import OFF_PLANE, VX, VYAW, YAW, X, Y
from sara_localization.filters.ukf import Ukf

CASES = {'x, y, vx and forced zeros': tuple(sorted((X, Y, VX, *OFF_PLANE))), 'yaw, vyaw': (YAW, VYAW)}
DT, VARIANCE = 0.01, 0.01
SPREAD = Spread(0.001, 2.0, 0.0)


@kernel
def ekf_steps(count: int, x: np.ndarray, P: np.ndarray, Q: np.ndarray, dt: float, measured: Measured) -> None:
    """`count` predicts over dt (s) with a correct each, in place."""
    for _ in range(count):
        predict(x, P, Q, dt, x)
        take(x, P, measured)


@kernel
def ukf_steps(count: int, x: np.ndarray, P: np.ndarray, Q: np.ndarray, dt: float, measured: Measured) -> None:
    """The same for the unscented filter."""
    for _ in range(count):
        unscented_step(x, P, Q, False, dt, SPREAD)
        take(x, P, measured)


def _setting(case):
    """(x, Q, indices, z, R): a robot that drives at 0.5 m/s and turns."""
    indices = np.array(CASES[case], dtype=np.int64)
    x = np.zeros(15)
    x[[VX, VYAW]] = 0.5, 0.2
    return x, 0.05 * np.eye(15), indices, x[indices].copy(), VARIANCE * np.eye(len(indices))


def in_a_loop(kind: str, case: str, count: int) -> Callable:
    """A function that does `count` steps in compiled code; kind: 'ekf' or 'ukf'."""
    x, Q, indices, z, R = _setting(case)
    measured = Measured(indices, np.full(len(indices), -1, np.int64), z, R, np.inf)
    P, steps = VARIANCE * np.eye(15), ekf_steps if kind == 'ekf' else ukf_steps
    return lambda: steps(count, x, P, Q, DT, measured)


def one_by_one(kind: str, case: str, count: int) -> Callable:
    """A function that calls predict and correct of an Ekf or Ukf `count` times."""
    return _calls(Ekf if kind == 'ekf' else Ukf, case, count)


def by_filterpy(kind: str, case: str, count: int) -> Callable:
    """The same of a FilterpyEkf or FilterpyUkf."""
    from sara_localization.filters.filterpy_backend import FilterpyEkf, FilterpyUkf

    return _calls(FilterpyEkf if kind == 'ekf' else FilterpyUkf, case, count)


def _calls(estimator, case, count):
    x, Q, indices, z, R = _setting(case)
    kf, measured = estimator(Q, VARIANCE * np.eye(15), x), tuple(indices.tolist())
    kf.initialised = True

    def work():
        for _ in range(count):
            kf.predict(DT)
            kf.correct(measured, z, R)

    return work


def warm() -> None:
    """Compile (or load from the cache) the loops."""
    for kind in ('ekf', 'ukf'):
        in_a_loop(kind, 'yaw, vyaw', 1)()
