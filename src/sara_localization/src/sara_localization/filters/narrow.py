"""The algebra of kernel.py for states of up to WIDTH variables: the same sums in the same order, and so the same to the
last digit.

Rows are padded to WIDTH so that every inner loop runs over a row of a length that the compiler knows, which makes few
vector instructions of it. Of symmetric matrices the upper half alone is worked on. Without this module a prediction
with a correction takes twice as long (7.5 instead of 3.8 us for ten variables, 5.7 instead of 2.9 us for two, in a
compiled loop): more than half of the C++ filter's time, which is the limit of `make bench`.
"""

from __future__ import annotations

from math import fabs

import numpy as np

from ahead_of_time import kernel
from sara_localization.filters.covariance import SMALLEST_VARIANCE, WIDTH
from sara_localization.filters.residual import CORRELATED_BADLY, REJECTED, TAKEN, Measured, residual


@kernel
def propagate(P: np.ndarray, F: np.ndarray, Q: np.ndarray, dt: float, A: np.ndarray) -> None:
    """P <- F P F' + Q dt in place, n <= WIDTH; P (n, n), Q (n, n) per second, F (15, 15) the motion model's, which is
    overwritten.

    A (2 n, WIDTH) is where it works: F P above, its transpose below; in the end it holds the upper half of the new P.
    """
    n = P.shape[0]
    for i in range(n):
        for k in range(n):
            A[i, k] = A[n + i, k] = P[i, k]
        for k in range(n, WIDTH):
            A[i, k] = A[n + i, k] = 0.0
    for r in range(9):
        F[r, r] -= 1.0
        for c in range(3 if r < 6 else r + 6, 15):
            f = F[r, c]
            if f != 0.0:
                for k in range(WIDTH):
                    A[r, k] += f * A[n + c, k]
    for i in range(9):
        for k in range(n):
            A[n + k, i] = A[i, k]
    for r in range(9):
        for k in range(WIDTH):
            A[r, k] = A[n + r, k]
        for c in range(3 if r < 6 else r + 6, 15):
            f = F[r, c]
            if f != 0.0:
                for k in range(WIDTH):
                    A[r, k] += A[n + c, k] * f
    for r in range(9, n):
        for k in range(WIDTH):
            A[r, k] = A[n + r, k]
    for r in range(n):
        for i in range(r, n):
            A[r, i] += 0.5 * (Q[i, r] + Q[r, i]) * dt
            P[i, r] = P[r, i] = A[r, i]


@kernel
def correct(x: np.ndarray, P: np.ndarray, m: Measured, C: np.ndarray) -> tuple[int, float]:
    """Take in k uncorrelated variables m (R diagonal), n <= WIDTH, in place; the rest as kernel.correct.

    C (n + 3, WIDTH) is where it works; in the end it holds the upper half of the new P. Angles of x are not wrapped.
    Returns (TAKEN, REJECTED or CORRELATED_BADLY, as kernel.correct; the squared Mahalanobis distance).
    """
    n = P.shape[0]
    moved, column = n, n + 1  # rows of C
    for i in range(n):
        for q in range(n):
            C[i, q] = P[i, q]
        for q in range(n, WIDTH):
            C[i, q] = 0.0
    for q in range(WIDTH):
        C[moved, q] = C[column, q] = 0.0
    distance = 0.0
    for j in range(m.z.shape[0]):
        i, b = m.indices[j], m.extra[j]
        _column_of(C, n, i, b)
        prior = C[column, i] + (C[column, b] if b >= 0 else 0.0)
        rest = residual(x, i, b, m.z[j]) - C[moved, i] - (C[moved, b] if b >= 0 else 0.0)
        r = max(fabs(m.R[j, j]), SMALLEST_VARIANCE)
        S = prior + r
        if not S > 0.0:
            return CORRELATED_BADLY, 0.0
        distance += rest * rest / S
        _subtract(C, n, rest, S)
        if b < 0:
            _keep_row(C, n, i, r / S)
    if distance >= m.gate * m.gate:
        return REJECTED, distance
    for i in range(n):
        x[i] += C[moved, i]
        for q in range(i, n):
            P[i, q] = P[q, i] = C[i, q]
    return TAKEN, distance


@kernel
def _column_of(C, n, i, b):
    """P h into its row of C, for the variable i and the bias b (-1: none)."""
    column = n + 1
    for q in range(i):
        C[column, q] = C[q, i]
    for q in range(i, n):
        C[column, q] = C[i, q]
    if b >= 0:
        for q in range(n):
            C[column, q] += C[min(q, b), max(q, b)]


@kernel
def _subtract(C, n, rest, S):
    """The state's step grows by P h rest / S; P <- P - P h h' P / S."""
    moved, column, gains = n, n + 1, n + 2
    for q in range(WIDTH):
        C[gains, q] = C[column, q] / S
        C[moved, q] += C[gains, q] * rest
    for q in range(n):
        f = C[column, q]
        if f != 0.0:
            for a in range(WIDTH):
                C[q, a] -= C[gains, a] * f


@kernel
def _keep_row(C, n, i, kept):
    """The measured variable's own row, scaled instead of subtracted from itself."""
    column = n + 1
    for q in range(i):
        C[q, i] = C[column, q] * kept
    for q in range(i, n):
        C[i, q] = C[column, q] * kept
