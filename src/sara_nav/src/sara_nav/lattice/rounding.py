"""Turns between two legs driven one way become arcs, where there is room for them."""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_common.planar import Pose2D
from sara_nav.lattice.body import BEND, move
from sara_nav.lattice.world import World, example_world

RADII = (2.0, 1.5, 1.0, 0.75, 0.5)
"""m, of rounded corners; the greatest that fits is taken."""
LEAST_TURN = 1e-3
"""rad; a lesser turn is none."""
GREATEST_TURN = 2.6
"""rad; a corner that turns more is not rounded."""
STRAIGHT_END = 0.3
"""m of the first and of the last leg that are not rounded off."""


@kernel
def rounded(world: World, moves: np.ndarray) -> np.ndarray:
    """Return moves (m, 5) with an arc in place of each turn between two legs one way, where there is room for it.

    moves: (n, 5) without turns in place. A turn of over BEND is rounded only where nothing slows the arc by much.
    """
    n = len(moves)
    result = np.empty((2 * n, 5))
    count = 0
    moves = moves.copy()
    for k in range(n):
        result[count] = moves[k]
        count += 1
        if k == n - 1 or moves[k, 4] != 0.0 or moves[k + 1, 4] != 0.0 or moves[k, 3] * moves[k + 1, 3] <= 0.0:
            continue
        turn = wrap(moves[k + 1, 2] - moves[k, 2])
        if abs(turn) < LEAST_TURN or abs(turn) > GREATEST_TURN:
            continue
        sense = math.copysign(1.0, moves[k, 3])
        # What is left of this leg, and half of the next, but for the ends.
        mine = abs(moves[k, 3]) - (STRAIGHT_END if k == 0 else 0.02)
        other = abs(moves[k + 1, 3]) - STRAIGHT_END if k == n - 2 else 0.5 * abs(moves[k + 1, 3])
        cut, radius = widest_arc(world, moves[k + 1], moves[k, 2], turn, sense, min(mine, other))
        if radius == 0.0:
            continue
        result[count - 1, 3] -= sense * cut
        result[count, 0] = moves[k + 1, 0] - sense * cut * math.cos(moves[k, 2])
        result[count, 1] = moves[k + 1, 1] - sense * cut * math.sin(moves[k, 2])
        result[count, 2], result[count, 3], result[count, 4] = moves[k, 2], sense * radius * abs(turn), turn
        count += 1
        moves[k + 1, 0] += sense * cut * math.cos(moves[k + 1, 2])
        moves[k + 1, 1] += sense * cut * math.sin(moves[k + 1, 2])
        moves[k + 1, 3] -= sense * cut
    return result[:count].copy()


@kernel
def widest_arc(
    world: World, corner: tuple[float, float], yaw: float, turn: float, sense: float, room: float
) -> tuple[float, float]:
    """Return (m cut off either leg, radius m) of the widest arc that rounds a corner; radius 0.0 where none does.

    corner: (x, y, ...) m, where a leg with a yaw (rad) ends in a turn (rad). room: m that may be cut off.
    """
    rules = world.rules
    tangent = math.tan(0.5 * abs(turn))
    for radius in RADII:
        cut = radius * tangent
        if cut > room:
            continue
        x, y = corner[0] - sense * cut * math.cos(yaw), corner[1] - sense * cut * math.sin(yaw)
        length = sense * radius * abs(turn)
        seconds, _ = move(world, Pose2D(x, y, yaw), length, turn, rules.hard_margin)
        if seconds == np.inf:
            continue
        if abs(turn) > BEND and seconds > 1.15 * max(abs(length) / rules.speed, abs(turn) / rules.turn_rate):
            continue
        return cut, radius
    return 0.0, 0.0


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    rounded(example_world(), np.ones((2, 5)))
