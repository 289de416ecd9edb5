"""The algebra of the filters, compiled by numba and cached on disk: a step costs microseconds.

State x (n,) and covariance P (n, n), n >= 15: the 15 variables of state.py, then biases that walk at random. A measured
variable is the sum of one of the 15 and, where `extra` names one, of a bias: h = e_i (+ e_b).

- predict: P <- F P F' + Q dt through the few entries in which F differs from the identity.
- correct: measurements one scalar at a time; what is correlated is whitened by the Cholesky factor of R first. With the
  optimal gain this is Joseph's form (tested against it); the measured variable's own row is scaled by r/S instead of
  being subtracted from itself, which keeps its digits (G. Bierman, "Factorization Methods for Discrete Sequential
  Estimation", 1977, ch. II).
"""

from __future__ import annotations

from math import fabs, isfinite

import numpy as np

from ahead_of_time import kernel
from sara_localization.filters import sigma_points
from sara_localization.filters.covariance import (
    SMALLEST_VARIANCE,
    WIDTH,
    bound,
    cholesky,
    limit,
    pivots,
    positive_definite,
)
from sara_localization.filters.motion_model import advance, jacobian
from sara_localization.filters.narrow import correct as narrow_correct
from sara_localization.filters.narrow import propagate
from sara_localization.filters.residual import (
    CORRELATED_BADLY,
    NOT_FINITE,
    REJECTED,
    TAKEN,
    Measured,
    innovation,
    wrap_angles,
)

PREDICTED_BADLY = -1


@kernel
def predict(x: np.ndarray, P: np.ndarray, Q: np.ndarray, dt: float, at: np.ndarray) -> bool:
    """The EKF's prediction over dt seconds, in place; Q (n, n) per second; F is taken at the state `at` (n,).

    Returns whether P is positive definite.
    """
    F = jacobian(at, dt)
    advance(x, dt)
    wrap_angles(x)
    if x.shape[0] <= WIDTH:
        work = np.empty((2 * x.shape[0], WIDTH))
        propagate(P, F, Q, dt, work)
        if limit(P):
            return positive_definite(P)
        return pivots(work, P)
    _propagate(P, F, Q, dt)
    return bound(P)


@kernel
def _propagate(P, F, Q, dt):
    """P <- F P F' + Q dt in place, for any n; F (15, 15) is overwritten."""
    n = P.shape[0]
    A = P.copy()
    for r in range(9):
        first = 3 if r < 6 else r + 6
        F[r, r] -= 1.0
        for c in range(first, 15):
            f = F[r, c]
            if f != 0.0:
                for k in range(n):
                    A[r, k] += f * P[c, k]
    for i in range(n):
        for r in range(i + 1):
            total = A[i, r]
            if r < 9:
                for c in range(3 if r < 6 else r + 6, 15):
                    total += A[i, c] * F[r, c]
            P[i, r] = P[r, i] = total + 0.5 * (Q[i, r] + Q[r, i]) * dt


@kernel
def floored(z: np.ndarray, R: np.ndarray) -> tuple[bool, np.ndarray]:
    """Whether z (k,) and R (k, k) are finite, and a copy of R with its diagonal made positive: |r|, at least 1e-9."""
    k, finite = z.shape[0], True
    S = np.empty((k, k))
    for i in range(k):
        finite = finite and isfinite(z[i])
        for j in range(k):
            finite = finite and isfinite(R[i, j])
            S[i, j] = R[i, j]
        S[i, i] = max(fabs(R[i, i]), SMALLEST_VARIANCE)
    return finite, S


@kernel
def correct(x: np.ndarray, P: np.ndarray, m: Measured) -> tuple[int, float, bool]:
    """Take in what is measured, in place.

    Returns (TAKEN, REJECTED or CORRELATED_BADLY: R is not positive definite, nothing done; the squared Mahalanobis
    distance; whether P is positive definite).
    """
    n, k = x.shape[0], m.z.shape[0]
    y, diagonal, W = innovation(x, m), uncorrelated(m.R), np.zeros((k, k))
    if not diagonal and not whiten(m.R, W, y):
        return CORRELATED_BADLY, 0.0, True
    moved, covariance, column = np.zeros(n), P.copy(), np.empty(n)
    distance = 0.0
    for j in range(k):
        i, b, r = m.indices[j], m.extra[j], 1.0
        if diagonal:
            for q in range(n):
                column[q] = covariance[q, i] + (covariance[q, b] if b >= 0 else 0.0)
            prior, r = column[i] + (column[b] if b >= 0 else 0.0), m.R[j, j]
            rest = y[j] - moved[i] - (moved[b] if b >= 0 else 0.0)
        else:
            _whitened_column(covariance, W[j, : j + 1], m, column)
            prior, rest = 0.0, y[j]
            for q in range(j + 1):
                prior += W[j, q] * _both(column, m, q)
                rest -= W[j, q] * _both(moved, m, q)
        S = prior + r
        if not S > 0.0:
            return CORRELATED_BADLY, 0.0, True
        distance += rest * rest / S
        _subtract(moved, covariance, column, rest, S)
        if diagonal and b < 0:
            kept = r / S
            for q in range(n):
                covariance[i, q] = covariance[q, i] = column[q] * kept
    if distance >= m.gate * m.gate:
        return REJECTED, distance, True
    for i in range(n):
        x[i] += moved[i]
        for q in range(n):
            P[i, q] = covariance[i, q]
    wrap_angles(x)
    return TAKEN, distance, positive_definite(P)


