"""What all samples are driven on: how a trajectory begins and goes on, and the outline on the costmap along it."""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids.grid import Grid
from sara_nav.grids.outline import SLACK, UNKNOWN, Around, Placed, highest_around, is_below, outline_above, points_along

STRETCH = 5
"""Cells: the outline is drawn only where a cost higher than the trajectory's lies within so many of it."""


class State(NamedTuple):
    """Where a robot is (m, rad, costmap's frame), and how fast (m/s, rad/s)."""

    x: float
    y: float
    yaw: float
    v: float
    w: float


class Simulation(NamedTuple):
    """How far a trajectory goes (s), how far (m, rad) from step to step, and how fast speeds change (m/s2, rad/s2)."""

    time: float
    granularity: float
    angular_granularity: float
    acc_lim_x: float
    acc_lim_theta: float


class Terrain(NamedTuple):
    """A costmap and the footprint that is laid on it."""

    costs: np.ndarray
    """uint8 (h, w)."""
    grid: Grid
    corners: np.ndarray
    """(k, 2) m, robot's frame."""
    ceiling: np.ndarray
    """Of outline.cost_ceiling."""
    grace: float
    """Seconds from the start on in which the outline may touch something, for a robot that does so already."""


class Drawing(NamedTuple):
    """Where an outline need not be drawn: see outline.is_below."""

    around: Around
    points: np.ndarray
    grown: float
    """The largest scale of the footprint for which the points are close enough together."""


@kernel
def towards(wanted: float, present: float, acceleration: float, dt: float) -> float:
    """Return the speed after dt (s) when accelerating from ``present`` to ``wanted``."""
    if wanted >= present:
        return min(wanted, present + acceleration * dt)
    return max(wanted, present - acceleration * dt)


@kernel
def both_towards(
    sample: tuple[float, float], v: float, w: float, simulation: Simulation, dt: float
) -> tuple[float, float]:
    """Return the speeds (v, w) after dt (s) on their way to those of a sample."""
    return towards(sample[0], v, simulation.acc_lim_x, dt), towards(sample[1], w, simulation.acc_lim_theta, dt)


@kernel
def drawing_of(terrain: Terrain, grown: float) -> Drawing:
    """Return the Drawing for a footprint that grows to at most a scale."""
    around = Around(highest_around(terrain.costs, STRETCH), STRETCH)
    spacing = 2.0 * (STRETCH - SLACK) * terrain.grid.resolution / grown
    return Drawing(around, points_along(terrain.corners, spacing), grown)


@kernel
def highest_met(terrain: Terrain, drawing: Drawing, floor: int, above: int, placed: Placed) -> int:
    """Return the highest cost on a placed outline, ``floor`` at least; negative where it touches something or is off
    the map.

    above: the ceiling at the robot's cell; no more than the floor need not be asked for.
    """
    near = above != UNKNOWN and placed.scale <= drawing.grown
    if near and is_below(drawing.around, floor, terrain.grid, drawing.points, placed):
        return floor
    return outline_above(terrain.costs, drawing.around, floor, terrain.grid, terrain.corners, placed)


@kernel
def room_of(state: State, samples: np.ndarray, sim_time: float, ahead: float) -> tuple[float, float, float, float]:
    """Return low x, low y, high x, high y (m) of what trajectories, and the points ``ahead`` (m) of them, stay within.

    No speed is beyond those that they begin at and go to, nor is the heading further from the present one than the
    fastest turn takes it.
    """
    back, forth, turn = min(state.v, 0.0), max(state.v, 0.0), abs(state.w)
    for i in range(len(samples)):
        back, forth, turn = min(back, samples[i, 0]), max(forth, samples[i, 0]), max(turn, abs(samples[i, 1]))
    back, forth, turn = sim_time * back, sim_time * forth, sim_time * turn
    low_x, high_x = _span(state.yaw, turn, back, forth, ahead)
    low_y, high_y = _span(state.yaw - 0.5 * math.pi, turn, back, forth, ahead)
    return state.x + low_x, state.y + low_y, state.x + high_x, state.y + high_y


@kernel
def _span(heading, turn, back, forth, ahead):
    """Return how far (m) it goes along an axis, down and up: ways from ``back`` to ``forth``, headings (rad, from the
    axis) by up to ``turn`` off.
    """
    a, b = heading - turn, heading + turn
    least, most = min(math.cos(a), math.cos(b)), max(math.cos(a), math.cos(b))
    if math.floor(a / (2.0 * math.pi)) != math.floor(b / (2.0 * math.pi)):
        most = 1.0
    if math.floor((a - math.pi) / (2.0 * math.pi)) != math.floor((b - math.pi) / (2.0 * math.pi)):
        least = -1.0
    return (
        min(forth * least, back * most, 0.0) + min(ahead * least, ahead * most, 0.0),
        max(forth * most, back * least, 0.0) + max(ahead * most, ahead * least, 0.0),
    )


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    room_of(State(2.0, 2.0, 0.0, 0.0, 0.0), np.zeros((1, 2)), 1.0, 0.0)
    towards(0.0, 0.0, 1.0, 0.1)
