"""Rolling out and scoring every sample of the trajectory planner at once.

The method is trajectory rollout (Gerkey and Konolige 2008) with the costs of base_local_planner: from the present
speed each sample (v, w) is driven to within the acceleration limits for ``sim_time``, the outline is laid on the
costmap at every step, and the distances to path and goal are read at the end. Everything is in the costmap's frame.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.grids.outline import (
    SLACK,
    UNKNOWN,
    Around,
    Placed,
    highest_around,
    is_below,
    line_cost,
    outline_above,
    outline_cost,
    points_along,
)

COLLIDES, NO_WAY = -1.0, -2.0
"""Costs of samples that touch something or leave the map, and of those that end where no way leads to the goal."""
STRETCH = 5
"""Cells: the outline is drawn only where a cost higher than the trajectory's lies within so many of it."""


@kernel
def towards(wanted, present, acceleration, dt):
    """Return the speed after dt (s) when accelerating from ``present`` to ``wanted``."""
    if wanted >= present:
        return min(wanted, present + acceleration * dt)
    return max(wanted, present - acceleration * dt)


@kernel
def heading_error(costs, cells, column, row, x, y, yaw, origin_x, origin_y, resolution):
    """Return how far (rad) the heading is from the furthest plan cell (n, 2) in clear sight, infinite when none is."""
    height, width = costs.shape
    for i in range(len(cells) - 1, -1, -1):
        cost = line_cost(costs, column, row, cells[i, 0], cells[i, 1])
        if 0 <= cost < 253:
            to_x = origin_x + (cells[i, 0] + 0.5) * resolution - x
            to_y = origin_y + (cells[i, 1] + 0.5) * resolution - y
            return abs(wrap(math.atan2(to_y, to_x) - yaw))
    return np.inf


@kernel
def steps_of(v, w, sim_time, granularity, angular_granularity, by_time):
    """Return in how many steps a sample is simulated: each no longer than the granularities, at least one."""
    if by_time:
        steps = sim_time / granularity
    else:
        steps = max(abs(v) * sim_time / granularity, abs(w) * sim_time / angular_granularity)
    return max(int(steps + 0.5), 1)


@kernel
def score(
    costs,
    grid,
    corners,
    ceiling,
    path,
    goal,
    cells,
    state,
    samples,
    acceleration,
    simulation,
    weights,
    attractor,
    heading,
    grace,
):
    """Return (cost (n,), end pose (n, 3)) of samples (n, 2) of v (m/s) and w (rad/s).

    grid: origin x, y (m), resolution. corners (k, 2): footprint. ceiling: of outline.cost_ceiling. path, goal: of
    map_grid.spread. cells (m, 2): the plan's. state: x, y, yaw, v, w. acceleration: of v and w. simulation: time (s),
    granularity (m), angular granularity (rad). weights: of path, goal, occupancy. attractor: (on, x, y): instead of
    the grids, the squared distance (m2) to a point. heading: (on, time at which the heading is scored).
    grace: s from the start on in which the outline may touch something, for a robot that does so already.
    """
    origin_x, origin_y, resolution = grid
    height, width = costs.shape
    n = len(samples)
    result, ends = np.full(n, COLLIDES), np.zeros((n, 3))
    impossible = costs.size
    column = (state[0] - origin_x) / resolution
    row = (state[1] - origin_y) / resolution
    if not (column >= 0.0 and row >= 0.0 and column < width and row < height):
        return result, ends
    start = outline_cost(costs, grid, corners, Placed(1.0, state[0], state[1], math.cos(state[2]), math.sin(state[2])))
    if start < 0 and grace == 0.0:
        return result, ends
    around = Around(highest_around(costs, STRETCH), STRETCH)
    points = points_along(corners, 2.0 * (STRETCH - SLACK) * resolution)
    for i in range(n):
        wanted_v, wanted_w = samples[i, 0], samples[i, 1]
        steps = steps_of(wanted_v, wanted_w, simulation[0], simulation[1], simulation[2], heading[0])
        dt = simulation[0] / steps
        x, y, yaw, v, w = state
        occupancy, path_distance, goal_distance, turned = max(start, 0), 0.0, 0.0, 0.0
        cost = 0.0
        for k in range(steps):
            fx, fy = (x - origin_x) / resolution, (y - origin_y) / resolution
            if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
                cost = COLLIDES
                break
            cx, cy = int(fx), int(fy)
            cosine, sine = math.cos(yaw), math.sin(yaw)
            above = ceiling[cy, cx]
            if (
                k > 0
                and k * dt >= grace
                and above > occupancy
                and (above == UNKNOWN or not is_below(around, occupancy, grid, points, Placed(1.0, x, y, cosine, sine)))
            ):
                hit = outline_above(costs, around, occupancy, grid, corners, Placed(1.0, x, y, cosine, sine))
                if hit < 0:
                    cost = COLLIDES
                    break
                occupancy = hit
            occupancy = max(occupancy, np.int64(costs[cy, cx]))
            if not attractor[0]:
                time = k * dt
                looked_at = heading[1] <= time < heading[1] + dt
                if not heading[0] or looked_at:
                    if heading[0]:
                        turned = heading_error(costs, cells, cx, cy, x, y, yaw, origin_x, origin_y, resolution)
                    path_distance, goal_distance = path[cy, cx], goal[cy, cx]
                    if path_distance >= impossible or goal_distance >= impossible:
                        cost = NO_WAY
                        break
            ends[i, 0], ends[i, 1], ends[i, 2] = x, y, yaw
            v = towards(wanted_v, v, acceleration[0], dt)
            w = towards(wanted_w, w, acceleration[1], dt)
            x += v * cosine * dt
            y += v * sine * dt
            yaw += w * dt
        if cost < 0.0:
            result[i] = cost
            continue
        if attractor[0]:
            goal_distance = (ends[i, 0] - attractor[1]) ** 2 + (ends[i, 1] - attractor[2]) ** 2
        result[i] = (
            weights[0] * path_distance
            + weights[1] * goal_distance
            + weights[2] * occupancy
            + (0.3 * turned if heading[0] else 0.0)
        )
    return result, ends