@kernel
def uncorrelated(R: np.ndarray) -> bool:
    """Whether R (k, k) is diagonal."""
    for i in range(R.shape[0]):
        for j in range(i):
            if R[i, j] != 0.0 or R[j, i] != 0.0:
                return False
    return True


@kernel
def whiten(R: np.ndarray, W: np.ndarray, y: np.ndarray) -> bool:
    """W (k, k), zeros, becomes the inverse of the Cholesky factor of R, and y (k,) W y; False, and nothing done, where
    R has none.
    """
    k = R.shape[0]
    L = np.zeros((k, k))
    if not cholesky(R, L):
        return False
    for j in range(k):
        W[j, j] = 1.0 / L[j, j]
        for i in range(j + 1, k):
            total = 0.0
            for q in range(j, i):
                total -= L[i, q] * W[q, j]
            W[i, j] = total / L[i, i]
    for j in range(k - 1, -1, -1):
        total = 0.0
        for q in range(j + 1):
            total += W[j, q] * y[q]
        y[j] = total
    return True


@kernel
def _both(values, m, q):
    """Of values (n,) that of the q-th measured variable and its bias together."""
    return values[m.indices[q]] + (values[m.extra[q]] if m.extra[q] >= 0 else 0.0)


@kernel
def _whitened_column(covariance, weights, m, column):
    """P h' into column (n,), for the h of the measured variables with these weights."""
    column[:] = 0.0
    for j in range(weights.shape[0]):
        for q in range(column.shape[0]):
            column[q] += weights[j] * _both(covariance[q], m, j)


@kernel
def _subtract(moved, covariance, column, rest, S):
    """The state's step grows by P h rest / S; P <- P - P h h' P / S."""
    for q in range(column.shape[0]):
        moved[q] += column[q] / S * rest
    for a in range(column.shape[0]):
        gain = column[a] / S
        for q in range(a + 1):
            value = covariance[a, q] - gain * column[q]
            covariance[a, q] = covariance[q, a] = value


@kernel
def separate(z: np.ndarray, R: np.ndarray) -> bool:
    """Whether z (k,) and R (k, k) are finite and R is diagonal."""
    for i in range(z.shape[0]):
        if not (isfinite(z[i]) and isfinite(R[i, i])):
            return False
    return uncorrelated(R)


@kernel
def take(x: np.ndarray, P: np.ndarray, m: Measured) -> tuple[int, float, bool]:
    """`correct` with the variances of R made positive first (`floored`); NOT_FINITE, and nothing done, where z or R is
    not.
    """
    n = x.shape[0]
    if n <= WIDTH and separate(m.z, m.R):
        C = np.empty((n + 3, WIDTH))
        result, distance = narrow_correct(x, P, m, C)
        if result != TAKEN:
            return result, distance, True
        wrap_angles(x)
        return result, distance, pivots(C, P)
    finite, S = floored(m.z, m.R)
    if not finite:
        return NOT_FINITE, 0.0, True
    return correct(x, P, Measured(m.indices, m.extra, m.z, S, m.gate))


@kernel
def predict_and_take(x: np.ndarray, P: np.ndarray, Q: np.ndarray, dt: float, m: Measured) -> tuple[int, float, bool]:
    """`predict` from x itself, then `take`; PREDICTED_BADLY, and nothing taken, where P is not positive definite
    between the two.
    """
    if not predict(x, P, Q, dt, x):
        return PREDICTED_BADLY, 0.0, False
    return take(x, P, m)


@kernel
def all_finite(x: np.ndarray, P: np.ndarray) -> bool:
    """Whether x (n,) and P (n, n) are."""
    for i in range(x.shape[0]):
        if not isfinite(x[i]):
            return False
        for j in range(x.shape[0]):
            if not isfinite(P[i, j]):
                return False
    return True


def warm(kind: str | None = None) -> None:
    """Compile (or load from the cache) what a filter needs, 'ekf' or 'ukf' (None: both), so that nothing compiles on
    the move.
    """
    x, P = np.zeros(15), np.eye(15)
    m = Measured(np.array([6, 11]), np.array([-1, -1]), np.zeros(2), np.eye(2), np.inf)
    wrap_angles(x)
    positive_definite(P)
    floored(m.z, m.R)
    bound(P)
    innovation(x, m)
    take(x, P, m)
    all_finite(x, P)
    if kind != 'ukf':
        predict(x, P, np.eye(15), 0.01, x)
        predict_and_take(x, P, np.eye(15), 0.01, m)
    if kind != 'ekf':
        sigma_points.warm()
