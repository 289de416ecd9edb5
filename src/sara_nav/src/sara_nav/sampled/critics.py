"""The critics of the dynamic window planner, in the order of dwa_local_planner, and the samples they judge.

oscillation bars turning back, obstacle lays the outline (grown with the speed) on the costmap, goal_front and alignment
look at a point ahead of the robot, path and goal at its centre, twirling at the turn rate. A critic's cost is what it
sees at the end of the trajectory (obstacle: the highest on the way); negative: the sample is discarded.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import wrap
from sara_nav.grids.outline import (
    SLACK,
    UNKNOWN,
    Around,
    Placed,
    highest_around,
    is_below,
    outline_above,
    points_along,
)
from sara_nav.sampled.rollout import STRETCH, towards

CRITICS = OSCILLATION, OBSTACLE, GOAL_FRONT, ALIGNMENT, PATH, GOAL, TWIRLING = range(7)
NAMES = 'oscillation', 'obstacle', 'goal_front', 'alignment', 'path', 'goal', 'twirling'
UNREACHABLE, IN_OBSTACLE, LOOKS_OFF_MAP, TURNS_BACK, TOUCHES, LEAVES_MAP = -2.0, -3.0, -4.0, -5.0, -6.0, -7.0
"""Costs of discarded samples, the peer's numbers."""


@kernel
def judge(
    costs,
    grid,
    corners,
    ceiling,
    path,
    goal,
    front,
    state,
    samples,
    acceleration,
    simulation,
    growth,
    shift,
    accelerating,
    sum_scores,
    grace,
):
    """Return (raw costs (n, 7) of the critics but oscillation, speeds driven (n, 2)) of samples (n, 2) of v, w.

    grid: origin x, y, resolution (m). path, goal, front: of map_grid.spread, front to the point ahead of the goal.
    state: x, y, yaw, v, w in the costmap's frame. simulation: time, granularity, angular granularity. growth: speed
    from which the footprint grows, speed at which it has grown fully, by what share. shift: m, the point ahead.
    accelerating: drive from the present speed to the sample's instead of at it. grace: as for rollout.score.
    """
    origin_x, origin_y, resolution = grid
    height, width = costs.shape
    size = costs.size
    n = len(samples)
    around = Around(highest_around(costs, STRETCH), STRETCH)
    grown = 1.0 + max(growth[2], 0.0)
    points = points_along(corners, 2.0 * (STRETCH - SLACK) * resolution / grown)
    raw, driven = np.zeros((n, 7)), np.zeros((n, 2))
    for i in range(n):
        wanted_v, wanted_w = samples[i, 0], samples[i, 1]
        steps = int(
            math.ceil(max(abs(wanted_v) * simulation[0] / simulation[1], abs(wanted_w) * simulation[0] / simulation[2]))
        )
        dt = simulation[0] / max(steps, 1)
        x, y, yaw, v, w = state
        if accelerating:
            v, w = towards(wanted_v, v, acceleration[0], dt), towards(wanted_w, w, acceleration[1], dt)
        else:
            v, w = wanted_v, wanted_w
        driven[i, 0], driven[i, 1] = v, w
        scale = 1.0
        if abs(v) > growth[0]:
            scale += growth[2] * (abs(v) - growth[0]) / max(growth[1] - growth[0], 1e-9)
        highest, total = 0, 0.0
        for k in range(steps):
            fx, fy = (x - origin_x) / resolution, (y - origin_y) / resolution
            if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
                raw[i, OBSTACLE] = LEAVES_MAP
                break
            cx, cy = int(fx), int(fy)
            cosine, sine = math.cos(yaw), math.sin(yaw)
            here = np.int64(costs[cy, cx])
            above = np.int64(ceiling[cy, cx])
            floor = 0 if sum_scores else highest
            if (
                k * dt >= grace
                and above > floor
                and (
                    above == UNKNOWN
                    or scale > grown
                    or not is_below(around, floor, grid, points, Placed(scale, x, y, cosine, sine))
                )
            ):
                hit = outline_above(costs, around, floor, grid, corners, Placed(scale, x, y, cosine, sine))
                if hit < 0:
                    raw[i, OBSTACLE] = TOUCHES
                    break
                here = max(here, hit)
            highest = max(highest, here)
            total += here
            raw[i, PATH], raw[i, GOAL] = (
                _seen(raw[i, PATH], path[cy, cx], size),
                _seen(raw[i, GOAL], goal[cy, cx], size),
            )
            ax = (x + shift * cosine - origin_x) / resolution
            ay = (y + shift * sine - origin_y) / resolution
            if not (ax >= 0.0 and ay >= 0.0 and ax < width and ay < height):
                raw[i, GOAL_FRONT] = raw[i, ALIGNMENT] = LOOKS_OFF_MAP
            elif raw[i, ALIGNMENT] >= 0.0:
                raw[i, GOAL_FRONT], raw[i, ALIGNMENT] = front[int(ay), int(ax)], path[int(ay), int(ax)]
            if accelerating:
                v, w = towards(wanted_v, v, acceleration[0], dt), towards(wanted_w, w, acceleration[1], dt)
            x += v * cosine * dt
            y += v * sine * dt
            yaw += w * dt
        if raw[i, OBSTACLE] == 0.0:
            raw[i, OBSTACLE] = total if sum_scores else highest
        raw[i, TWIRLING] = abs(driven[i, 1])
    return raw, driven


