"""Makes a path of moves faster: its parts are replaced by joins (joins.py), as Bellman's recursion over its poses finds
them best.
"""

from __future__ import annotations

import numpy as np

from ahead_of_time import kernel
from sara_lab.ideal.joins import JOINS, RADII, cost_of, free_along
from sara_lab.ideal.moves import Limits, Space, after, change, example
from sara_nav.lattice.dubins import dubins_join
from sara_nav.lattice.shortcuts import chained, cut

PIECE, TWIST = 0.4, 0.4  # m, rad: longer moves are cut before
WINDOW = 80  # poses that a join may span


@kernel
def shorten(space: Space, limits: Limits, start: np.ndarray, moves: np.ndarray, charge: float) -> np.ndarray:
    """The moves (m, 2) of the fastest chain of joins between poses along moves (n, 2) from a pose (3,)."""
    count = len(moves)
    poses = np.empty((count + 1, 3))
    poses[0] = start
    for k in range(count):
        poses[k + 1, 0], poses[k + 1, 1], poses[k + 1, 2] = after(
            poses[k, 0], poses[k, 1], poses[k, 2], moves[k, 0], moves[k, 1]
        )
    best = np.full((count + 1, 4), np.inf)  # by the kind of the last move; 3: none yet
    source = np.full((count + 1, 4, 3), -1, np.int64)  # pose, kind there, join; join JOINS: the move itself
    best[0, 3] = 0.0
    three, one = np.empty((3, 2)), np.empty((1, 2))
    for i in range(count):
        if best[i].min() == np.inf:
            continue
        one[0] = moves[i]
        _relax(limits, charge, one, best, source, i, i + 1, JOINS)
        for j in range(min(count, i + WINDOW), i, -1):
            for number in range(JOINS):
                if not dubins_join(number, poses[i], poses[j], RADII, three):
                    continue
                if _promising(limits, charge, three, best, i, j) and free_along(three, space, poses[i]):
                    _relax(limits, charge, three, best, source, i, j, number)
    return chained(poses, moves, RADII, source, _last(limits, charge, best[count]))


@kernel
def _total(limits, charge, moves, best, i, kind):
    seconds, last = cost_of(moves, limits, -1 if kind == 3 else kind, charge)
    return best[i, kind] + seconds, 3 if last < 0 else last


@kernel
def _promising(limits, charge, moves, best, i, j):
    for kind in range(4):
        total, last = _total(limits, charge, moves, best, i, kind)
        if total < best[j, last] - 1e-9:
            return True
    return False


@kernel
def _relax(limits, charge, moves, best, source, i, j, number):
    for kind in range(4):
        total, last = _total(limits, charge, moves, best, i, kind)
        if total < best[j, last] - 1e-9:
            best[j, last] = total
            source[j, last, 0], source[j, last, 1], source[j, last, 2] = i, kind, number


@kernel
def _last(limits, charge, best):
    """The kind of the last move with which a path that comes to rest takes least time; best (4,): s until then."""
    kind, least = 0, np.inf
    for last in range(4):
        total = best[last] + charge * change(limits, -1 if last == 3 else last, -1)
        if total < least:
            least, kind = total, last
    return kind


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    space, limits = example()
    shorten(space, limits, np.full(3, 0.2), cut(np.full((2, 2), 0.01), PIECE, TWIST), 1.0)
