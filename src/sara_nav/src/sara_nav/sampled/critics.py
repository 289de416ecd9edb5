"""The critics of the dynamic window planner, in the order of dwa_local_planner, and the samples they judge.

oscillation bars turning back, obstacle lays the outline (grown with the speed) on the costmap, goal_front and alignment
look at a point ahead of the robot, path and goal at its centre, twirling at the turn rate. A critic's cost is what it
sees at the end of the trajectory (obstacle: the highest on the way); negative: the sample is discarded.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D, wrap
from sara_nav.grids.grid import Grid
from sara_nav.grids.outline import Placed
from sara_nav.sampled.trajectory import Simulation, State, Terrain, both_towards, drawing_of, highest_met

CRITICS = OSCILLATION, OBSTACLE, GOAL_FRONT, ALIGNMENT, PATH, GOAL, TWIRLING = range(7)
NAMES = 'oscillation', 'obstacle', 'goal_front', 'alignment', 'path', 'goal', 'twirling'
UNREACHABLE, IN_OBSTACLE, LOOKS_OFF_MAP, TURNS_BACK, TOUCHES, LEAVES_MAP = -2.0, -3.0, -4.0, -5.0, -6.0, -7.0
"""Costs of discarded samples, the peer's numbers."""


class Distances(NamedTuple):
    """Distances (cells), int32 (h, w), see map_grid: to the plan, to its end, to the point ahead of that."""

    path: np.ndarray
    goal: np.ndarray
    front: np.ndarray


class Rules(NamedTuple):
    """How samples are driven and judged."""

    scaling_speed: float
    """m/s from which on the footprint grows."""
    fastest: float
    """m/s at which it has grown fully."""
    max_scaling_factor: float
    """By what share."""
    forward_point_distance: float
    """m, of the point ahead."""
    accelerating: bool
    """Samples are driven from the present speed to theirs instead of at theirs."""
    sum_scores: bool


@kernel
def judge(
    terrain: Terrain, distances: Distances, state: State, samples: np.ndarray, simulation: Simulation, rules: Rules
) -> tuple[np.ndarray, np.ndarray]:
    """Return (raw costs (n, 7) of the critics but oscillation, speeds driven (n, 2)) of samples (n, 2) of v, w, driven
    from a State by Rules. terrain, simulation: see trajectory.
    """
    n = len(samples)
    drawing = drawing_of(terrain, 1.0 + max(rules.max_scaling_factor, 0.0))
    raw, driven = np.zeros((n, 7)), np.zeros((n, 2))
    for i in range(n):
        sample = samples[i, 0], samples[i, 1]
        first = _first_speeds(sample, state, simulation, rules.accelerating)
        driven[i, 0], driven[i, 1] = first
        _judge(terrain, drawing, distances, (state, sample, first, simulation), rules, raw[i])
        raw[i, TWIRLING] = abs(driven[i, 1])
    return raw, driven


@kernel
def _judge(terrain, drawing, distances, drive, rules, raw):
    """Write the raw costs (7,) of one sample. drive: (State, sample, the speeds it is driven at first, Simulation)."""
    state, sample, (v, w), simulation = drive
    costs, grid, _, ceiling, grace = terrain  # a field that is looked up in each step costs time
    paths, goals, fronts = distances
    origin_x, origin_y, resolution = grid
    height, width = costs.shape
    steps = _steps_of(sample, simulation)
    dt = simulation.time / max(steps, 1)
    x, y, yaw, _, _ = state
    scale = _scale(v, rules)
    size, shift = costs.size, rules.forward_point_distance
    highest, total = 0, 0.0
    for k in range(steps):
        fx, fy = (x - origin_x) / resolution, (y - origin_y) / resolution
        if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
            raw[OBSTACLE] = LEAVES_MAP
            break
        cx, cy = int(fx), int(fy)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        here = np.int64(costs[cy, cx])
        above = np.int64(ceiling[cy, cx])
        floor = 0 if rules.sum_scores else highest
        if k * dt >= grace and above > floor:
            hit = highest_met(terrain, drawing, floor, above, Placed(scale, x, y, cosine, sine))
            if hit < 0:
                raw[OBSTACLE] = TOUCHES
                break
            here = max(here, hit)
        highest = max(highest, here)
        total += here
        raw[PATH], raw[GOAL] = _seen(raw[PATH], paths[cy, cx], size), _seen(raw[GOAL], goals[cy, cx], size)
        _look_ahead(raw, fronts, paths, grid, (x + shift * cosine, y + shift * sine))
        if rules.accelerating:
            v, w = both_towards(sample, v, w, simulation, dt)
        x += v * cosine * dt
        y += v * sine * dt
        yaw += w * dt
    if raw[OBSTACLE] == 0.0:
        raw[OBSTACLE] = total if rules.sum_scores else highest


