"""How a body moves in space when its velocities turn with it: the 3D constant-acceleration model of robot_localization.

With R(roll, pitch, yaw) the body's rotation in the world, E the Euler-rate matrix, u = v dt + a dt2/2:

    p'     = p + R u angles' = angles + E w dt,   E = [[1, sin r tan p, cos r tan p], [0, cos r, -sin r], [0, sin r /
    cos p, cos r / cos p]] v' = v + a dt;   w' = w;   a' = a

What a state holds beyond the 15 variables (the biases of gyros) stays as it is. Angles are not wrapped here. Method:
T. Moore, D. Stouch, "A Generalized Extended Kalman Filter Implementation for the Robot Operating System", 2014 (the
model); the Jacobian is derived here and tested against finite differences. Compiled by numba and cached on disk.
"""

from __future__ import annotations

from math import copysign, cos, sin

import numpy as np

from ahead_of_time import kernel
from sara_localization.filters.state import SIZE

# With the nose straight up the Euler rates are singular: the cosine is kept off zero so that nothing becomes infinite.
_SMALLEST_COSINE = 1e-9


@kernel
def advance(x: np.ndarray, dt: float) -> None:
    """Move the state (n,), n >= 15, dt seconds on, in place."""
    sr, cr, sp, cp, sy, cy = sin(x[3]), cos(x[3]), sin(x[4]), cos(x[4]), sin(x[5]), cos(x[5])
    if abs(cp) < _SMALLEST_COSINE:
        cp = copysign(_SMALLEST_COSINE, cp)
    half = 0.5 * dt * dt
    ux, uy, uz = x[6] * dt + x[12] * half, x[7] * dt + x[13] * half, x[8] * dt + x[14] * half
    x[0] += cy * cp * ux + (cy * sp * sr - sy * cr) * uy + (cy * sp * cr + sy * sr) * uz
    x[1] += sy * cp * ux + (sy * sp * sr + cy * cr) * uy + (sy * sp * cr - cy * sr) * uz
    x[2] += -sp * ux + cp * sr * uy + cp * cr * uz
    across, lifted = cr * x[10] - sr * x[11], sr * x[10] + cr * x[11]
    x[3] += (x[9] + sp / cp * lifted) * dt
    x[4] += across * dt
    x[5] += lifted / cp * dt
    for i in range(3):
        x[6 + i] += x[12 + i] * dt


@kernel
def jacobian(x: np.ndarray, dt: float) -> np.ndarray:
    """The Jacobian F (15, 15) of `advance` at x."""
    sr, cr, sp, cp, sy, cy = sin(x[3]), cos(x[3]), sin(x[4]), cos(x[4]), sin(x[5]), cos(x[5])
    if abs(cp) < _SMALLEST_COSINE:
        cp = copysign(_SMALLEST_COSINE, cp)
    tp = sp / cp
    half = 0.5 * dt * dt
    r00, r01, r02 = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    r10, r11, r12 = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    r20, r21, r22 = -sp, cp * sr, cp * cr
    ux, uy, uz = x[6] * dt + x[12] * half, x[7] * dt + x[13] * half, x[8] * dt + x[14] * half
    F = np.eye(SIZE)
    # Roll turns u about the body's x axis first, yaw the finished step about the world's z axis.
    F[0, 3], F[1, 3], F[2, 3] = r02 * uy - r01 * uz, r12 * uy - r11 * uz, r22 * uy - r21 * uz
    up = sr * uy + cr * uz
    forward, down = cp * up - sp * ux, cp * ux + sp * up
    F[0, 4], F[1, 4], F[2, 4] = cy * forward, sy * forward, -down
    F[0, 5] = -(r10 * ux + r11 * uy + r12 * uz)
    F[1, 5] = r00 * ux + r01 * uy + r02 * uz
    F[0, 6], F[0, 7], F[0, 8] = r00 * dt, r01 * dt, r02 * dt
    F[1, 6], F[1, 7], F[1, 8] = r10 * dt, r11 * dt, r12 * dt
    F[2, 6], F[2, 7], F[2, 8] = r20 * dt, r21 * dt, r22 * dt
    F[0, 12], F[0, 13], F[0, 14] = r00 * half, r01 * half, r02 * half
    F[1, 12], F[1, 13], F[1, 14] = r10 * half, r11 * half, r12 * half
    F[2, 12], F[2, 13], F[2, 14] = r20 * half, r21 * half, r22 * half
    across, lifted = cr * x[10] - sr * x[11], sr * x[10] + cr * x[11]
    F[3, 3] += tp * across * dt
    F[3, 4] = lifted / (cp * cp) * dt
    F[3, 9], F[3, 10], F[3, 11] = dt, sr * tp * dt, cr * tp * dt
    F[4, 3] = -lifted * dt
    F[4, 10], F[4, 11] = cr * dt, -sr * dt
    F[5, 3] = across / cp * dt
    F[5, 4] = lifted * tp / cp * dt
    F[5, 10], F[5, 11] = sr / cp * dt, cr / cp * dt
    F[6, 12] = F[7, 13] = F[8, 14] = dt
    return F


@kernel
def linearise(x: np.ndarray, dt: float, F: np.ndarray) -> None:
    """Put the Jacobian of `advance` at x (n,) into the upper left of F (n, n)."""
    F[:SIZE, :SIZE] = jacobian(x, dt)


def predict(x: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """The state (15,) dt seconds later, and the Jacobian F (15, 15) of that step at x."""
    following = np.array(x, dtype=float)
    F = jacobian(following, dt)
    advance(following, dt)
    return following, F


def warm() -> None:
    """Compile (or load from the cache) what is called from Python, so that nothing compiles on the move."""
    x = np.zeros(SIZE)
    linearise(x, 0.01, np.eye(SIZE))
    advance(x, 0.01)
