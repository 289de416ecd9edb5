"""The states that a search keeps, and the table that finds the best of a cell."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D


class Tree(NamedTuple):
    """States of a search by number, and the least time of each cell. Arrays have a place for every state, ``keys`` and
    ``best`` one for every slot of an open-addressed hash table.
    """

    x: np.ndarray
    """float64, m."""
    y: np.ndarray
    """float64, m."""
    yaw: np.ndarray
    """float64, rad."""
    length: np.ndarray
    """float64, m of the move that led there."""
    turn: np.ndarray
    """float64, rad of the move that led there."""
    spent: np.ndarray
    """float64, s so far."""
    limit: np.ndarray
    """float64, m: the gap allowed there, see body.move."""
    parent: np.ndarray
    """int32, the state before; -1 for the start."""
    index: np.ndarray
    """int16, heading in FINE_STEPs."""
    kind: np.ndarray
    """int8, kind of the move that led there."""
    keys: np.ndarray
    """int64, the cell of a slot; -1 where it is empty."""
    best: np.ndarray
    """float32, the least s so far in the cell of a slot."""


@kernel
def empty_tree(most: int) -> Tree:
    """Return a Tree with room for what a search of ``most`` expanded states finds; one slot at least stays empty, for
    ``slot_of`` ends there.
    """
    room, size = 6 * most + 16, 1
    while size < max(8 * most, room + 1):
        size *= 2
    return Tree(
        np.empty(room),
        np.empty(room),
        np.empty(room),
        np.empty(room),
        np.empty(room),
        np.empty(room),
        np.empty(room),
        np.empty(room, np.int32),
        np.empty(room, np.int16),
        np.empty(room, np.int8),
        np.full(size, -1, np.int64),
        np.empty(size, np.float32),
    )


@kernel
def put(
    tree: Tree, n: int, pose: Pose2D, run: tuple[float, float], spent: tuple[float, float], origin: tuple[int, int, int]
) -> None:
    """Keep state n: a Pose2D, the move (length m, turn rad) that led there, (s so far, gap allowed), and (the state
    before, heading in FINE_STEPs, kind of the move).
    """
    tree.x[n], tree.y[n], tree.yaw[n] = pose.x, pose.y, pose.yaw
    tree.length[n], tree.turn[n] = run
    tree.spent[n], tree.limit[n] = spent
    tree.parent[n], tree.index[n], tree.kind[n] = origin


@kernel
def slot_of(keys: np.ndarray, key: int) -> int:
    """Return the place of a key in an open-addressed table whose empty places hold -1."""
    mask = np.uint64(len(keys) - 1)
    at = (np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(20)
    at &= mask
    while keys[at] != -1 and keys[at] != key:
        at = (at + np.uint64(1)) & mask
    return at


@kernel
def trace(tree: Tree, last: int) -> np.ndarray:
    """Return the moves (n, 5), x, y, yaw, length, turn, from the start to a state, and as one more row, with no move,
    the state itself.
    """
    n, at = 0, last
    while tree.parent[at] >= 0:
        n += 1
        at = tree.parent[at]
    moves = np.zeros((n + 1, 5))
    moves[n, 0], moves[n, 1], moves[n, 2] = tree.x[last], tree.y[last], tree.yaw[last]
    at = last
    for k in range(n - 1, -1, -1):
        before = tree.parent[at]
        moves[k, 0], moves[k, 1], moves[k, 2] = tree.x[before], tree.y[before], tree.yaw[before]
        moves[k, 3], moves[k, 4] = tree.length[at], tree.turn[at]
        at = before
    return moves


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    tree = empty_tree(1)
    slot_of(tree.keys, 1)
