"""The small loops over a message's values and covariance, compiled: numpy's calls cost more than their work here."""
from __future__ import annotations

from math import fabs, sqrt

import numpy as np
from numba import njit

from .kernel import cholesky
from .state import SIZE


@njit(cache=True)
def sound(values, covariance, mask, largest_value, largest_variance):
    """Whether everything is a number of a sane size and what is measured (mask (n,) bool) has a positive variance."""
    n = values.shape[0]
    for i in range(n):
        if not fabs(values[i]) < largest_value:
            return False
        for j in range(n):
            if not fabs(covariance[i, j]) < largest_variance:
                return False
        if mask[i] and not covariance[i, i] > 0.0:
            return False
    return True


@njit(cache=True)
def turn(R, mask, covariance):
    """Turn mask (n,) and covariance (n, n), three variables at a time, by the (3, 3) matrix R, in place."""
    n = mask.shape[0]
    turned = np.empty((n, n))
    for block in range(0, n, 3):
        on = mask[block:block + 3].copy()
        for i in range(3):
            length = 0.0
            for j in range(3):
                if on[j]:
                    length += R[i, j] * R[i, j]
            mask[block + i] = sqrt(length) >= 1e-6
            for k in range(n):
                turned[block + i, k] = (R[i, 0] * covariance[block, k] + R[i, 1] * covariance[block + 1, k]
                                        + R[i, 2] * covariance[block + 2, k])
    for block in range(0, n, 3):
        for i in range(3):
            for k in range(n):
                covariance[k, block + i] = (R[i, 0] * turned[k, block] + R[i, 1] * turned[k, block + 1]
                                            + R[i, 2] * turned[k, block + 2])


@njit(cache=True)
def measured(first, values, covariance, mask, two_d, off_plane, off_plane_variance, largest_value):
    """Of n variables from `first` on those that are measured: (indices (k,), z (k,), R (k, k), whether R is positive
    definite, how many of the k are not forced, whether all of z is below largest_value).

    two_d: the variables off_plane are measured as 0 besides, uncorrelated with the rest.
    """
    n = values.shape[0]
    taken = np.zeros(SIZE, np.bool_)
    forced = np.zeros(SIZE, np.bool_)
    for i in range(n):
        taken[first + i] = mask[i]
    if two_d:
        for i in off_plane:
            taken[i] = forced[i] = True
    k = 0
    for i in range(SIZE):
        k += taken[i]
    indices, z, R = np.empty(k, np.int64), np.zeros(k), np.zeros((k, k))
    a = 0
    for i in range(SIZE):
        if taken[i]:
            indices[a] = i
            a += 1
    correlated, sane = False, True
    for a in range(k):
        i = indices[a]
        if forced[i]:
            R[a, a] = off_plane_variance
            continue
        z[a] = values[i - first]
        sane = sane and fabs(z[a]) < largest_value
        for b in range(k):
            j = indices[b]
            if not forced[j]:
                R[a, b] = 0.5 * (covariance[i - first, j - first] + covariance[j - first, i - first])
                correlated = correlated or (a != b and R[a, b] != 0.0)
    return indices, z, R, not correlated or cholesky(R, np.zeros((k, k))), k - forced.sum(), sane


def warm() -> None:
    """Compile (or load from the cache) everything."""
    mask = np.ones(6, dtype=bool)
    sound(np.zeros(6), np.eye(6), mask, 1e12, 1e15)
    turn(np.eye(3), mask, np.eye(6))
    measured(0, np.zeros(6), np.eye(6), mask, True, (2, 3), 1e-6, 1e12)
