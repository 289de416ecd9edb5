"""Joins of two poses: turn, straight, turn; or arc, straight, arc on circles of a radius (L. E. Dubins, "On curves of
minimal length with a constraint on average curvature", American Journal of Mathematics 79, 1957; formulas of Shkel and
Lumelsky, Robotics and Autonomous Systems 34, 2001), ahead or astern.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap


@kernel
def joins_of(radii: np.ndarray) -> int:
    """How many joins of two poses there are with arcs of these radii (n,), m."""
    return 2 + 8 * len(radii)


@kernel
def dubins_join(number: int, start: np.ndarray, end: np.ndarray, radii: np.ndarray, moves: np.ndarray) -> bool:
    """Put the three moves (3, 2), length m and turn rad, of join `number` of two poses (3,), m, rad, into `moves`;
    False where there is none. 0 and 1: turn, straight, turn; even numbers are driven ahead, odd ones astern.
    """
    sense = -1.0 if number % 2 else 1.0
    dx, dy = end[0] - start[0], end[1] - start[1]
    distance, bearing = math.hypot(dx, dy), math.atan2(dy, dx)
    flip = math.pi if sense < 0.0 else 0.0
    moves[:] = 0.0
    if number < 2:
        if distance < 1e-6:
            moves[0, 1] = wrap(end[2] - start[2])
            return True
        heading = bearing + flip
        moves[0, 1], moves[1, 0], moves[2, 1] = wrap(heading - start[2]), sense * distance, wrap(end[2] - heading)
        return True
    radius = radii[(number - 2) // 8]
    first, straight, last = _dubins(
        ((number - 2) // 2) % 4, distance / radius, start[2] + flip - bearing, end[2] + flip - bearing
    )
    if straight < 0.0:
        return False
    moves[0, 0], moves[0, 1] = sense * abs(first) * radius, first
    moves[1, 0] = sense * straight * radius
    moves[2, 0], moves[2, 1] = sense * abs(last) * radius, last
    return True


@kernel
def _dubins(word, d, a, b):
    """(first turn, straight in radii, last turn), rad to the left, of LSL, RSR, LSR or RSL; straight < 0: none. d:
    distance in radii; a, b: yaw at start and end from the line between them.
    """
    sa, ca, sb, cb = math.sin(a), math.cos(a), math.sin(b), math.cos(b)
    first, last = 1.0 if word == 0 or word == 2 else -1.0, 1.0 if word == 0 or word == 3 else -1.0
    cross = d * (first * sa - last * sb)
    square = d * d + 2.0 * (1.0 - math.cos(a - b) if first == last else math.cos(a - b) - 1.0) + 2.0 * cross
    if square < 0.0:
        return 0.0, -1.0, 0.0
    p = math.sqrt(square)
    along, across = d + first * sa - last * sb, last * cb - first * ca
    direction = math.atan2(across, along)
    if first != last:
        direction -= math.atan2(-2.0 * first, p)
    return first * _mod(first * (direction - a)), p, last * _mod(last * (b - direction))


@kernel
def _mod(angle):
    angle %= 2.0 * math.pi
    return 0.0 if angle > 2.0 * math.pi - 1e-7 else angle


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    pose, radii = np.zeros(3), np.ones(1)
    joins_of(radii)
    dubins_join(2, pose, pose, radii, np.zeros((3, 2)))
