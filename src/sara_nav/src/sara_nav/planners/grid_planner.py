"""A global planner: A* over the costmap's cells, then pulled straight wherever that costs no more.

The cells give the way round obstacles; pulling it straight (line-of-sight shortcuts weighed by cost, after Ferguson
and Stentz's idea of not being bound to the grid's eight directions) makes straight legs straight.
"""

import math
from dataclasses import dataclass

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps import costmap as cm
from sara_nav.planners import grid_kernels as kernels
from sara_nav.planners.navfn import NavfnConfig, NavfnROS
from sara_nav.planners.planning import GLOBAL_PLANNERS, PlanError, dense_plan, nearest_cell, require_finite


@dataclass(frozen=True)
class GridPlannerConfig:
    """allow_unknown: plan through unknown cells. straighten_slack: how much dearer a straight line may be (share).
    path_spacing: distance of the plan's points (m). default_tolerance: how far (m) an unreachable goal may be moved."""

    allow_unknown: bool = False
    straighten_slack: float = 0.05
    path_spacing: float = 0.05
    default_tolerance: float = 0.0

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = []
        if not 0.0 <= self.straighten_slack <= 1.0:
            result.append(f'straighten_slack is {self.straighten_slack!r}, allowed are numbers from 0 to 1')
        if not 0.005 <= self.path_spacing <= 1.0:
            result.append(f'path_spacing is {self.path_spacing!r}, allowed are numbers from 0.005 to 1')
        if not 0.0 <= self.default_tolerance < math.inf:
            result.append(f'default_tolerance is {self.default_tolerance!r}, allowed are numbers of 0 or more')
        return result


@GLOBAL_PLANNERS.register('sara_nav/GridPlanner')
class GridPlanner:
    """Plans on a Costmap; see the module."""

    config_class = GridPlannerConfig
    WINDOW = 600

    def __init__(self, config: GridPlannerConfig = GridPlannerConfig()):
        self.config = config
        self.goal_used = None
        if config.default_tolerance > 0.0:  # so that its kernels load at the start, not on the move
            self._reach()

    def _reach(self):
        return _Reach(NavfnConfig(allow_unknown=self.config.allow_unknown))

    def explore(self, costmap: cm.Costmap, start: Pose2D) -> np.ndarray:
        """Return which cells, bool (rows, columns), a plan from Pose2D start can lead to; start must be on the map."""
        return self._reach().explore(costmap, start)

    def plan(self, costmap: cm.Costmap, start: Pose2D, goal: Pose2D) -> np.ndarray:
        """Return a plan (n, 3) from Pose2D start to Pose2D goal, both included; raises PlanError.

        A goal that cannot be reached moves to the nearest place that can, within default_tolerance; ``goal_used`` says.
        """
        require_finite(start, goal)
        self.goal_used = goal
        try:
            return self._plan(costmap, start, goal)
        except PlanError:
            if not (self.config.default_tolerance > 0.0 and costmap.geometry.to_cell(start.x, start.y)):
                raise
            g = costmap.geometry
            near = nearest_cell(self.explore(costmap, start), g, goal.x, goal.y, self.config.default_tolerance)
            if near is None:
                raise
        self.goal_used = Pose2D(*g.to_world(*near), goal.yaw)
        return self._plan(costmap, start, self.goal_used)

    def _plan(self, costmap, start, goal):
        g = costmap.geometry
        first, last = g.to_cell(start.x, start.y), g.to_cell(goal.x, goal.y)
        if first is None:
            raise PlanError(f'the robot at ({start.x:.2f}, {start.y:.2f}) is off the map')
        if last is None:
            raise PlanError(f'the goal ({goal.x:.2f}, {goal.y:.2f}) is off the map')
        cost = int(costmap.costs[last[1], last[0]])
        if cost >= cm.INSCRIBED and not (cost == cm.UNKNOWN and self.config.allow_unknown):
            raise PlanError(
                'the goal ({:.2f}, {:.2f}) is {}'.format(
                    goal.x,
                    goal.y,
                    {cm.UNKNOWN: 'in unknown space', cm.LETHAL: 'in an obstacle'}.get(cost, 'too near an obstacle'),
                )
            )
        cells = kernels.astar(costmap.costs, *first, *last, self.config.allow_unknown)
        if len(cells) == 0:
            raise PlanError(
                f'no way leads from ({start.x:.2f}, {start.y:.2f}) to the goal ({goal.x:.2f}, {goal.y:.2f})'
            )
        points = cells + 0.5
        ends = (
            [(p.x - g.origin_x) / g.resolution for p in (start, goal)],
            [(p.y - g.origin_y) / g.resolution for p in (start, goal)],
        )
        if len(points) == 1:
            points = np.repeat(points, 2, axis=0)
        points[0], points[-1] = (ends[0][0], ends[1][0]), (ends[0][1], ends[1][1])
        keep = kernels.shorten(
            costmap.costs, points, self.config.allow_unknown, self.config.straighten_slack, self.WINDOW
        )
        vertices = points[keep] * g.resolution + (g.origin_x, g.origin_y)
        return dense_plan(vertices, goal.yaw, self.config.path_spacing)


class _Reach(NavfnROS):
    """A wave over all the map, its outermost cells too: it comes where this A* comes, which squeezes past no corner."""

    def _outline(self):
        return False
