"""What the sampling planners publish of a cycle: poses in the global frame and the cost cloud."""

import math

import numpy as np

from sara_nav.grids.collision import LocalWorld
from sara_nav.sampled import map_grid


def to_global(poses: np.ndarray, world: LocalWorld) -> np.ndarray:
    """Return poses (n, 3) of the costmap's frame in the global frame."""
    back = world.offset.inverse()
    c, s = math.cos(back.yaw), math.sin(back.yaw)
    return np.column_stack(
        [back.x + c * poses[:, 0] - s * poses[:, 1], back.y + s * poses[:, 0] + c * poses[:, 1], poses[:, 2] + back.yaw]
    )


def cost_cloud(
    world: LocalWorld, cells: np.ndarray, weights: tuple[float, float, float], under: np.ndarray
) -> np.ndarray:
    """Return what ``cost_cloud`` of a planner says, from the plan's cells (n, 2) and those under the robot (m, 2),
    which are left out.
    """
    g, costs = world.costmap.geometry, world.costmap.costs
    path, goal = map_grid.spread(costs, cells, under), map_grid.spread(costs, cells[-1:], under[:0])
    shown = (path < map_grid.obstacle_distance(costs)) & (costs < map_grid.BLOCKED_FROM)
    shown[under[:, 1], under[:, 0]] = False
    rows, columns = np.nonzero(shown)
    parts = [path[shown].astype(float), goal[shown].astype(float), costs[shown].astype(float)]
    return np.column_stack(
        [
            g.origin_x + (columns + 0.5) * g.resolution,
            g.origin_y + (rows + 0.5) * g.resolution,
            np.zeros(len(rows)),
            *parts,
            sum(w * p for w, p in zip(weights, parts)),
        ]
    )
