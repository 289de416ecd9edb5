"""Rolling out and scoring every sample of the trajectory planner at once.

The method is trajectory rollout (Gerkey and Konolige 2008) with the costs of base_local_planner: from the present
speed each sample (v, w) is driven to within the acceleration limits for ``sim_time``, the outline is laid on the
costmap at every step, and the distances to path and goal are read at the end. Everything is in the costmap's frame.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.grids.grid import Grid
from sara_nav.grids.outline import Placed, line_cost, outline_cost
from sara_nav.sampled.trajectory import Simulation, State, Terrain, both_towards, drawing_of, highest_met

COLLIDES, NO_WAY = -1.0, -2.0
"""Costs of samples that touch something or leave the map, and of those that end where no way leads to the goal."""
HEADING_WEIGHT = 0.3
"""Cost of a radian that the heading is off, the peer's."""


class Distances(NamedTuple):
    """Distances (cells) to the plan and to its end, int32 (h, w), see map_grid; and the plan's cells (m, 2)."""

    path: np.ndarray
    goal: np.ndarray
    cells: np.ndarray


class Scoring(NamedTuple):
    """What a trajectory costs: weights of the distances to path and goal (per cell) and of the highest cost; see the
    planner's parameters for the rest.
    """

    path: float
    goal: float
    occupancy: float
    simple_attractor: bool
    """The squared distance (m2) to a point stands in for the distances in cells."""
    attractor: tuple
    """x, y of that point (m)."""
    heading_scoring: bool
    heading_time: float
    """At which the heading is looked at (s)."""


@kernel
def heading_error(costs: np.ndarray, grid: Grid, cells: np.ndarray, cell: tuple[int, int], state: State) -> float:
    """Return how far (rad) the heading is from the furthest plan cell (n, 2) in clear sight of the robot's cell
    (column, row), infinite when none is.
    """
    for i in range(len(cells) - 1, -1, -1):
        cost = line_cost(costs, cell[0], cell[1], cells[i, 0], cells[i, 1])
        if 0 <= cost < 253:
            to_x = grid.origin_x + (cells[i, 0] + 0.5) * grid.resolution - state.x
            to_y = grid.origin_y + (cells[i, 1] + 0.5) * grid.resolution - state.y
            return abs(wrap(math.atan2(to_y, to_x) - state.yaw))
    return np.inf


@kernel
def steps_of(sample: tuple[float, float], simulation: Simulation, by_time: bool) -> int:
    """Return in how many steps a sample is simulated: each no longer than the granularities, at least one."""
    if by_time:
        steps = simulation.time / simulation.granularity
    else:
        steps = max(
            abs(sample[0]) * simulation.time / simulation.granularity,
            abs(sample[1]) * simulation.time / simulation.angular_granularity,
        )
    return max(int(steps + 0.5), 1)


@kernel
def score(
    terrain: Terrain, distances: Distances, state: State, samples: np.ndarray, simulation: Simulation, scoring: Scoring
) -> tuple[np.ndarray, np.ndarray]:
    """Return (cost (n,), end pose (n, 3)) of samples (n, 2) of v (m/s) and w (rad/s), driven from a State."""
    grid = terrain.grid
    height, width = terrain.costs.shape
    n = len(samples)
    result, ends = np.full(n, COLLIDES), np.zeros((n, 3))
    column = (state.x - grid.origin_x) / grid.resolution
    row = (state.y - grid.origin_y) / grid.resolution
    if not (column >= 0.0 and row >= 0.0 and column < width and row < height):
        return result, ends
    placed = Placed(1.0, state.x, state.y, math.cos(state.yaw), math.sin(state.yaw))
    start = outline_cost(terrain.costs, grid, terrain.corners, placed)
    if start < 0 and terrain.grace == 0.0:
        return result, ends
    drawing = drawing_of(terrain, 1.0)
    for i in range(n):
        sample = samples[i, 0], samples[i, 1]
        result[i] = _cost(terrain, drawing, distances, (state, sample, simulation), scoring, (max(start, 0), ends[i]))
    return result, ends


