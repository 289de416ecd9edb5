"""Plans for the goal that is driven to: when another is due, on the global costmap as it is, by whichever global
planner there is.

Patience and periods are those of the C++ move_base; that a plan is made anew as soon as something new stands on it is
ours (replan_when_blocked), and that it is where it took so long that the robot is no more where it begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sara_common.planar import Pose2D, is_apart
from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.goals.goal import Goal
from sara_nav.goals.goal_search import GlobalPlanner, Nearby, cleared, search_plan
from sara_nav.goals.move_base_config import CONTROLLING, PLANNING, Counters, MoveBaseConfig
from sara_nav.goals.plan_check import PlanWatch
from sara_nav.planners.planning import PlanError

REPLAN_PERIOD = 1.0
"""Seconds between two tries to plan while there is no valid plan or the way is blocked."""
LONG = 0.2
"""A plan is a long one if it takes so many seconds more than a control cycle."""
OUTRUN = 0.05
"""A long plan is void if the robot is so far (m, rad) from where it begins."""


class PlanMaker:
    """Plans with ``planner``, a global planner that may be replaced, on the world of a CostmapPair; counts what it does
    in the machine's Counters. before_planning: called before a plan that may be a long one: any but those that
    planner_frequency asks for while all is well and plans are short.
    """

    def __init__(
        self, planner: GlobalPlanner, costmaps: CostmapPair, counters: Counters, before_planning: Callable[[], None]
    ) -> None:
        self.planner = planner
        self._costmaps, self._counters, self._before_planning = costmaps, counters, before_planning
        self._last, self._long = None, False  # (s, where it begins) of the last cycle's plan; whether the last was long
        self._watch = PlanWatch()
        self._watched = None  # which of the global costmap's changes the plan was last looked at on

    @property
    def unknown_blocks(self) -> bool:
        """True when the footprint may not overlap unknown cells: the planner does not plan through them either."""
        return not getattr(self.planner.config, 'allow_unknown', False)

    def due(self, goal: Goal, t: float, pose: Pose2D, config: MoveBaseConfig) -> bool:
        """Whether a Goal wants a plan at t (s), because it has none, something blocks the robot at ``pose``, or
        planner_frequency says so; or because the last one is void. To be asked in every cycle.
        """
        self._look_back(goal, t, pose, config)
        waiting = goal.phase == PLANNING
        period = REPLAN_PERIOD if waiting or not config.planner_frequency else 1.0 / config.planner_frequency
        blocked = not waiting and (t - goal.valid_control_at >= REPLAN_PERIOD or self._crossed(goal, pose, config))
        # A millisecond's grace: cycles come as they come, and a plan is not to wait for another whole one.
        return bool(waiting or blocked or config.planner_frequency) and t - goal.last_plan_try >= period - 1e-3

    def make(self, goal: Goal, t: float, pose: Pose2D, config: MoveBaseConfig) -> tuple[np.ndarray | None, str]:
        """Return (plan (n, 3) or None, why) for a Goal from ``pose`` at t (s); None where there is none, or the robot
        goes on by the one that it has; why: '', or by what patience is at its end.
        """
        waiting, goal.last_plan_try = goal.phase == PLANNING, t
        has_plan, goal.has_plan = goal.has_plan, False
        if waiting and goal.planning_since is None:
            goal.planning_since, goal.tries = t, 0
        if waiting or goal.crossed is not None or self._long:
            self._before_planning()
        self._last = t, pose
        try:
            plan = self.plan(pose, goal.pose)
        except PlanError as error:
            self._last = t, None
            self._counters.failed_plans += 1
            goal.problem = str(error)
            return None, goal.plan_failed(t, config) if waiting else ''
        self._counters.plans += 1
        if has_plan and self._keeps(plan, pose):
            self._last, goal.phase, goal.planning_since = (t, None), CONTROLLING, None
            return None, ''
        goal.crossed = None
        self._watch.forget()
        if config.replan_when_blocked:
            self._watch.take(plan, self._costmaps.to_plan_on(self.unknown_blocks))
            self._watched = self._costmaps.world_changes
        return plan, ''

    def _keeps(self, plan, pose):
        """Whether the robot goes on by the plan that it has: it is free on the new map, too, and the new one leads
        back, or comes nearer to obstacles. What one place alone sees on the way would have it go to and fro, map by
        map; and made anew in the bend before a door, a plan leads through it askew.
        """
        self._watch.follow(pose)
        world = self._costmaps.to_plan_on(self.unknown_blocks)
        if self._watch.blocked(world) is not None:
            return False
        return self._watch.turns_back(plan) or self._watch.leaves_less_room(plan, world)

    def plan(self, start: Pose2D, goal: Pose2D) -> np.ndarray:
        """Return a plan (n, 3) from one Pose2D to another on the global costmap. Raises PlanError."""
        return self._informed().plan(self._costmaps.world.costmap, start, goal)

    def of_planner(self, start: Pose2D, goal: Pose2D, active: bool) -> tuple[np.ndarray | None, str]:
        """Return (plan (n, 3) or None, text) for whoever asks the planner itself; active: while the robot drives."""
        if active:
            self._before_planning()
        return search_plan(self._informed(), self._costmaps.world.costmap, start, goal)

    def search(
        self, start: Pose2D, goal: Pose2D, tolerance: float, config: MoveBaseConfig, give_up: Callable[[], bool]
    ) -> tuple[np.ndarray | None, str]:
        """Return (plan (n, 3) or None, text) for whoever asks: see goal_search. Raises ValueError where no plan can be
        asked for.
        """
        if self._costmaps.missing():
            raise ValueError(f'move_base cannot make a plan for you because there is {self._costmaps.missing()}')
        if not (start.is_finite() and goal.is_finite() and math.isfinite(tolerance)):
            raise ValueError('start, goal or tolerance holds a NaN or an infinity')
        costmap = self._costmaps.world.costmap
        if config.make_plan_clear_costmap:
            costmap = cleared(costmap, start, config.clearing_radius)
        nearby = Nearby(tolerance, config.make_plan_add_unreachable_goal, give_up)
        return search_plan(self._informed(), costmap, start, goal, nearby)

    def _look_back(self, goal, t, pose, config):
        """Learn how long the plan of the last cycle took; a long one that begins where the robot is no more is void."""
        if self._last is None:
            return
        (at, begins), self._last = self._last, None
        self._long = t - at > 1.0 / config.controller_frequency + LONG
        if self._long and begins is not None and is_apart(begins, pose, OUTRUN, OUTRUN):
            goal.phase, goal.last_plan_try = PLANNING, -math.inf

    def _informed(self):
        """Return the planner, which has been told the footprint that the global costmap has now, if it asks for one."""
        if hasattr(self.planner, 'set_footprint'):
            self.planner.set_footprint(self._costmaps.world.footprint)
        return self.planner

    def _crossed(self, goal, pose, config):
        """True while the global costmap shows something new on the plan (replan_when_blocked)."""
        if not config.replan_when_blocked:
            return False
        self._watch.follow(pose)
        if self._watched != self._costmaps.world_changes:
            self._watched = self._costmaps.world_changes
            goal.crossed = self._watch.blocked(self._costmaps.to_plan_on(self.unknown_blocks))
        return goal.crossed is not None
