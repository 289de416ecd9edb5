"""How a body moves in space when its velocities turn with it: the 3D constant-acceleration model of robot_localization.

With R(roll, pitch, yaw) the body's rotation in the world, E the Euler-rate matrix, u = v dt + a dt2/2:

    p'     = p + R u
    angles' = angles + E w dt,   E = [[1, sin r tan p, cos r tan p], [0, cos r, -sin r], [0, sin r / cos p, cos r / cos p]]
    v' = v + a dt;   w' = w;   a' = a

Angles are not wrapped here. Method: T. Moore, D. Stouch, "A Generalized Extended Kalman Filter Implementation for the
Robot Operating System", 2014 (the model); the Jacobian is derived here and tested against finite differences.
"""
from __future__ import annotations

import math
from typing import Tuple

import numpy as np

from .state import AX, AY, AZ, PITCH, ROLL, SIZE, VPITCH, VROLL, VX, VYAW, X, Y, YAW, Z

# With the nose straight up the Euler rates are singular: the cosine is kept off zero so that nothing becomes infinite.
_SMALLEST_COSINE = 1e-9


def predict(x: np.ndarray, dt: float) -> Tuple[np.ndarray, np.ndarray]:
    """The state (15,) dt seconds later, and the Jacobian F (15, 15) of that step at x."""
    _, _, _, roll, pitch, yaw, vx, vy, vz, wx, wy, wz, ax, ay, az = x.tolist()
    sr, cr, sp, cy, sy = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    cp = math.cos(pitch)
    if abs(cp) < _SMALLEST_COSINE:
        cp = math.copysign(_SMALLEST_COSINE, cp)
    tp = sp / cp
    half = 0.5 * dt * dt

    r00, r01, r02 = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    r10, r11, r12 = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    r20, r21, r22 = -sp, cp * sr, cp * cr
    ux, uy, uz = vx * dt + ax * half, vy * dt + ay * half, vz * dt + az * half
    step_x, step_y = r00 * ux + r01 * uy + r02 * uz, r10 * ux + r11 * uy + r12 * uz
    step_z = r20 * ux + r21 * uy + r22 * uz

    following = x.copy()
    following[X] += step_x
    following[Y] += step_y
    following[Z] += step_z
    following[ROLL] += (wx + sr * tp * wy + cr * tp * wz) * dt
    following[PITCH] += (cr * wy - sr * wz) * dt
    following[YAW] += (sr * wy + cr * wz) / cp * dt
    following[VX] += ax * dt
    following[VX + 1] += ay * dt
    following[VX + 2] += az * dt

    F = np.eye(SIZE)
    # Roll turns u about the body's x axis first, yaw the finished step about the world's z axis.
    F[X, ROLL], F[Y, ROLL], F[Z, ROLL] = r02 * uy - r01 * uz, r12 * uy - r11 * uz, r22 * uy - r21 * uz
    lifted = sr * uy + cr * uz
    forward, down = cp * lifted - sp * ux, cp * ux + sp * lifted
    F[X, PITCH], F[Y, PITCH], F[Z, PITCH] = cy * forward, sy * forward, -down
    F[X, YAW], F[Y, YAW] = -step_y, step_x
    R = np.array(((r00, r01, r02), (r10, r11, r12), (r20, r21, r22)))
    F[X:Z + 1, VX:VX + 3] = R * dt
    F[X:Z + 1, AX:AZ + 1] = R * half

    F[ROLL, ROLL] += (cr * tp * wy - sr * tp * wz) * dt
    F[ROLL, PITCH] = (sr * wy + cr * wz) / (cp * cp) * dt
    F[ROLL, VROLL], F[ROLL, VPITCH], F[ROLL, VYAW] = dt, sr * tp * dt, cr * tp * dt
    F[PITCH, ROLL] = -(sr * wy + cr * wz) * dt
    F[PITCH, VPITCH], F[PITCH, VYAW] = cr * dt, -sr * dt
    F[YAW, ROLL] = (cr * wy - sr * wz) / cp * dt
    F[YAW, PITCH] = (sr * wy + cr * wz) * tp / cp * dt
    F[YAW, VPITCH], F[YAW, VYAW] = sr / cp * dt, cr / cp * dt

    F[VX, AX] = F[VX + 1, AY] = F[VX + 2, AZ] = dt
    return following, F
