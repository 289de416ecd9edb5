"""Whether the way that the rider asks for is free: one arc, then straight on; and turns in place."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_control.assist.local_grid import Field, LocalGrid, Outline, field_of, gap, gaps_beside, outline_of, too_near

STEP = 0.07
"""m between two looks at the gap."""
BENDS_FOR = 0.6
"""m for which a stick that is held aside bends the way: it means another direction, not a circle."""
SLIDES = 1e-3
"""m; a body that is nearer to something than the margin may go on as long as the gap shrinks by no more per look."""
TURN_STEP = 0.06
"""rad between two looks at the gap of a turn in place."""


class Wish(NamedTuple):
    """sense: 1.0 ahead, -1.0 astern. curvature: 1/m, turn per way. look: m of way that is looked at."""

    sense: float
    curvature: float
    look: float


class Course(NamedTuple):
    """A way among obstacles: how much of it is free (m), the least gap on it (m), and `too_near` (m) at its begin and
    end.
    """

    free: float
    nearest: float
    too_near: tuple[float, float]


@kernel
def may_go(here: float, before: float, margin: float) -> bool:
    """Whether a body whose gap was `before` may go where it is `here` (m): not nearer than the margin, or hardly nearer
    than it is.
    """
    return here >= margin or here >= before - SLIDES


@kernel
def follow(
    field: Field,
    outline: Outline,
    pose: tuple[float, float, float],
    wish: Wish,
    margin: float,
    beside: tuple[float, float],
) -> Course:
    """The Course of a wish from a pose (m, rad), up to where the body would come nearer than the margin (m). beside: m,
    of its too_near.
    """
    x, y, yaw = pose
    gaps = gaps_beside(field, outline, x, y, yaw)
    before = nearest = min(gaps)
    first = last = too_near(gaps, beside)
    done = 0.0
    while done < wish.look - 1e-9:
        step = min(STEP, wish.look - done)
        turn = wish.curvature * step if done < BENDS_FOR else 0.0
        x, y, yaw = (
            x + wish.sense * step * math.cos(yaw + 0.5 * turn),
            y + wish.sense * step * math.sin(yaw + 0.5 * turn),
            yaw + turn,
        )
        gaps = gaps_beside(field, outline, x, y, yaw)
        here = min(gaps)
        if not may_go(here, before, margin):
            break
        nearest, before, done = min(nearest, here), here, done + step
        last = too_near(gaps, beside)
    return Course(done, nearest, (first, last))


@kernel
def free_turn(field: Field, outline: Outline, pose: tuple[float, float, float], turn: float, margin: float) -> float:
    """How far (rad, 0 or more) of a turn in place (rad) the body comes no nearer to anything than the margin (m)."""
    steps = max(1, int(math.ceil(abs(turn) / TURN_STEP)))
    before = gap(field, outline, pose[0], pose[1], pose[2])
    for k in range(1, steps + 1):
        here = gap(field, outline, pose[0], pose[1], pose[2] + turn * k / steps)
        if here < margin and here < before:
            return abs(turn) * (k - 1) / steps
        before = here
    return abs(turn)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = field_of(LocalGrid(np.zeros((3, 3), bool), 0.1, 0.0, 0.0), 0.2)
    outline, pose = outline_of(1.0, 0.5, 0.1), (0.0, 0.0, 0.0)
    follow(field, outline, pose, Wish(1.0, 0.1, 1.0), 0.1, (0.0, 0.3))
    free_turn(field, outline, pose, 0.5, 0.1)
    may_go(0.1, 0.1, 0.1)
