"""How far each cell of the local costmap is from the plan, or from where the plan leaves the map.

A wave of 4-connected steps over the cells that are free to the robot's centre, as base_local_planner's MapGrid spreads
it (Marder-Eppstein et al. 2010): cells of cost 253 and more stop it, but for those the robot stands on. Distances are
counted in cells. A cell the wave met as an obstacle holds ``size`` (the number of cells of the map), one it never came
to ``size + 1``.
"""
import numpy as np
from ahead_of_time import kernel

BLOCKED_FROM = 253
UNKNOWN = 255


def obstacle_distance(costs):
    """Return what a distance grid over ``costs`` holds in cells that are obstacles."""
    return costs.size


def unreachable_distance(costs):
    """Return what a distance grid over ``costs`` holds in cells the wave did not come to."""
    return costs.size + 1


@kernel
def spread(costs, seeds, exempt):
    """Return the distances int32, shape of costs, from the nearest of seeds (n, 2) of (column, row).

    exempt (m, 2): cells the wave goes through whatever they cost (those under the robot).
    """
    height, width = costs.shape
    size = height * width
    distance = np.full(size, size + 1, np.int32)
    met = np.zeros(size, np.uint8)
    through = np.zeros(size, np.uint8)
    flat = costs.ravel()
    queue = np.empty(size, np.int32)
    head, tail = 0, 0
    for i in range(len(exempt)):
        through[exempt[i, 1] * width + exempt[i, 0]] = 1
    for i in range(len(seeds)):
        cell = seeds[i, 1] * width + seeds[i, 0]
        if not met[cell]:
            met[cell] = 1
            distance[cell] = 0
            queue[tail] = cell
            tail += 1
    while head < tail:
        cell = queue[head]
        head += 1
        column = cell % width
        step = distance[cell] + 1
        for side in range(4):
            if side == 0:
                if column == 0:
                    continue
                near = cell - 1
            elif side == 1:
                if column == width - 1:
                    continue
                near = cell + 1
            elif side == 2:
                near = cell - width
                if near < 0:
                    continue
            else:
                near = cell + width
                if near >= size:
                    continue
            if met[near]:
                continue
            met[near] = 1
            if flat[near] >= BLOCKED_FROM and not through[near]:
                distance[near] = size
                continue
            distance[near] = step
            queue[tail] = near
            tail += 1
    return distance.reshape(costs.shape)


def adjust_plan_resolution(plan, resolution):
    """Return the plan (n, k) with points put evenly between those further apart than ``resolution`` (m).

    Points put in take every column but x and y from the point that follows them.
    """
    plan = np.asarray(plan, float)
    if len(plan) < 2:
        return plan.copy()
    gap = np.diff(plan[:, :2], axis=0)
    length = np.hypot(*gap.T)
    steps = np.where(length > resolution, np.ceil(length / resolution), 1.0).astype(int)
    segment = np.repeat(np.arange(len(steps)), steps)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(steps) - steps, steps) + 1
    result = plan[1:][segment]
    inner = place < steps[segment]
    share = (place / steps[segment])[:, None]
    result[inner, :2] = (plan[:-1, :2][segment] + share * gap[segment])[inner]
    return np.vstack([plan[:1], result])


def plan_cells(plan, costmap):
    """Return the cells int64 (n, 2) of the plan's first run over known cells of the map, empty when it has none.

    plan (m, 2 or more) in the costmap's frame. The run ends where the plan leaves the map or enters unknown cells:
    its last cell is the local goal.
    """
    g = costmap.geometry
    dense = adjust_plan_resolution(np.asarray(plan, float)[:, :2], g.resolution)
    cells = np.floor((dense - (g.origin_x, g.origin_y)) / g.resolution)
    known = ((cells >= 0) & (cells < (g.width, g.height))).all(axis=1)
    cells = np.where(known[:, None], cells, 0).astype(np.int64)
    known &= costmap.costs[cells[:, 1], cells[:, 0]] != UNKNOWN
    first = int(known.argmax()) if known.any() else len(known)
    later = ~known[first:]
    end = first + (int(later.argmax()) if later.any() else len(later))
    return cells[first:end]


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    cells = np.zeros((1, 2), np.int64)
    spread(np.zeros((3, 3), np.uint8), cells, cells)
