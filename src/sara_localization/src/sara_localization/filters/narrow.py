"""The algebra of kernel.py for states of up to WIDTH variables: the same sums in the same order, and so the same to the
last digit.

Rows are padded to WIDTH so that every inner loop runs over a row of a length that the compiler knows, which makes few
vector instructions of it; loops of a length that shows at run time took half as long again. Of symmetric matrices the
upper half alone is worked on.
"""

from __future__ import annotations

from math import fabs

from ahead_of_time import kernel
from sara_localization.filters.covariance import SMALLEST_VARIANCE, WIDTH
from sara_localization.filters.residual import CORRELATED_BADLY, REJECTED, TAKEN, residual


@kernel
def propagate(P, F, Q, dt, A):
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
def correct(x, P, indices, extra, z, R, gate, C):
    """Take in k uncorrelated variables z (k,), R (k, k) diagonal, n <= WIDTH, in place; the rest as kernel.correct.

    C (n + 3, WIDTH) is where it works; in the end it holds the upper half of the new P. Angles of x are not wrapped.
    Returns (TAKEN, REJECTED or CORRELATED_BADLY, as kernel.correct; the squared Mahalanobis distance).
    """
    n, k = P.shape[0], z.shape[0]
    moved, column, gains = n, n + 1, n + 2  # rows of C
    for i in range(n):
        for m in range(n):
            C[i, m] = P[i, m]
        for m in range(n, WIDTH):
            C[i, m] = 0.0
    for m in range(WIDTH):
        C[moved, m] = C[column, m] = 0.0
    distance = 0.0
    for j in range(k):
        i, b = indices[j], extra[j]
        for m in range(i):
            C[column, m] = C[m, i]
        for m in range(i, n):
            C[column, m] = C[i, m]
        if b >= 0:
            for m in range(n):
                C[column, m] += C[min(m, b), max(m, b)]
        prior = C[column, i] + (C[column, b] if b >= 0 else 0.0)
        rest = residual(x, i, b, z[j]) - C[moved, i] - (C[moved, b] if b >= 0 else 0.0)
        r = max(fabs(R[j, j]), SMALLEST_VARIANCE)
        S = prior + r
        if not S > 0.0:
            return CORRELATED_BADLY, 0.0
        distance += rest * rest / S
        for m in range(WIDTH):
            C[gains, m] = C[column, m] / S
            C[moved, m] += C[gains, m] * rest
        for m in range(n):
            f = C[column, m]
            if f != 0.0:
                for a in range(WIDTH):
                    C[m, a] -= C[gains, a] * f
        if b < 0:
            kept = r / S
            for m in range(i):
                C[m, i] = C[column, m] * kept
            for m in range(i, n):
                C[i, m] = C[column, m] * kept
    if distance >= gate * gate:
        return REJECTED, distance
    for m in range(n):
        x[m] += C[moved, m]
        for q in range(m, n):
            P[m, q] = P[q, m] = C[m, q]
    return TAKEN, distance
