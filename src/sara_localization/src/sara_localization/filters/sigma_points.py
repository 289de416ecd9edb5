"""The unscented filter's prediction, compiled by numba.

Merwe's scaled sigma points (R. van der Merwe, 2004). Mean and covariance are written with the differences to the
central point, in which no weight of the order of -1/alpha2 is left to cost digits:
m = sum w_i d_i,  P = sum w_i d_i d_i' + (beta - alpha2) m m'   (i >= 1, w_i = 1 / (2 alpha2 (n + kappa))).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_localization.filters.covariance import bound, cholesky
from sara_localization.filters.motion_model import advance
from sara_localization.filters.residual import wrap_angles

UNSURE_ANGLE = 2.0
"""The variance of an angle (rad2) beyond which sigma points close to the centre say nothing about it."""


class Spread(NamedTuple):
    """The spread and weights of the sigma points."""

    alpha: float = 0.001
    beta: float = 2.0
    kappa: float = 0.0


@kernel
def unscented_predict(x: np.ndarray, P: np.ndarray, dt: float, spread: Spread, positions_last: bool) -> bool:
    """The UKF's prediction over dt seconds without process noise, in place. False where P has no Cholesky factor.

    positions_last: take the square root of P from its last variable to the first, so that what only correlates through
    the position (in which the model is linear) is not moved together.
    """
    n = x.shape[0]
    L = np.zeros((n, n))
    if not cholesky(P[::-1, ::-1].copy() if positions_last else P, L):
        return False
    alpha = spread.alpha
    weight = 1.0 / (2.0 * alpha * alpha * (n + spread.kappa))
    reach = alpha * sqrt(n + spread.kappa)
    centre = x.copy()
    advance(centre, dt)
    D = np.empty((2 * n, n))
    point = np.empty(n)
    for j in range(2 * n):
        sign, column = (reach, j) if j < n else (-reach, j - n)
        for i in range(n):
            point[i] = x[i] + sign * (L[n - 1 - i, column] if positions_last else L[i, column])
        advance(point, dt)
        for i in range(n):
            D[j, i] = point[i] - centre[i]
    m = np.zeros(n)
    for j in range(2 * n):
        for i in range(n):
            m[i] += weight * D[j, i]
    bend = spread.beta - alpha * alpha
    for a in range(n):
        for b in range(a + 1):
            total = bend * m[a] * m[b]
            for j in range(2 * n):
                total += weight * D[j, a] * D[j, b]
            P[a, b] = P[b, a] = total
    for i in range(n):
        x[i] = centre[i] + m[i]
    wrap_angles(x)
    return True


@kernel
def unscented_step(
    x: np.ndarray, P: np.ndarray, Q: np.ndarray, dynamic: bool, dt: float, spread: Spread
) -> tuple[bool, bool]:
    """The UKF's prediction over dt seconds with Q (n, n) per second, in place: (whether P had a Cholesky factor, else
    nothing is done; whether P is positive definite).

    dynamic: the pose's block of Q grows with the squared norm of the six velocities. Where an angle's variance is above
    UNSURE_ANGLE the points are spread wider, see ukf.py.
    """
    n = x.shape[0]
    unsure = max(P[3, 3], P[4, 4], P[5, 5]) > UNSURE_ANGLE
    if unsure:
        spread = Spread(max(spread.alpha, sqrt(3.0 / (n + spread.kappa))), spread.beta, spread.kappa)
    if not unscented_predict(x, P, dt, spread, unsure):
        return False, False
    speed = 0.0
    for i in range(6, 12):
        speed += x[i] * x[i]
    for i in range(n):
        for j in range(n):
            P[i, j] += (Q[i, j] * speed if dynamic and i < 6 and j < 6 else Q[i, j]) * dt
    return True, bound(P)


def warm() -> None:
    """Compile (or load from the cache) the step."""
    unscented_step(np.zeros(15), np.eye(15), np.eye(15), False, 0.01, Spread())
