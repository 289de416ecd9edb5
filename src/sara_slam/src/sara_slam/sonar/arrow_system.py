"""Normal equations of a chain of unknowns that few others border on, solved without fill beyond the border.

    | T   C | | x |   | b |
    | C'  D | | y | = | d |

T is banded, as of poses along a way; C and D are dense, of what all poses may have to do with. Cholesky's decomposition
goes down the chain and collects D - C' T^-1 C. It is written out, for BLAS adds in an order that depends on where
arrays lie in memory, and the same input is to give the same bytes.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel


@kernel
def _eliminate(band, C, D, b, d):
    """Forward: T, in band, becomes its factor; C and b are solved by it; D and d lose what the chain explains."""
    wide, n = band.shape
    border = len(d)
    for i in range(n):
        pivot = math.sqrt(band[0, i])
        band[0, i] = pivot
        b[i] /= pivot
        for p in range(border):
            C[i, p] /= pivot
        last = min(wide, n - i)
        for k in range(1, last):
            band[k, i] /= pivot
        for k in range(1, last):
            factor = band[k, i]
            if factor == 0.0:
                continue
            for m in range(k, last):
                band[m - k, i + k] -= band[m, i] * factor
            b[i + k] -= factor * b[i]
            for p in range(border):
                C[i + k, p] -= factor * C[i, p]
        for p in range(border):
            factor = C[i, p]
            if factor != 0.0:
                d[p] -= factor * b[i]
                for q in range(p + 1):
                    D[p, q] -= factor * C[i, q]


@kernel
def _solve_dense(D, d):
    """Cholesky of D, whose lower half is given; d becomes the solution."""
    n = len(d)
    for i in range(n):
        for j in range(i + 1):
            total = D[i, j]
            for k in range(j):
                total -= D[i, k] * D[j, k]
            D[i, j] = math.sqrt(total) if i == j else total / D[j, j]
        for k in range(i):
            d[i] -= D[i, k] * d[k]
        d[i] /= D[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            d[i] -= D[k, i] * d[k]
        d[i] /= D[i, i]


@kernel
def _back(band, C, b, d):
    """Backward: b becomes the solution of the chain."""
    wide, n = band.shape
    for i in range(n - 1, -1, -1):
        total = b[i]
        for p in range(len(d)):
            total -= C[i, p] * d[p]
        for k in range(1, min(wide, n - i)):
            total -= band[k, i] * b[i + k]
        b[i] = total / band[0, i]


def solve(band: np.ndarray, C: np.ndarray, D: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(n + m,) the unknowns. band (k, n): T's diagonal and those below it, band[j, i] = T[i + j, i]; C (n, m); D (m,
    m); right (n + m,). All positive definite together; they are overwritten.
    """
    n = band.shape[1]
    b, d = right[:n].copy(), right[n:].copy()
    _eliminate(band, C, D, b, d)
    _solve_dense(D, d)
    _back(band, C, b, d)
    return np.concatenate((b, d))


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    solve(np.ones((1, 2)), np.zeros((2, 1)), np.ones((1, 1)), np.zeros(3))