@kernel
def room_of(state, samples, sim_time, ahead):
    """Return low x, low y, high x, high y (m) of what the trajectories of ``score``, and the points ``ahead`` (m) of
    them, stay within.

    No speed is beyond those that they begin at and go to, nor is the heading further from the present one than the
    fastest turn takes it.
    """
    back, forth, turn = min(state[3], 0.0), max(state[3], 0.0), abs(state[4])
    for i in range(len(samples)):
        back, forth, turn = min(back, samples[i, 0]), max(forth, samples[i, 0]), max(turn, abs(samples[i, 1]))
    back, forth, turn = sim_time * back, sim_time * forth, sim_time * turn
    low_x, high_x = _span(state[2], turn, back, forth, ahead)
    low_y, high_y = _span(state[2] - 0.5 * math.pi, turn, back, forth, ahead)
    return state[0] + low_x, state[1] + low_y, state[0] + high_x, state[1] + high_y


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


@kernel
def roll(state, sample, acceleration, simulation, by_time):
    """Return the poses (steps, 3) of one sample, those that ``score`` looks at; arguments as there."""
    steps = steps_of(sample[0], sample[1], simulation[0], simulation[1], simulation[2], by_time)
    dt = simulation[0] / steps
    x, y, yaw, v, w = state
    poses = np.empty((steps, 3))
    for k in range(steps):
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, yaw
        v = towards(sample[0], v, acceleration[0], dt)
        w = towards(sample[1], w, acceleration[1], dt)
        x += v * math.cos(yaw) * dt
        y += v * math.sin(yaw) * dt
        yaw += w * dt
    return poses


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs, distance = np.zeros((5, 5), np.uint8), np.zeros((5, 5), np.int32)
    state, pair = (2.0, 2.0, 0.0, 0.0, 0.0), (1.0, 1.0)
    score(
        costs,
        (0.0, 0.0, 1.0),
        np.zeros((4, 2)),
        costs,
        distance,
        distance,
        np.zeros((1, 2), np.int64),
        state,
        np.zeros((1, 2)),
        pair,
        (1.0, 1.0, 1.0),
        (1.0, 1.0, 1.0),
        (False, 0.0, 0.0),
        (False, 1.0),
        0.0,
    )
    roll(state, pair, pair, (1.0, 1.0, 1.0), False)
    room_of(state, np.zeros((1, 2)), 1.0, 0.0)
    towards(0.0, 0.0, 1.0, 0.1)
