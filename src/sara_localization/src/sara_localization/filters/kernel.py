"""The algebra of the filters, compiled by numba and cached on disk: a step costs microseconds.

State x (n,) and covariance P (n, n), n >= 15: the 15 variables of state.py, then biases that walk at random. A measured
variable is the sum of one of the 15 and, where `extra` names one, of a bias: h = e_i (+ e_b).

- predict: P <- F P F' + Q dt through the few entries in which F differs from the identity.
- correct: measurements one scalar at a time; what is correlated is whitened by the Cholesky factor of R first. With the
  optimal gain this is Joseph's form (tested against it); the measured variable's own row is scaled by r/S instead of
  being subtracted from itself, which keeps its digits (G. Bierman, "Factorization Methods for Discrete Sequential
  Estimation", 1977, ch. II).
- unscented_predict: Merwe's scaled sigma points (R. van der Merwe, 2004). Mean and covariance are written with the
  differences to the central point, in which no weight of the order of -1/alpha2 is left to cost digits:
  m = sum w_i d_i,  P = sum w_i d_i d_i' + (beta - alpha2) m m'   (i >= 1, w_i = 1 / (2 alpha2 (n + kappa))).
"""

from __future__ import annotations

from math import fabs, isfinite, sqrt

import numpy as np

from ahead_of_time import kernel
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
from sara_localization.filters.residual import CORRELATED_BADLY, NOT_FINITE, REJECTED, TAKEN, innovation, wrap_angles

PREDICTED_BADLY = -1
UNSURE_ANGLE = 2.0
"""The variance of an angle (rad2) beyond which sigma points close to the centre say nothing about it."""


@kernel
def predict(x, P, Q, dt, at):
    """The EKF's prediction over dt seconds, in place; Q (n, n) per second; F is taken at the state `at` (n,).

    Returns whether P is positive definite.
    """
    n = x.shape[0]
    F = jacobian(at, dt)
    advance(x, dt)
    wrap_angles(x)
    if n <= WIDTH:
        work = np.empty((2 * n, WIDTH))
        propagate(P, F, Q, dt, work)
        if limit(P):
            return positive_definite(P)
        return pivots(work, P)
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
    return bound(P)


@kernel
def floored(z, R):
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
def correct(x, P, indices, extra, z, R, gate):
    """Take in k measured variables, in place: indices, extra (k,) int64 (-1: no bias), z (k,), R (k, k), gate in
    sigmas.

    Returns (TAKEN, REJECTED or CORRELATED_BADLY: R is not positive definite, nothing done; the squared Mahalanobis
    distance; whether P is positive definite).
    """
    n, k = x.shape[0], z.shape[0]
    y = innovation(x, indices, extra, z)
    diagonal = True
    for i in range(k):
        for j in range(i):
            if R[i, j] != 0.0 or R[j, i] != 0.0:
                diagonal = False
    W = np.zeros((k, k))
    if not diagonal:
        L = np.zeros((k, k))
        if not cholesky(R, L):
            return CORRELATED_BADLY, 0.0, True
        for j in range(k):
            W[j, j] = 1.0 / L[j, j]
            for i in range(j + 1, k):
                total = 0.0
                for m in range(j, i):
                    total -= L[i, m] * W[m, j]
                W[i, j] = total / L[i, i]
        for j in range(k - 1, -1, -1):
            total = 0.0
            for m in range(j + 1):
                total += W[j, m] * y[m]
            y[j] = total
    moved, covariance = np.zeros(n), P.copy()
    column, row = np.empty(n), np.empty(n)
    distance = 0.0
    for j in range(k):
        i, b = indices[j], extra[j]
        if diagonal:
            for m in range(n):
                column[m] = covariance[m, i] + (covariance[m, b] if b >= 0 else 0.0)
            prior = column[i] + (column[b] if b >= 0 else 0.0)
            r = R[j, j]
            rest = y[j] - moved[i] - (moved[b] if b >= 0 else 0.0)
        else:
            column[:] = 0.0
            for m in range(j + 1):
                for q in range(n):
                    column[q] += W[j, m] * (
                        covariance[q, indices[m]] + (covariance[q, extra[m]] if extra[m] >= 0 else 0.0)
                    )
            prior, r, rest = 0.0, 1.0, y[j]
            for m in range(j + 1):
                prior += W[j, m] * (column[indices[m]] + (column[extra[m]] if extra[m] >= 0 else 0.0))
                rest -= W[j, m] * (moved[indices[m]] + (moved[extra[m]] if extra[m] >= 0 else 0.0))
        S = prior + r
        if not S > 0.0:
            return CORRELATED_BADLY, 0.0, True
        distance += rest * rest / S
        for m in range(n):
            moved[m] += column[m] / S * rest
        if diagonal and b < 0:
            kept = r / S
            for m in range(n):
                row[m] = covariance[i, m] * kept
        for a in range(n):
            gain = column[a] / S
            for m in range(a + 1):
                value = covariance[a, m] - gain * column[m]
                covariance[a, m] = covariance[m, a] = value
        if diagonal and b < 0:
            for m in range(n):
                covariance[i, m] = covariance[m, i] = row[m]
    if distance >= gate * gate:
        return REJECTED, distance, True
    for m in range(n):
        x[m] += moved[m]
        for q in range(n):
            P[m, q] = covariance[m, q]
    wrap_angles(x)
    return TAKEN, distance, positive_definite(P)


