"""global_planner/GlobalPlanner: navfn's successor in the ROS navigation stack, with its parameters.

A cell of cost c costs neutral_cost + cost_factor c, never more than lethal_cost - 1; cells of cost lethal_cost - 1 and
more are obstacles. (With the defaults all costs from 67 on cost the same: cost_factor 0.8 keeps navfn's shades.) Unlike
the peer's: there is a plan wherever the wave comes, poses are at cells' centres under old_navfn_behavior too, and the
wave starts from the robot's exact position by the distances to the cells about it. The A* variants are not here:
navfn/NavfnROS with use_astar is.
"""

import math
from dataclasses import dataclass

import numpy as np

from sara_nav.planners import gradient_path, orientation
from sara_nav.planners.navfn import tolerance_faults, window_warnings
from sara_nav.planners.planning import GLOBAL_PLANNERS, plan_from_points
from sara_nav.planners.potential_planner import PotentialPlanner


@dataclass(frozen=True)
class GlobalPlannerConfig:
    """Names and defaults of GlobalPlanner.

    allow_unknown: plan through unknown cells. default_tolerance: how far (m) an unreachable goal may be moved.
    use_quadratic: the interpolated wave, else cost adds up from side to side. use_grid_path: the plan goes from cell to
    cell, else down the gradient. old_navfn_behavior: the wave starts from the robot's cell, not its exact position.
    outline_map: the outermost cells of the map are obstacles. publish_potential: give out the potential, as values from
    0 at the robot to publish_scale where it is greatest. orientation_mode, orientation_window_size: see orientation.py.
    planner_window_x, _y: without effect, as in the peer.
    """

    allow_unknown: bool = True
    default_tolerance: float = 0.0
    planner_window_x: float = 0.0
    planner_window_y: float = 0.0
    use_dijkstra: bool = True
    use_quadratic: bool = True
    use_grid_path: bool = False
    old_navfn_behavior: bool = False
    publish_scale: int = 100
    outline_map: bool = True
    lethal_cost: int = 253
    neutral_cost: int = 50
    cost_factor: float = 3.0
    publish_potential: bool = True
    orientation_mode: int = 1
    orientation_window_size: int = 1

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = tolerance_faults(self)
        for name, low, high in (
            ('lethal_cost', 1, 255),
            ('neutral_cost', 1, 255),
            ('orientation_mode', 0, 6),
            ('orientation_window_size', 1, 255),
            ('publish_scale', 1, 100),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                result.append(f'{name} is {value!r}, allowed are whole numbers from {low} to {high}')
        if not 0.01 <= self.cost_factor <= 5.0:
            result.append(f'cost_factor is {self.cost_factor!r}, allowed are numbers from 0.01 to 5')
        if not self.use_dijkstra:
            result.append('use_dijkstra is False, allowed is True: for A*, use navfn/NavfnROS with use_astar')
        return result

    def warnings(self) -> list[str]:
        """Return a list of sentences, one for each value that has no effect."""
        return window_warnings(self)


@GLOBAL_PLANNERS.register('global_planner/GlobalPlanner')
class GlobalPlanner(PotentialPlanner):
    """Plans on a Costmap; see the module."""

    config_class = GlobalPlannerConfig

    def __init__(self, config: GlobalPlannerConfig = GlobalPlannerConfig()):
        super().__init__(config)

    def _table(self):
        c = self.config
        costs = np.minimum(c.neutral_cost + c.cost_factor * np.arange(256), c.lethal_cost - 1)
        table = np.maximum(costs, 1).astype(np.uint8)
        obstacle = max(c.lethal_cost, 2)
        table[c.lethal_cost - 1 : 255] = obstacle
        if not c.allow_unknown:
            table[255] = obstacle
        return table, obstacle

    def _sources(self, fields, obstacle, start, first):
        """The robot's cell, or the four cells whose centres are about the robot, by their distance from it."""
        if self.config.old_navfn_behavior:
            yield from super()._sources(fields, obstacle, start, first)
            return
        g = self._geometry
        x, y = (start.x - g.origin_x) / g.resolution - 0.5, (start.y - g.origin_y) / g.resolution - 0.5
        own = fields.index(first)
        side_x, side_y = (1 if x >= first[0] else -1), (fields.width if y >= first[1] else -fields.width)
        dx, dy = abs(x - first[0]), abs(y - first[1])

        def free(n):
            return fields.steps[n] < obstacle

        def at_least(distance, lower):  # by equal cells the descent would not find to the robot's own
            return max(neutral * distance, lower + 0.1 * neutral)

        neutral = self.config.neutral_cost
        seeds = {own: neutral * math.hypot(dx, dy)}
        for side, distance in ((side_x, math.hypot(1.0 - dx, dy)), (side_y, math.hypot(dx, 1.0 - dy))):
            if free(own + side):
                seeds[own + side] = at_least(distance, seeds[own])
        corner = own + side_x + side_y
        if len(seeds) > 1 and free(corner):
            seeds[corner] = at_least(math.hypot(1.0 - dx, 1.0 - dy), min(v for n, v in seeds.items() if n != own))
        yield from seeds.items()

    def _trace(self, start, goal, follow=gradient_path.descend):
        return super()._trace(start, goal, gradient_path.descend_grid if self.config.use_grid_path else follow)

    def _oriented(self, points, start):
        return orientation.orient(
            plan_from_points(points, self.goal_used.yaw)[:, :2],
            start.yaw,
            self.goal_used.yaw,
            self.config.orientation_mode,
            self.config.orientation_window_size,
        )

    def _outline(self):
        return self.config.outline_map

    def _increment(self):
        # The peer's 2 neutral_cost; less than half a usual step would only make more rounds of the same work.
        return max(2.0 * self.config.neutral_cost, 50.0)

    def _quadratic(self):
        return self.config.use_quadratic