@kernel
def _cost(terrain, drawing, distances, drive, scoring, begun):
    """Return the cost of one sample; see score. drive: (State, sample, Simulation). begun: (the outline's cost at the
    start, the end pose (3,), which is written).
    """
    state, sample, simulation = drive
    occupancy, end = begun
    costs, grid, _, ceiling, grace = terrain  # a field that is looked up in each step costs time
    paths, goals, cells = distances
    origin_x, origin_y, resolution = grid
    height, width = costs.shape
    steps = steps_of(sample, simulation, scoring.heading_scoring)
    dt = simulation.time / steps
    x, y, yaw, v, w = state
    impossible = costs.size
    path, goal, turned = 0, 0, 0.0
    for k in range(steps):
        fx, fy = (x - origin_x) / resolution, (y - origin_y) / resolution
        if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
            return COLLIDES
        cx, cy = int(fx), int(fy)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        above = np.int64(ceiling[cy, cx])
        if k > 0 and k * dt >= grace and above > occupancy:
            occupancy = highest_met(terrain, drawing, occupancy, above, Placed(1.0, x, y, cosine, sine))
            if occupancy < 0:
                return COLLIDES
        occupancy = max(occupancy, np.int64(costs[cy, cx]))
        if _is_read(scoring, k * dt, dt):
            path, goal = paths[cy, cx], goals[cy, cx]
            if path >= impossible or goal >= impossible:
                return NO_WAY
            if scoring.heading_scoring:
                turned = heading_error(costs, grid, cells, (cx, cy), State(x, y, yaw, v, w))
        end[0], end[1], end[2] = x, y, yaw
        v, w = both_towards(sample, v, w, simulation, dt)
        x += v * cosine * dt
        y += v * sine * dt
        yaw += w * dt
    return _total(scoring, (path, goal, turned), occupancy, end)


@kernel
def _is_read(scoring, time, dt):
    """Whether the distances are read at a step's time (s): with heading_scoring only once."""
    if scoring.simple_attractor:
        return False
    return not scoring.heading_scoring or scoring.heading_time <= time < scoring.heading_time + dt


@kernel
def _total(scoring, read, occupancy, end):
    """Return the cost of a trajectory of what was read of it."""
    path, goal, turned = float(read[0]), float(read[1]), read[2]
    if scoring.simple_attractor:
        goal = (end[0] - scoring.attractor[0]) ** 2 + (end[1] - scoring.attractor[1]) ** 2
    total = scoring.path * path + scoring.goal * goal + scoring.occupancy * occupancy
    return total + (HEADING_WEIGHT * turned if scoring.heading_scoring else 0.0)


@kernel
def roll(state: State, sample: tuple[float, float], simulation: Simulation, by_time: bool) -> np.ndarray:
    """Return the poses (steps, 3) of one sample, those that ``score`` looks at; arguments as there."""
    steps = steps_of(sample, simulation, by_time)
    dt = simulation.time / steps
    x, y, yaw, v, w = state
    poses = np.empty((steps, 3))
    for k in range(steps):
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, yaw
        v, w = both_towards(sample, v, w, simulation, dt)
        x += v * math.cos(yaw) * dt
        y += v * math.sin(yaw) * dt
        yaw += w * dt
    return poses


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs, distance = np.zeros((5, 5), np.uint8), np.zeros((5, 5), np.int32)
    state, pair = State(2.0, 2.0, 0.0, 0.0, 0.0), (1.0, 1.0)
    simulation = Simulation(1.0, 1.0, 1.0, 1.0, 1.0)
    terrain = Terrain(costs, Grid(0.0, 0.0, 1.0), np.zeros((4, 2)), costs, 0.0)
    distances = Distances(distance, distance, np.zeros((1, 2), np.int64))
    score(terrain, distances, state, np.zeros((1, 2)), simulation, Scoring(1.0, 1.0, 1.0, False, pair, False, 1.0))
    roll(state, pair, simulation, False)
