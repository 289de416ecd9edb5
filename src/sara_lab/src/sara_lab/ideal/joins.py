"""The joins of two poses (dubins.py) that ideal motions are made of: how long they take, and whether they are free."""

from __future__ import annotations

import numpy as np

from ahead_of_time import kernel
from sara_lab.ideal.moves import Limits, Space, after, change, example, passes, seconds_of
from sara_nav.lattice.dubins import joins_of
from sara_nav.lattice.moves import kind_of

RADII = np.array([0.25, 0.5, 0.8, 1.1, 1.6])
"""m, of the arcs."""
JOINS = int(joins_of(RADII))
"""How many joins are tried."""


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
    cost_of(moves, limits, -1, 1.0)
    free_along(moves, space, pose)
