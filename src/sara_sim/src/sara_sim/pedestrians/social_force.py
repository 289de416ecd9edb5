"""The social force model: how a pedestrian accelerates towards where they want to go, and away from whom and what is in
their way.

M. Moussaid, D. Helbing, S. Garnier, A. Johansson, M. Combe, G. Theraulaz, "Experimental study of the behavioural
mechanisms underlying self-organization in human crowds", Proc. R. Soc. B 276 (2009) 2755-2762: the model of D. Helbing
and P. Molnar (Phys. Rev. E 51, 1995), with the law and the parameters that experiments with pairs of people gave, one
of whom stood in some of them. They are fit for doors of 0.8 m, where the walls of 1995 (10 m2/s2 within 0.2 m) hold
everybody back.

The law is of people, whose middles are 2 BESIDE apart where they touch. A chair or a box is met like somebody who
stands BESIDE behind the nearest point of its edge.
"""

from __future__ import annotations

from math import atan2, exp, floor, hypot, inf, sqrt
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_sim.world.rays import cast
from sara_sim.world.world import World

RELAXATION = 0.54  # s, tau
SPEED = 1.29, 0.19  # m/s, mean and standard deviation of the speeds that people like to walk at
FASTEST = 1.3  # times that speed: nobody is pushed faster (Helbing and Molnar 1995)
STRENGTH, REACH = 4.5, 0.35  # A (m/s2), gamma (s): of the interaction
ANGLE, ANGLE_SLOWING = 2.0, 3.0  # n, n': how fast the turn aside, and the slowing down, decline with the angle
FORESIGHT = 2.0  # lambda: weight of the relative velocity (per m/s) beside the direction to the other
SIDE = 0.005  # epsilon, rad: who meets head-on prefers the right
WALL_STRENGTH, WALL_REACH = 3.0, 0.1  # a (m/s2), b (m)
BESIDE = 0.25  # m
FAR = 5.0  # m: others who are farther away do not count
WALL_FAR = 0.6  # m: nor do walls


class Floor(NamedTuple):
    """A map: which cells are occupied, (rows, columns) bool, row 0 lowest; m per cell; (x, y) of the lower left corner,
    m.
    """

    occupied: np.ndarray
    resolution: float
    x: float
    y: float

    @classmethod
    def of(cls, world: World) -> Floor:
        """That of a World."""
        return cls(world.occupied, world.resolution, *world.origin)


@kernel
def nearest_point(x: float, y: float, shape: np.ndarray) -> tuple[float, float]:
    """The point of a shape (x, y, cos, sin, half length, half width; -1: a disc) that is nearest to (x, y), m; from
    inside that place itself.
    """
    dx, dy = x - shape[0], y - shape[1]
    if shape[5] < 0.0:
        far = hypot(dx, dy)
        share = min(shape[4] / far, 1.0) if far > 0.0 else 1.0
        return shape[0] + share * dx, shape[1] + share * dy
    c, s = shape[2], shape[3]
    along = min(max(c * dx + s * dy, -shape[4]), shape[4])
    across = min(max(c * dy - s * dx, -shape[5]), shape[5])
    return shape[0] + c * along - s * across, shape[1] + s * along + c * across


@kernel
def nearest_wall(ground: Floor, x: float, y: float) -> tuple[float, float]:
    """The nearest place (x, y; m) of an occupied cell within WALL_FAR, (inf, inf) without one."""
    size = ground.resolution
    rows, columns = ground.occupied.shape
    reach = int(WALL_FAR / size) + 1
    column, row = int(floor((x - ground.x) / size)), int(floor((y - ground.y) / size))
    nearest, wall_x, wall_y = WALL_FAR * WALL_FAR, inf, inf
    for i in range(max(row - reach, 0), min(row + reach + 1, rows)):
        for j in range(max(column - reach, 0), min(column + reach + 1, columns)):
            if ground.occupied[i, j]:
                left, low = ground.x + j * size, ground.y + i * size
                px, py = min(max(x, left), left + size), min(max(y, low), low + size)
                square = (px - x) * (px - x) + (py - y) * (py - y)
                if square < nearest:
                    nearest, wall_x, wall_y = square, px, py
    return wall_x, wall_y