@kernel
def _seen(before, distance, size):
    """Return a grid's cost after one more point: once negative, it stays so."""
    if before < 0.0:
        return before
    if distance == size:
        return IN_OBSTACLE
    return UNREACHABLE if distance > size else float(distance)


@kernel
def drive(state, sample, acceleration, simulation, accelerating):
    """Return the poses (steps, 3) of one sample, those that ``judge`` looks at; arguments as there."""
    steps = int(
        math.ceil(max(abs(sample[0]) * simulation[0] / simulation[1], abs(sample[1]) * simulation[0] / simulation[2]))
    )
    poses = np.empty((steps, 3))
    dt = simulation[0] / max(steps, 1)
    x, y, yaw, v, w = state
    v, w = (
        (towards(sample[0], v, acceleration[0], dt), towards(sample[1], w, acceleration[1], dt))
        if accelerating
        else (sample[0], sample[1])
    )
    for k in range(steps):
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, yaw
        if accelerating:
            v, w = towards(sample[0], v, acceleration[0], dt), towards(sample[1], w, acceleration[1], dt)
        x += v * math.cos(yaw) * dt
        y += v * math.sin(yaw) * dt
        yaw += w * dt
    return poses


def total(raw, weights):
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

    def barred(self, driven):
        """Return whether each of the speeds (n, 2) goes the way that is barred, bool (n,)."""
        return (self._only[0] * driven[:, 0] < 0.0) | (self._only[1] * driven[:, 1] < 0.0)

    def update(self, pose, v, w, min_vel_trans, distance, angle):
        """Take note of the speeds chosen at a Pose2D."""
        for i, speed in ((0, v), (1, w if abs(v) <= min_vel_trans else 0.0)):
            sense = (speed > 0.0) - (speed < 0.0)
            if sense and self._before[i] == -sense:
                self._only[i], self._since = sense, pose
            self._before[i] = sense or self._before[i]
        if any(self._only) and (pose.distance(self._since) > distance or abs(wrap(pose.yaw - self._since.yaw)) > angle):
            self.__init__()


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs, distance = np.zeros((5, 5), np.uint8), np.zeros((5, 5), np.int32)
    state, pair, triple = (2.0, 2.0, 0.0, 0.0, 0.0), (1.0, 1.0), (1.0, 1.0, 1.0)
    judge(
        costs,
        (0.0, 0.0, 1.0),
        np.zeros((4, 2)),
        costs,
        distance,
        distance,
        distance,
        state,
        np.zeros((1, 2)),
        pair,
        triple,
        triple,
        0.1,
        False,
        False,
        0.0,
    )
    drive(state, pair, pair, triple, False)
