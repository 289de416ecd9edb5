"""What a measurement differs from the state by, and angles brought to [-pi, pi]. Compiled by numba."""

from __future__ import annotations

from math import isfinite

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap_exact

TAKEN, REJECTED, CORRELATED_BADLY, NOT_FINITE = 0, 1, 2, 3
"""What becomes of a measurement."""


@kernel
def wrap_angles(x):
    """Roll, pitch and yaw of the state brought to [-pi, pi], in place."""
    for i in range(3, 6):
        if isfinite(x[i]):
            x[i] = wrap_exact(x[i])


@kernel
def residual(x, i, b, z):
    """z - x_i, or z - x_i - x_b where b is not -1; angles wrapped."""
    y = z - x[i]
    if b >= 0:
        y -= x[b]
    if 3 <= i <= 5 and isfinite(y):
        y = wrap_exact(y)
    return y


@kernel
def innovation(x, indices, extra, z):
    """y = z - h x (k,), angles wrapped."""
    y = np.empty(z.shape[0])
    for j in range(z.shape[0]):
        y[j] = residual(x, indices[j], extra[j], z[j])
    return y