@kernel
def hidden(ground: Floor, x: float, y: float, to_x: float, to_y: float) -> bool:
    """Whether a wall stands between two places, m."""
    size = ground.resolution
    far = hypot(to_x - x, to_y - y) / size
    angle = atan2(to_y - y, to_x - x)
    return cast(ground.occupied, (x - ground.x) / size, (y - ground.y) / size, angle, far)[0] < far


@kernel
def interaction(away: tuple[float, float], velocity: tuple[float, float]) -> tuple[float, float]:
    """The acceleration (m/s2) that somebody at `away` (m, from the pedestrian) causes; `velocity`: the pedestrian's
    less theirs, m/s.
    """
    far = max(hypot(away[0], away[1]), 1e-6)
    ex, ey = away[0] / far, away[1] / far
    dx, dy = FORESIGHT * velocity[0] + ex, FORESIGHT * velocity[1] + ey
    size = sqrt(dx * dx + dy * dy)
    if size < 1e-6:
        return 0.0, 0.0
    tx, ty = dx / size, dy / size
    reach = REACH * size
    theta = atan2(tx * ey - ty * ex, tx * ex + ty * ey) + SIDE * reach
    strength = STRENGTH * exp(-far / reach)
    slow = strength * exp(-((ANGLE_SLOWING * reach * theta) ** 2))
    turn = strength * exp(-((ANGLE * reach * theta) ** 2)) * (1.0 if theta > 0.0 else -1.0)
    return -slow * tx + turn * ty, -slow * ty - turn * tx


@kernel
def acceleration(
    state: tuple[float, float, float, float], wish: tuple[float, float], others: np.ndarray, ground: Floor
) -> tuple[float, float]:
    """(x, y) m/s2 of a pedestrian.

    `state`: x, y (m), velocity x, y (m/s), map frame. `wish`: the velocity they would like, m/s. `others`: (n, 9), who
    is seen: a shape as in `nearest_point`, its velocity x, y (m/s) and turn (rad/s).
    """
    x, y, vx, vy = state
    ax, ay = (wish[0] - vx) / RELAXATION, (wish[1] - vy) / RELAXATION
    wall_x, wall_y = nearest_wall(ground, x, y)
    if wall_x < inf:
        far = max(hypot(wall_x - x, wall_y - y), 1e-6)
        push = WALL_STRENGTH * exp(-far / WALL_REACH)
        ax, ay = ax - push * (wall_x - x) / far, ay - push * (wall_y - y) / far
    for i in range(others.shape[0]):
        px, py = nearest_point(x, y, others[i, :6])
        far = hypot(px - x, py - y)
        if far > FAR or hidden(ground, x, y, px, py):
            continue
        turn = others[i, 8]
        ux, uy = others[i, 6] - turn * (py - others[i, 1]), others[i, 7] + turn * (px - others[i, 0])
        if far < 1e-6:  # inside: away from the middle
            px, py, far = others[i, 0], others[i, 1], max(hypot(others[i, 0] - x, others[i, 1] - y), 1e-6)
        more = (far + BESIDE) / far
        fx, fy = interaction(((px - x) * more, (py - y) * more), (vx - ux, vy - uy))
        ax, ay = ax + fx, ay + fy
    return ax, ay


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    ground = Floor(np.zeros((2, 2), np.bool_), 1.0, 0.0, 0.0)
    acceleration((0.0, 0.0, 0.0, 0.0), (1.0, 0.0), np.ones((1, 9)), ground)
    nearest_wall(ground, 0.0, 0.0)
    nearest_point(0.0, 0.0, np.ones(6))
    hidden(ground, 0.0, 0.0, 1.0, 1.0)
    interaction((1.0, 0.0), (1.0, 0.0))
