"""Moves of the body and the time they take: straights, arcs and turns in place, ahead and astern.

A move is (length m, turn rad): no length is a turn in place, no turn a straight, a negative length is driven astern.
Times are those at the limits; what stopping and starting cost is charged where a move follows one of another kind.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.lattice.body import place
from sara_nav.lattice.moves import AHEAD, ASTERN, TURNS, kind_of

STRIDE, TWIST = 0.05, 0.05
"""m, rad between two looks at whether the body is free."""


class Limits(NamedTuple):
    """What a motion keeps to: m/s ahead and astern, rad/s, m/s2 across, m/s2 speeding up and braking, rad/s2."""

    ahead: float
    astern: float
    turn: float
    lateral: float
    acceleration: float
    braking: float
    turn_acceleration: float


class Space(NamedTuple):
    """Where the body is free. `free`: (headings, rows, columns) bool, see BodySpace. `room`: (rows, columns) float32, m
    from the nearest obstacle. `size`, `x`, `y`: m, of a cell, and where the map begins.
    """

    free: np.ndarray
    room: np.ndarray
    size: float
    x: float
    y: float


@kernel
def speed_on(limits: Limits, length: float, turn: float) -> float:
    """m/s at which a straight or an arc may be driven."""
    speed = limits.ahead if length > 0.0 else limits.astern
    bend = abs(turn / length)
    if bend > 1e-9:
        speed = min(speed, limits.turn / bend, math.sqrt(limits.lateral / bend))
    return speed


@kernel
def seconds_of(limits: Limits, length: float, turn: float) -> float:
    """s for a move at the limits, without starting and stopping."""
    return abs(turn) / limits.turn if length == 0.0 else abs(length) / speed_on(limits, length, turn)


@kernel
def change(limits: Limits, before: int, now: int) -> float:
    """s that stopping from a kind of move and starting another costs at full speed; `before` -1: at rest; `now` -1: to
    rest.
    """
    if before == now:
        return 0.0
    cost = 0.0
    if before == TURNS or now == TURNS:
        cost += 0.5 * limits.turn / limits.turn_acceleration
    if before in (AHEAD, ASTERN):
        cost += 0.5 * (limits.ahead if before == AHEAD else limits.astern) / limits.braking
    if now in (AHEAD, ASTERN):
        cost += 0.5 * (limits.ahead if now == AHEAD else limits.astern) / limits.acceleration
    return cost


@kernel
def after(x: float, y: float, yaw: float, length: float, turn: float) -> Pose2D:
    """The pose (m, rad) after a move; its yaw is not wrapped."""
    return place(Pose2D(x, y, yaw), length, turn, 1.0)


@kernel
def fits(space: Space, x: float, y: float, yaw: float) -> bool:
    """Whether the body is free at a pose, to the nearest cell and heading."""
    headings, rows, columns = space.free.shape
    column, row = int(math.floor((x - space.x) / space.size)), int(math.floor((y - space.y) / space.size))
    if not (0 <= row < rows and 0 <= column < columns):
        return False
    return space.free[int(round(yaw * headings / (2.0 * math.pi))) % headings, row, column]


@kernel
def passes(space: Space, x: float, y: float, yaw: float, length: float, turn: float) -> bool:
    """Whether the body is free all along a move from a pose, its beginning apart."""
    looks = max(1, int(math.ceil(max(abs(length) / STRIDE, abs(turn) / TWIST))))
    for k in range(looks, 0, -1):
        at = after(x, y, yaw, length * k / looks, turn * k / looks)
        if not fits(space, at[0], at[1], at[2]):
            return False
    return True


def example() -> tuple[Space, Limits]:
    """A small Space and Limits, for the types."""
    space = Space(np.ones((4, 8, 8), np.bool_), np.ones((8, 8), np.float32), 0.05, 0.0, 0.0)
    return space, Limits(0.8, 0.4, 0.8, 0.4, 0.4, 0.8, 0.8)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    space, limits = example()
    after(0.1, 0.1, 0.0, 0.1, 0.1)
    passes(space, 0.1, 0.1, 0.0, 0.1, 0.1)
    change(limits, -1, kind_of(0.1))
    seconds_of(limits, 0.1, 0.1)
