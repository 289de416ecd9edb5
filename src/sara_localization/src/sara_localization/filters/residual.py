"""What a measurement differs from the state by, and angles brought to [-pi, pi]. Compiled by numba."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap_exact

TAKEN, REJECTED, CORRELATED_BADLY, NOT_FINITE = 0, 1, 2, 3
"""What becomes of a measurement."""


class Measured(NamedTuple):
    """k measured variables for the kernels: indices, extra (k,) int64 (the bias that each holds besides, -1: none), z
    (k,), its covariance R (k, k), and the gate in sigmas.
    """

    indices: np.ndarray
    extra: np.ndarray
    z: np.ndarray
    R: np.ndarray
    gate: float


@kernel
def wrap_angles(x: np.ndarray) -> None:
    """Roll, pitch and yaw of the state brought to [-pi, pi], in place."""
    for i in range(3, 6):
        if isfinite(x[i]):
            x[i] = wrap_exact(x[i])


@kernel
def residual(x: np.ndarray, i: int, b: int, z: float) -> float:
    """z - x_i, or z - x_i - x_b where b is not -1; angles wrapped."""
    y = z - x[i]
    if b >= 0:
        y -= x[b]
    if 3 <= i <= 5 and isfinite(y):
        y = wrap_exact(y)
    return y


@kernel
def innovation(x: np.ndarray, m: Measured) -> np.ndarray:
    """y = z - h x (k,), angles wrapped."""
    y = np.empty(m.z.shape[0])
    for j in range(m.z.shape[0]):
        y[j] = residual(x, m.indices[j], m.extra[j], m.z[j])
    return y
