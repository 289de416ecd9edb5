"""What straightening knows of the arrivals at each place of a path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel

OWN, ANY = 0, 1
"""Arrivals: with the path's own yaw, with whichever."""


class Arrivals(NamedTuple):
    """What is known of the arrivals at each place, (n, 2): OWN and ANY."""

    cost: np.ndarray
    """float64, s so far; inf where there is none."""
    yaw: np.ndarray
    """float64, rad on arrival."""
    limit: np.ndarray
    """float64, m: the gap allowed there, see body.move."""
    kind: np.ndarray
    """int8, kind of the last drive; see moves.py."""
    parent: np.ndarray
    """int32, the place before."""
    label: np.ndarray
    """int8, which of its arrivals; -1 where the path's own move leads here."""
    first: np.ndarray
    """float64, rad turned at the place before."""
    run: np.ndarray
    """float64, m of the leg, negative astern."""
    second: np.ndarray
    """float64, rad turned on arrival."""


@kernel
def no_arrivals(n: int) -> Arrivals:
    """Return Arrivals at n places, none of which is reached."""
    return Arrivals(
        np.full((n, 2), np.inf),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 2), np.int8),
        np.full((n, 2), -1, np.int32),
        np.zeros((n, 2), np.int8),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
    )


@kernel
def enter(
    known: Arrivals, j: int, arrival: int, origin: tuple[int, int, int], motion: tuple[float, float, float]
) -> None:
    """Note how place j was arrived at: (the place before, which of its arrivals, kind of drive) and (turn rad, leg m,
    turn on arrival rad).
    """
    known.parent[j, arrival], known.label[j, arrival], known.kind[j, arrival] = origin
    known.first[j, arrival], known.run[j, arrival], known.second[j, arrival] = motion


@kernel
def trace(poses: np.ndarray, moves: np.ndarray, known: Arrivals) -> np.ndarray:
    """Return the moves (m, 5), x, y, yaw, length, turn, that lead to the last of poses (n, 3); none when nothing does.

    moves: (n, 2), the path's own from each pose.
    """
    n = len(poses)
    if known.cost[n - 1, OWN] == np.inf:
        return np.empty((0, 5))
    steps = np.empty((3 * n, 5))
    m = 3 * n
    j, own = n - 1, OWN
    while j > 0:
        i, was = known.parent[j, own], known.label[j, own]
        if was < 0:
            m -= 1
            steps[m] = np.array([poses[i, 0], poses[i, 1], poses[i, 2], moves[i, 0], moves[i, 1]])
            j, own = i, OWN
            continue
        start = known.yaw[i, was]
        heading = start + known.first[j, own]
        if known.second[j, own] != 0.0:
            m -= 1
            steps[m] = np.array([poses[j, 0], poses[j, 1], heading, 0.0, known.second[j, own]])
        m -= 1
        steps[m] = np.array([poses[i, 0], poses[i, 1], heading, known.run[j, own], 0.0])
        if known.first[j, own] != 0.0:
            m -= 1
            steps[m] = np.array([poses[i, 0], poses[i, 1], start, 0.0, known.first[j, own]])
        j, own = i, was
    return steps[m:].copy()


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    no_arrivals(1)
