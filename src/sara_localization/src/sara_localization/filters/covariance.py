"""What a covariance must be, finite, symmetric and positive definite, and what to do with one that is not. Compiled by
numba.
"""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np

from ahead_of_time import kernel

SMALLEST_VARIANCE = 1e-9
# Who knows a variable no better than this knows nothing; squares of it are still numbers.
LARGEST_VARIANCE = 1e20
WIDTH = 16
"""Rows of matrices that are padded to this length: see narrow.py."""
# A covariance counts as positive definite if the smallest eigenvalue of its correlations is above this, which is some
# ten times the round-off of the decomposition that finds out.
MARGIN = 1e-13


@kernel
def cholesky(A: np.ndarray, L: np.ndarray) -> bool:
    """L (k, k) lower with L L' = A; False where A is not positive definite by more than round-off."""
    for i in range(A.shape[0]):
        for j in range(i + 1):
            total = 0.5 * (A[i, j] + A[j, i])
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                if not total > MARGIN * A[i, i]:
                    return False
                L[i, i] = sqrt(total)
            else:
                L[i, j] = total / L[j, j]
    return True


@kernel
def pivots(U: np.ndarray, P: np.ndarray) -> bool:
    """Whether P (n, n) is finite and positive definite by a margin above round-off, by the pivots of P - MARGIN
    diag(P).

    With Gauss's elimination, which needs no square roots, a leading block is judged as the whole is: what it says of P
    it says of the block of the first variables too.

    U: n rows of n or more, of which the upper half holds P's, padded with numbers; it is overwritten.
    """
    n = P.shape[0]
    for i in range(n):
        pivot = U[i, i] - MARGIN * P[i, i]
        if not (isfinite(P[i, i]) and P[i, i] > 0.0 and pivot > 0.0):
            return False
        scale = 1.0 / pivot
        for k in range(i + 1, n):
            f = U[i, k] * scale
            if f != 0.0:
                for j in range(U.shape[1]):
                    U[k, j] -= f * U[i, j]
    return True


@kernel
def positive_definite(P: np.ndarray) -> bool:
    """Whether P (n, n), symmetric, is finite and positive definite by a margin above round-off, whatever the units of
    its rows.
    """
    return pivots(P.copy(), P)


@kernel
def limit(P: np.ndarray) -> bool:
    """Keep every variance of P (n, n) below LARGEST_VARIANCE, in place; correlations stay. Returns whether one was
    above.
    """
    n, changed = P.shape[0], False
    for i in range(n):
        if P[i, i] > LARGEST_VARIANCE:
            changed = True
            factor = sqrt(LARGEST_VARIANCE / P[i, i])
            for j in range(n):
                P[i, j] *= factor
                P[j, i] = P[i, j]
            P[i, i] = LARGEST_VARIANCE
    return changed


@kernel
def bound(P: np.ndarray) -> bool:
    """`limit`, and then whether P is positive definite."""
    limit(P)
    return positive_definite(P)


def repair(P: np.ndarray) -> None:
    """Make P (n, n) symmetric and positive definite in place: the eigenvalues of its correlations kept above 1e-11.

    Variances that are not positive or not finite become 1e-9, correlations that are not finite 0.
    """
    variances = P.diagonal().copy()
    bad = ~(np.isfinite(variances) & (variances > 0.0))
    variances[bad] = SMALLEST_VARIANCE
    sigma = np.sqrt(variances)
    with np.errstate(all='ignore'):
        C = 0.5 * (P + P.T) / np.outer(sigma, sigma)
    C[~np.isfinite(C)] = 0.0
    C[bad, :] = C[:, bad] = 0.0
    C = np.clip(C, -1.0, 1.0)
    np.fill_diagonal(C, 1.0)
    values, vectors = np.linalg.eigh(C)
    C = (vectors * np.maximum(values, 1e-11)) @ vectors.T
    P[:] = 0.5 * (C + C.T) * np.outer(sigma, sigma)
