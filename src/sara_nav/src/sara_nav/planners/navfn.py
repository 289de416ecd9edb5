"""navfn/NavfnROS: the classic global planner of the ROS navigation stack, with its parameters and its potential.

Costs and potential are navfn's (K. Konolige, after Brock and Khatib 1999): a cell of cost c costs 50 + 0.8 c, unknown
cells 253, and the outermost cells of the map are obstacles. Unlike the peer's, plans are never cut short, their points
are at cells' centres instead of their corners, they lead from the robot's exact position to the exact goal,
and their yaw points along the path.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sara_nav.planners import potential_astar
from sara_nav.planners.planning import GLOBAL_PLANNERS
from sara_nav.planners.potential_planner import PotentialPlanner

NEUTRAL, FACTOR, OBSTACLE = 50, 0.8, 254


def step_costs(allow_unknown: bool) -> np.ndarray:
    """Return what driving a cell costs, uint8 (256,) over the costs of a costmap; 254 is impassable."""
    table = np.full(256, OBSTACLE, np.uint8)
    table[:253] = (NEUTRAL + FACTOR * np.arange(253)).astype(np.uint8)
    if allow_unknown:
        table[255] = OBSTACLE - 1
    return table


@dataclass(frozen=True)
class NavfnConfig:
    """Names and defaults of NavfnROS.

    allow_unknown: plan through unknown cells. default_tolerance: how far (m) an unreachable goal may be moved.
    visualize_potential: give out the potential. planner_window_x, planner_window_y: without effect, as in the peer.
    use_astar: search towards the goal instead of all round (the peer's class NavFn has both, NavfnROS Dijkstra alone).
    """

    allow_unknown: bool = True
    default_tolerance: float = 0.0
    visualize_potential: bool = False
    planner_window_x: float = 0.0
    planner_window_y: float = 0.0
    use_astar: bool = False

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return tolerance_faults(self)

    def warnings(self) -> list[str]:
        """Return a list of sentences, one for each value that has no effect."""
        return window_warnings(self)


def window_warnings(config: Any) -> list[str]:
    """Return what to say of a planner window, which neither classic planner has ever heeded."""
    return [
        f'{name} is {getattr(config, name)!r}, which has no effect: the whole map is planned on'
        for name in ('planner_window_x', 'planner_window_y')
        if getattr(config, name)
    ]


def tolerance_faults(config: Any) -> list[str]:
    """Return the faults of the numbers that both classic planners have."""
    return [
        f'{name} is {getattr(config, name)!r}, allowed are numbers of 0 or more'
        for name in ('default_tolerance', 'planner_window_x', 'planner_window_y')
        if not (math.isfinite(getattr(config, name)) and getattr(config, name) >= 0.0)
    ]


@GLOBAL_PLANNERS.register('navfn/NavfnROS')
class NavfnROS(PotentialPlanner):
    """Plans on a Costmap; see the module."""

    config_class = NavfnConfig

    def __init__(self, config: NavfnConfig = NavfnConfig()):
        super().__init__(config)

    def _table(self):
        return step_costs(self.config.allow_unknown), OBSTACLE

    def _spread(self, fields, count, target, obstacle):
        if not self.config.use_astar or target < 0:
            return super()._spread(fields, count, target, obstacle)
        return potential_astar.spread_astar(fields.field(obstacle), fields.blocks[0], count, target, float(NEUTRAL))
