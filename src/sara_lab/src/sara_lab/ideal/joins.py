"""Joins of two poses: turn, straight, turn; or arc, straight, arc on circles of a radius (L. E. Dubins, "On curves of
minimal length with a constraint on average curvature", American Journal of Mathematics 79, 1957; formulas of Shkel and
Lumelsky, Robotics and Autonomous Systems 34, 2001), ahead or astern.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_lab.ideal.moves import Limits, Space, after, change, example, passes, seconds_of
from sara_nav.lattice.moves import kind_of

RADII = (0.25, 0.5, 0.8, 1.1, 1.6)
"""m, of the arcs."""
JOINS = 2 + 8 * len(RADII)
"""How many ways of joining are tried."""


@kernel
def _mod(angle):
    angle %= 2.0 * math.pi
    return 0.0 if angle > 2.0 * math.pi - 1e-7 else angle


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
def join(number: int, start: np.ndarray, end: np.ndarray, moves: np.ndarray) -> bool:
    """Put the three moves (3, 2) of a way of joining two poses (3,) into `moves`; False where there is none."""
    sense = -1.0 if number % 2 else 1.0
    dx, dy = end[0] - start[0], end[1] - start[1]
    distance, way = math.hypot(dx, dy), math.atan2(dy, dx) + (math.pi if sense < 0.0 else 0.0)
    moves[:] = 0.0
    if number < 2:
        if distance < 1e-6:
            moves[0, 1] = wrap(end[2] - start[2])
            return True
        moves[0, 1], moves[1, 0], moves[2, 1] = wrap(way - start[2]), sense * distance, wrap(end[2] - way)
        return True
    radius = RADII[(number - 2) // 8]
    way = math.atan2(dy, dx)
    flip = math.pi if sense < 0.0 else 0.0
    first, straight, last = _dubins(
        ((number - 2) // 2) % 4, distance / radius, start[2] + flip - way, end[2] + flip - way
    )
    if straight < 0.0:
        return False
    moves[0, 0], moves[0, 1] = sense * abs(first) * radius, first
    moves[1, 0] = sense * straight * radius
    moves[2, 0], moves[2, 1] = sense * abs(last) * radius, last
    return True


@kernel
def cost_of(moves: np.ndarray, limits: Limits, before: int, charge: float) -> tuple[float, int]:
    """(s of moves (n, 2) after one of the kind `before`, kind of the last). `charge`: share of `change` that counts."""
    total = 0.0
    for k in range(len(moves)):
        length, turn = moves[k, 0], moves[k, 1]
        if length == 0.0 and abs(turn) < 1e-9 or length != 0.0 and abs(length) < 1e-9:
            continue
        kind = kind_of(length)
        total += charge * change(limits, before, kind) + seconds_of(limits, length, turn)
        before = kind
    return total, before


@kernel
def free_along(moves: np.ndarray, space: Space, start: np.ndarray) -> bool:
    """Whether the body is free along moves (n, 2) from a pose (3,)."""
    x, y, yaw = start[0], start[1], start[2]
    for k in range(len(moves)):
        if not passes(space, x, y, yaw, moves[k, 0], moves[k, 1]):
            return False
        x, y, yaw = after(x, y, yaw, moves[k, 0], moves[k, 1])
    return True


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    (space, limits), moves, pose = example(), np.zeros((3, 2)), np.zeros(3)
    join(2, pose, pose, moves)
    cost_of(moves, limits, -1, 1.0)
    free_along(moves, space, pose)
