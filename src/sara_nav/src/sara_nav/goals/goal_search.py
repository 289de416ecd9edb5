"""Plans for whoever asks (make_plan): to the goal, or to the nearest place about it that a plan leads to.

The search is the C++ move_base's: growing squares in steps of three cells up to the tolerance, rows from the goal
outwards, below the goal before above it and left before right.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps import costmap as cm
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners.planning import PlanError

MOST_TRIES = 300
MOST_STEPS = 1e6


class GlobalPlanner(Protocol):
    """What plans; one that knows which cells it can reach also has ``explore``."""

    def plan(self, costmap: Costmap, start: Pose2D, goal: Pose2D) -> np.ndarray:
        """Return a plan (n, 3); raises PlanError."""


class GivenUp(Exception):
    """The search was told to stop."""


def places(goal: Pose2D, tolerance: float, geometry: GridGeometry) -> np.ndarray:
    """Return the places (n, 2) on the map (m) that are tried after the goal itself, in their order.

    Steps of three cells each way from the goal, or of ``tolerance`` (m) where that is less; none for a tolerance of 0.
    """
    step = 3.0 * geometry.resolution
    if not tolerance > 0.0:
        return np.empty((0, 2))
    if tolerance < step:
        step = tolerance
    farthest = min(tolerance / step + 1e-6, MOST_STEPS)
    columns, rows = (
        np.arange(max(math.ceil((low - at) / step), -farthest) // 1, min((low + size - at) / step, farthest) // 1 + 1)
        if abs(low - at) / step < 2.0 * MOST_STEPS
        else np.empty(0)
        for at, low, size in zip((goal.x, goal.y), (geometry.origin_x, geometry.origin_y), geometry.size)
    )
    column, row = (k.ravel() for k in np.meshgrid(columns, rows))
    ring = np.maximum(abs(column), abs(row))
    order = np.lexsort((column, row, abs(column), abs(row), ring))
    order = order[(ring[order] > 0) & (ring[order] <= farthest)]
    return np.column_stack([goal.x + step * column[order], goal.y + step * row[order]])


def cleared(costmap: Costmap, pose: Pose2D, radius: float) -> Costmap:
    """Return a copy of the Costmap with the square of half side ``radius`` (m) about the pose free."""
    g = costmap.geometry
    low = [
        int(np.clip((v - radius - o) / g.resolution, 0, n))
        for v, o, n in ((pose.x, g.origin_x, g.width), (pose.y, g.origin_y, g.height))
    ]
    high = [
        int(np.clip((v + radius - o) / g.resolution + 1, 0, n))
        for v, o, n in ((pose.x, g.origin_x, g.width), (pose.y, g.origin_y, g.height))
    ]
    costs = costmap.costs.copy()
    costs[low[1] : high[1], low[0] : high[0]] = cm.FREE
    return Costmap(costs, g)


class Nearby(NamedTuple):
    """Which places other than the goal will do: those within ``tolerance`` (m) of it.

    add_unreachable_goal: a plan to another place ends with the asked goal as well. give_up: asked before each try;
    the search ends once it says True.
    """

    tolerance: float = 0.0
    add_unreachable_goal: bool = True
    give_up: Callable[[], bool] = lambda: False


def search_plan(
    planner: GlobalPlanner, costmap: Costmap, start: Pose2D, goal: Pose2D, nearby: Nearby = Nearby()
) -> tuple[np.ndarray | None, str]:
    """Return (plan (n, 3), text): to the goal, or to a place ``nearby``; (None, why) without any. Raises GivenUp.

    Places that the planner knows that it cannot reach are not tried (``explore``); without that knowledge at most
    MOST_TRIES are.
    """
    try:
        return planner.plan(costmap, start, goal), ''
    except PlanError as error:
        problem = str(error)
    tries = 0
    for place in _places(planner, costmap, start, goal, nearby.tolerance):
        if nearby.give_up():
            raise GivenUp
        tries += 1
        if tries > MOST_TRIES:
            return None, f'{problem}; none of {MOST_TRIES} places about it can be reached either'
        try:
            plan = planner.plan(costmap, start, place)
        except PlanError:
            continue
        if nearby.add_unreachable_goal:
            plan = np.vstack([plan, [[goal.x, goal.y, goal.yaw]]])
        return plan, f'no plan leads to the goal ({problem}); this one leads to ({place.x:.2f}, {place.y:.2f})'
    return None, problem


def _places(planner, costmap, start, goal, tolerance):
    """Yield the Pose2Ds about the goal that a plan may lead to."""
    g = costmap.geometry
    if tolerance <= 0.0 or g.to_cell(start.x, start.y) is None:
        return
    reachable = planner.explore(costmap, start) if hasattr(planner, 'explore') else None
    for x, y in places(goal, tolerance, g).tolist():
        cell = g.to_cell(x, y)
        if cell is None or costmap.costs[cell[1], cell[0]] in (cm.INSCRIBED, cm.LETHAL):
            continue  # no planner leads there
        if reachable is None or reachable[cell[1], cell[0]]:
            yield Pose2D(x, y, goal.yaw)
