"""The moves that the search tries, and the cells that its states fall into."""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_nav.lattice.world import Rules

STEP = 2.0 * math.pi / 32.0
"""rad between the headings that turns end on."""
FINE_HEADINGS = 512
FINE_STEP = 2.0 * math.pi / FINE_HEADINGS
"""rad between headings that are told apart where it is tight; elsewhere sixteen times that."""
FAR = 1e9
"""s; as good as no path."""
TURNS, AHEAD, ASTERN = 0, 1, 2
"""Kinds of moves."""


@kernel
def kind_of(length: float) -> int:
    """Return the kind of a move of ``length`` (m)."""
    return TURNS if length == 0.0 else AHEAD if length > 0.0 else ASTERN


@kernel
def key_of(u: float, v: float, heading: int, distance: float, rules: Rules) -> int:
    """Return the number of the cell of a state at column u, row v (not rounded), ``distance`` (m) from an obstacle:
    cells are 0.05, 0.1 or 0.25 m wide by how much room there is. heading: in FINE_STEPs.
    """
    spare = distance - rules.radius
    level = 2 if spare > rules.greatest_gap else 1 if spare > 0.1 else 0
    size = 0.25 if level == 2 else 0.1 if level == 1 else 0.05
    if spare > rules.hard_margin:
        heading = ((heading + 8) // 16) % 32
    share = rules.resolution / size
    return ((np.int64(v * share) * 1000003 + np.int64(u * share)) * FINE_HEADINGS + heading) * 4 + level


@kernel
def option_of(option: int, yaw: float, stride: float) -> tuple[float, float]:
    """Return (length m, turn rad) of one of twenty moves from a yaw (rad): 0 and 1 turns, 2 and 3 straights, 4 to 11
    arcs of about 1 m and 0.5 m radius, 12 to 19 slight arcs of 10 and 20 m. stride: m of the moves ahead.
    """
    if option == 2:
        return stride, 0.0
    if option == 3:
        return -0.2, 0.0
    side = 1 if option % 2 == 0 else -1
    if option >= 12:
        return 0.5 if option < 16 else -0.5, side * (0.05 if option % 4 < 2 else 0.025)
    steps = 2 if option in (6, 7, 10, 11) else 1
    nearest = round(yaw / STEP) * STEP
    turn = nearest - yaw + side * steps * STEP
    if abs(nearest - yaw) > 0.02 and side * (nearest - yaw) > 0.0:
        turn -= side * STEP  # off the lattice's headings: the next one counts as a step
    if option < 2:
        return 0.0, turn
    return (max(0.2, 0.5 * stride) if option < 8 else -0.2), turn


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    option_of(0, 0.0, kind_of(0.0) + 0.2)