@kernel
def separate(z, R):
    """Whether z (k,) and R (k, k) are finite and R is diagonal."""
    for i in range(z.shape[0]):
        if not (isfinite(z[i]) and isfinite(R[i, i])):
            return False
        for j in range(i):
            if not (R[i, j] == 0.0 and R[j, i] == 0.0):
                return False
    return True


@kernel
def take(x, P, indices, extra, z, R, gate):
    """`correct` with the variances of R made positive first (`floored`); NOT_FINITE, and nothing done, where z or R is
    not.
    """
    n = x.shape[0]
    if n <= WIDTH and separate(z, R):
        C = np.empty((n + 3, WIDTH))
        result, distance = narrow_correct(x, P, indices, extra, z, R, gate, C)
        if result != TAKEN:
            return result, distance, True
        wrap_angles(x)
        return result, distance, pivots(C, P)
    finite, S = floored(z, R)
    if not finite:
        return NOT_FINITE, 0.0, True
    return correct(x, P, indices, extra, z, S, gate)


@kernel
def predict_and_take(x, P, Q, dt, indices, extra, z, R, gate):
    """`predict` from x itself, then `take`; PREDICTED_BADLY, and nothing taken, where P is not positive definite
    between the two.
    """
    if not predict(x, P, Q, dt, x):
        return PREDICTED_BADLY, 0.0, False
    return take(x, P, indices, extra, z, R, gate)


@kernel
def all_finite(x, P):
    """Whether x (n,) and P (n, n) are."""
    for i in range(x.shape[0]):
        if not isfinite(x[i]):
            return False
        for j in range(x.shape[0]):
            if not isfinite(P[i, j]):
                return False
    return True


@kernel
def unscented_predict(x, P, dt, alpha, beta, kappa, positions_last):
    """The UKF's prediction over dt seconds without process noise, in place. False where P has no Cholesky factor.

    positions_last: take the square root of P from its last variable to the first, so that what only correlates through
    the position (in which the model is linear) is not moved together.
    """
    n = x.shape[0]
    L = np.zeros((n, n))
    if not cholesky(P[::-1, ::-1].copy() if positions_last else P, L):
        return False
    weight = 1.0 / (2.0 * alpha * alpha * (n + kappa))
    spread = alpha * sqrt(n + kappa)
    centre = x.copy()
    advance(centre, dt)
    D = np.empty((2 * n, n))
    point = np.empty(n)
    for j in range(2 * n):
        sign, column = (spread, j) if j < n else (-spread, j - n)
        for i in range(n):
            point[i] = x[i] + sign * (L[n - 1 - i, column] if positions_last else L[i, column])
        advance(point, dt)
        for i in range(n):
            D[j, i] = point[i] - centre[i]
    m = np.zeros(n)
    for j in range(2 * n):
        for i in range(n):
            m[i] += weight * D[j, i]
    bend = beta - alpha * alpha
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
def unscented_step(x, P, Q, dynamic, dt, alpha, beta, kappa):
    """The UKF's prediction over dt seconds with Q (n, n) per second, in place: (whether P had a Cholesky factor, else
    nothing is done; whether P is positive definite).

    dynamic: the pose's block of Q grows with the squared norm of the six velocities. Where an angle's variance is above
    UNSURE_ANGLE the points are spread wider, see ukf.py.
    """
    n = x.shape[0]
    unsure = max(P[3, 3], P[4, 4], P[5, 5]) > UNSURE_ANGLE
    if unsure:
        alpha = max(alpha, sqrt(3.0 / (n + kappa)))
    if not unscented_predict(x, P, dt, alpha, beta, kappa, unsure):
        return False, False
    speed = 0.0
    for i in range(6, 12):
        speed += x[i] * x[i]
    for i in range(n):
        for j in range(n):
            P[i, j] += (Q[i, j] * speed if dynamic and i < 6 and j < 6 else Q[i, j]) * dt
    return True, bound(P)


def warm(kind: str | None = None) -> None:
    """Compile (or load from the cache) what a filter needs, 'ekf' or 'ukf' (None: both), so that nothing compiles on
    the move.
    """
    x, P = np.zeros(15), np.eye(15)
    indices, extra, z, R = np.array([6, 11]), np.array([-1, -1]), np.zeros(2), np.eye(2)
    wrap_angles(x)
    positive_definite(P)
    if kind != 'ukf':
        predict(x, P, np.eye(15), 0.01, x)
    floored(z, R)
    bound(P)
    innovation(x, indices, extra, z)
    take(x, P, indices, extra, z, R, np.inf)
    if kind != 'ukf':
        predict_and_take(x, P, np.eye(15), 0.01, indices, extra, z, R, np.inf)
    all_finite(x, P)
    if kind != 'ekf':
        unscented_step(x, P, np.eye(15), False, 0.01, 1e-3, 2.0, 0.0)
