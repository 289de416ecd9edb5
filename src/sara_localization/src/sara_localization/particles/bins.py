"""A histogram of poses in bins of 0.5 m, 0.5 m and 10 deg: how many bins the particles fill, and which belong together.

D. Fox, "Adapting the sample size in particle filters through KLD-sampling", 2003. Compiled by numba.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel

BIN_M, YAW_BINS = 0.5, 36
_HALF = 1 << 24
"""Bins from the origin to the end of the histogram: poses beyond are counted in the last."""
_EMPTY = -1


@kernel(inline='always')
def _clipped(place):
    return int(min(max(math.floor(place / BIN_M), -_HALF), _HALF - 1)) + _HALF


@kernel(inline='always')
def _key(poses, i):
    """The bin of a pose as one number: yaw goes round."""
    turn = int(math.floor((poses[i, 2] + math.pi) * (YAW_BINS / (2.0 * math.pi)))) % YAW_BINS
    return (_clipped(poses[i, 0]) * (2 * _HALF) + _clipped(poses[i, 1])) * 64 + turn


@kernel
def _slot(keys, key):
    """Where a key is in a hash table of open addressing, or the free place for it. len(keys): a power of two."""
    mask = len(keys) - 1
    mixed = (key ^ (key >> 29)) * 0x9E3779B1
    at = (mixed ^ (mixed >> 17)) & mask
    while keys[at] != _EMPTY and keys[at] != key:
        at = (at + 1) & mask
    return at


@kernel
def _table_size(n):
    size = 16
    while size < 2 * n:
        size *= 2
    return size


@kernel
def wanted_samples(bins: int, error: float, quantile: float) -> float:
    """Fox's number of samples for so many filled bins: with the probability of the normal `quantile` the
    Kullback-Leibler divergence from the true distribution stays below `error`.
    """
    if bins <= 1:
        return 0.0
    k = bins - 1.0
    share = 2.0 / (9.0 * k)
    return math.ceil(k / (2.0 * error) * (1.0 - share + math.sqrt(share) * quantile) ** 3)


@kernel
def enough(poses: np.ndarray, least: int, error: float, quantile: float) -> int:
    """How many of the poses (n, 3), drawn one after the other, are enough for the bins that they fill; at least
    `least`, at most all.
    """
    keys = np.full(_table_size(len(poses)), _EMPTY, np.int64)
    filled = 0
    for i in range(len(poses)):
        key = _key(poses, i)
        at = _slot(keys, key)
        if keys[at] == _EMPTY:
            keys[at] = key
            filled += 1
        if i + 1 >= least and i + 1 >= wanted_samples(filled, error, quantile):
            return i + 1
    return len(poses)


@kernel
def clusters(poses: np.ndarray) -> tuple[np.ndarray, int]:
    """(labels (n,) int64 from 0, how many clusters): poses in the same bin or in bins that touch are together."""
    keys = np.full(_table_size(len(poses)), _EMPTY, np.int64)
    labels = np.full(len(keys), -1, np.int64)
    found = np.empty(len(poses), np.int64)
    for i in range(len(poses)):
        key = _key(poses, i)
        found[i] = _slot(keys, key)
        keys[found[i]] = key
    waiting = np.empty(len(poses), np.int64)
    count = 0
    for i in range(len(poses)):
        if labels[found[i]] >= 0:
            continue
        labels[found[i]] = count
        waiting[0] = found[i]
        depth = 1
        while depth:
            depth -= 1
            depth = _spread(keys, labels, waiting, depth, count)
        count += 1
    for i in range(len(poses)):
        found[i] = labels[found[i]]
    return found, count


@kernel
def _spread(keys, labels, waiting, depth, label):
    """Label the neighbours of the bin at waiting[depth] that have none, and let them wait; returns the new depth."""
    key = keys[waiting[depth]]
    turn, place = key % 64, key // 64
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            for dt in range(-1, 2):
                other = (place + dx * (2 * _HALF) + dy) * 64 + (turn + dt) % YAW_BINS
                at = _slot(keys, other)
                if keys[at] == other and labels[at] < 0:
                    labels[at] = label
                    waiting[depth] = at
                    depth += 1
    return depth


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with from Python."""
    poses = np.zeros((2, 3))
    wanted_samples(2, 0.01, 0.99)
    enough(poses, 1, 0.01, 0.99)
    clusters(poses)
