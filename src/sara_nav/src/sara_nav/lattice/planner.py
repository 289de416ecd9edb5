"""A global planner for a body that is no circle: plans poses (x, y, yaw) that the footprint fits at and can drive to.

The path is searched among straights, arcs and turns in place (search.py), ahead and astern, then made of few straight
legs (straighten.py), whose corners are moved and rounded (smooth.py). So it leads through doors that are little wider
than the body, turns where there is room to turn, and backs out where there is none.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D, is_apart, wrap
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.footprint import circle_footprint
from sara_nav.lattice import (
    arrivals,
    driving,
    dubins,
    gates,
    joining,
    moves,
    rounding,
    search,
    shortcuts,
    smooth,
    straighten,
    transitions,
    tree,
)
from sara_nav.lattice import body as lattice_body
from sara_nav.lattice import field as lattice_field
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.lattice.problem import Problem
from sara_nav.lattice.world import Body
from sara_nav.planners.planning import GLOBAL_PLANNERS, PlanError, require_finite

ROBOT_RADIUS = 0.46
"""m, costmap_2d's, until a footprint is set."""
TRIES = 12
"""Places about a goal that cannot be reached that are tried in its stead."""
TRIES_APART = 0.2
"""m between them, at least."""
STILL_M, STILL_RAD = 0.001, 0.002
"""What a start may move, as the pose of a robot at rest does, without being searched from again in vain."""


class Failure(NamedTuple):
    """A plan that was not found on the newest costs, and what is said of it."""

    start: Pose2D
    goal: Pose2D
    text: str

    def is_of(self, start: Pose2D, goal: Pose2D) -> bool:
        """Whether the same was asked: to the same goal, from about the same start."""
        return self.goal == goal and not is_apart(self.start, start, STILL_M, STILL_RAD)


@GLOBAL_PLANNERS.register('sara_nav/LatticePlanner')
class LatticePlanner:
    """Plans on a Costmap; see the module. Only obstacles and, as asked, unknown cells count: inflated costs do not."""

    config_class = LatticePlannerConfig

    def __init__(self, config: LatticePlannerConfig = LatticePlannerConfig()) -> None:
        warm()
        self.config = config
        self.goal_used = None
        self.expanded = 0
        self._corners = circle_footprint(ROBOT_RADIUS)
        self._body = self._field = self._failure = None

    def set_footprint(self, corners: np.ndarray) -> None:
        """Take the outline (k, 2) of the robot, m about base_link, padded as it is to be kept clear."""
        if not np.array_equal(self._corners, corners):
            self._corners = np.array(corners, dtype=np.float64)
            self._body = self._failure = None

    # -- the interface of global planners ------------------------------------------------------------------------

    def plan(self, costmap: Costmap, start: Pose2D, goal: Pose2D) -> np.ndarray:
        """Return a plan (n, 3) from Pose2D start to Pose2D goal, both included and exact; raises PlanError.

        Rows are poses of the robot: astern, it moves against its yaw; rows at one place are a turn. A goal that cannot
        be reached moves to the nearest place that can, within default_tolerance; ``goal_used`` says. One within
        turn_only_distance of where the robot is, and may turn, is only turned to. What was not found a moment ago is
        not searched for again until map, goal or start change.
        """
        require_finite(start, goal)
        self.goal_used, self.expanded = goal, 0
        start, goal = (
            pose if abs(pose.yaw) <= math.pi else Pose2D(pose.x, pose.y, float(wrap(pose.yaw)))
            for pose in (start, goal)
        )
        problem = self._problem(costmap, start)
        if self._failure is not None and self._failure.is_of(start, goal):
            raise PlanError(self._failure.text)
        asked = start, goal
        if start.distance(goal) <= self.config.turn_only_distance and problem.may_turn(start, goal.yaw):
            goal = Pose2D(start.x, start.y, goal.yaw)
        try:
            return problem.plan(start, goal)
        except PlanError as error:
            for place in self._places(problem, start, goal):
                try:
                    plan = problem.plan(start, place)
                except PlanError:
                    continue
                self.goal_used = place
                return plan
            self._failure = Failure(*asked, str(error))
            raise
        finally:
            self.expanded = problem.expanded

    def explore(self, costmap: Costmap, start: Pose2D) -> np.ndarray:
        """Return bool (rows, columns): cells that a plan from start may lead to; not that every yaw fits there."""
        return self._problem(costmap, start).explore(start)

    def _places(self, problem: Problem, start: Pose2D, goal: Pose2D) -> Iterator[Pose2D]:
        """Yield the poses about a goal that are tried in its stead, nearest first, a footprint's breadth apart."""
        g, tolerance = problem.field.geometry, self.config.default_tolerance
        if not tolerance > 0.0:
            return
        rows, columns = np.nonzero(problem.explore(start))
        x, y = g.to_world(columns, rows)
        far = np.hypot(x - goal.x, y - goal.y)
        near = np.flatnonzero(far <= tolerance)
        near = near[np.argsort(far[near], kind='stable')]
        taken = []
        for k in near.tolist():
            place = Pose2D(float(x[k]), float(y[k]), goal.yaw)
            if (
                all(place.distance(other) > TRIES_APART for other in taken)
                and problem.gap(place) >= self.config.hard_margin
            ):
                taken.append(place)
                yield place
                if len(taken) == TRIES:
                    return

    def _problem(self, costmap, start):
        g = costmap.geometry
        if g.to_cell(start.x, start.y) is None:
            raise PlanError(f'the robot at ({start.x:.2f}, {start.y:.2f}) is off the map')
        if self._body is None or self._body.resolution != g.resolution:
            self._body = Body(self._corners, g.resolution)
        reach = self._body.circumscribed + 2.0 * self.config.soft
        if self._field is None or not self._field.holds(costmap, not self.config.allow_unknown, reach):
            self._field, self._failure = lattice_field.Field(costmap, not self.config.allow_unknown, reach), None
        return Problem(self.config, self._field, self._body)


@functools.cache
def warm() -> None:
    """Compile, or load from the cache, every kernel of this planner, once; making a planner does it too."""
    first = (lattice_field, lattice_body, arrivals, gates, joining, moves, rounding, search)
    for module in (*first, smooth, straighten, tree, dubins, driving, shortcuts, transitions):
        module.warm()