@kernel
def _look_ahead(raw, fronts, paths, grid, point):
    """Write what the critics see at the point ahead (m) of one more step."""
    height, width = paths.shape
    ax, ay = (point[0] - grid.origin_x) / grid.resolution, (point[1] - grid.origin_y) / grid.resolution
    if not (ax >= 0.0 and ay >= 0.0 and ax < width and ay < height):
        raw[GOAL_FRONT] = raw[ALIGNMENT] = LOOKS_OFF_MAP
    elif raw[ALIGNMENT] >= 0.0:
        raw[GOAL_FRONT], raw[ALIGNMENT] = fronts[int(ay), int(ax)], paths[int(ay), int(ax)]


@kernel
def _steps_of(sample, simulation):
    """Return in how many steps a sample is simulated: each no longer than the granularities."""
    straight = abs(sample[0]) * simulation.time / simulation.granularity
    turned = abs(sample[1]) * simulation.time / simulation.angular_granularity
    return int(math.ceil(max(straight, turned)))


@kernel
def _first_speeds(sample, state, simulation, accelerating):
    """Return the speeds (v, w) that a sample is driven at first."""
    if not accelerating:
        return sample
    dt = simulation.time / max(_steps_of(sample, simulation), 1)
    return both_towards(sample, state.v, state.w, simulation, dt)


@kernel
def _scale(v, rules):
    """Return by what the footprint is multiplied at a speed (m/s)."""
    if abs(v) <= rules.scaling_speed:
        return 1.0
    grown = (abs(v) - rules.scaling_speed) / max(rules.fastest - rules.scaling_speed, 1e-9)
    return 1.0 + rules.max_scaling_factor * grown


@kernel
def _seen(before, distance, size):
    """Return a grid's cost after one more point: once negative, it stays so."""
    if before < 0.0:
        return before
    if distance == size:
        return IN_OBSTACLE
    return UNREACHABLE if distance > size else float(distance)


@kernel
def drive(state: State, sample: tuple[float, float], simulation: Simulation, accelerating: bool) -> np.ndarray:
    """Return the poses (steps, 3) of one sample, those that ``judge`` looks at; arguments as there."""
    steps = _steps_of(sample, simulation)
    poses = np.empty((steps, 3))
    dt = simulation.time / max(steps, 1)
    x, y, yaw, _, _ = state
    v, w = _first_speeds(sample, state, simulation, accelerating)
    for k in range(steps):
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, yaw
        if accelerating:
            v, w = both_towards(sample, v, w, simulation, dt)
        x += v * math.cos(yaw) * dt
        y += v * math.sin(yaw) * dt
        yaw += w * dt
    return poses


def total(raw: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the cost (n,) of samples from the critics' raw costs (n, 7) and weights (7,); negative: discarded.

    A critic of weight 0 has no say, but for obstacle, which discards what touches something at any weight.
    """
    weights = np.asarray(weights, float)
    judging = weights != 0.0
    judging[OBSTACLE] = True
    refused = np.where(judging & (raw < 0.0), raw, 0.0)
    first = (refused < 0.0).argmax(axis=1)
    code = refused[np.arange(len(raw)), first]
    return np.where(code < 0.0, code, np.where(judging, raw, 0.0) @ weights)


class OscillationFlags:
    """Which way the robot may not turn back to: set when forward, or a turn in place, changes its sense; lifted when
    the robot has moved by ``distance`` (m) or turned by ``angle`` (rad)."""

    def __init__(self):
        self._before = [0, 0]
        self._only = [0, 0]
        self._since = None

    def barred(self, driven: np.ndarray) -> np.ndarray:
        """Return whether each of the speeds (n, 2) goes the way that is barred, bool (n,)."""
        return (self._only[0] * driven[:, 0] < 0.0) | (self._only[1] * driven[:, 1] < 0.0)

    def update(self, pose: Pose2D, v: float, w: float, min_vel_trans: float, distance: float, angle: float) -> None:
        """Take note of the speeds chosen at a Pose2D."""
        for i, speed in ((0, v), (1, w if abs(v) <= min_vel_trans else 0.0)):
            sense = (speed > 0.0) - (speed < 0.0)
            if sense and self._before[i] == -sense:
                self._only[i], self._since = sense, pose
            self._before[i] = sense or self._before[i]
        if any(self._only) and (pose.distance(self._since) > distance or abs(wrap(pose.yaw - self._since.yaw)) > angle):
            self.__init__()


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs, distance = np.zeros((5, 5), np.uint8), np.zeros((5, 5), np.int32)
    state, simulation = State(2.0, 2.0, 0.0, 0.0, 0.0), Simulation(1.0, 1.0, 1.0, 1.0, 1.0)
    terrain = Terrain(costs, Grid(0.0, 0.0, 1.0), np.zeros((4, 2)), costs, 0.0)
    distances, rules = Distances(distance, distance, distance), Rules(1.0, 1.0, 1.0, 0.1, False, False)
    judge(terrain, distances, state, np.zeros((1, 2)), simulation, rules)
    drive(state, (1.0, 1.0), simulation, False)
