"""A global planner for a body that is no circle: plans poses (x, y, yaw) that the footprint fits at and can drive to.

The way is searched among straights, arcs and turns in place (lattice_search.py), ahead and astern, then made of few straight legs
(lattice_straighten.py). So it goes through doors that are little wider than the body, turns where there is room to turn, and backs
out where there is none.
"""
import functools
import math

import numpy as np

from sara_nav import lattice_body, lattice_field, lattice_search, lattice_straighten
from sara_nav.geometry import Pose2D, wrap
from sara_nav.lattice_config import LatticePlannerConfig
from sara_nav.planning import GLOBAL_PLANNERS, PlanError, require_finite

FOOTPRINT = ((0.54, 0.29), (0.54, -0.29), (-0.54, -0.29), (-0.54, 0.29))
"""SARA's, until another is set; corners about base_link, m."""
APPROACH, APPROACH_STEP = 1.6, 0.2
"""m along the goal's yaw, ahead and astern of it, from which it is come up to."""
TURN_ROWS = 0.1
"""rad between the rows of a turn in place."""
TRIES = 12
"""Places about a goal that cannot be reached that are tried in its stead."""


@GLOBAL_PLANNERS.register('sara_nav/LatticePlanner')
class LatticePlanner:
    """Plans on a Costmap; see the module. Only obstacles and, as asked, unknown cells count: inflated costs do not."""

    config_class = LatticePlannerConfig

    def __init__(self, config=LatticePlannerConfig()):
        warm()
        self.config = config
        self.goal_used = None
        self.expanded = 0
        self._corners = np.array(FOOTPRINT)
        self._body = self._field = None

    def set_footprint(self, corners):
        """Take the outline (k, 2) of the robot, m about base_link, padded as it is to be kept clear."""
        if not np.array_equal(self._corners, corners):
            self._corners = np.array(corners, dtype=np.float64)
            self._body = None

    # -- the interface of global planners ------------------------------------------------------------------------

    def plan(self, costmap, start, goal):
        """Return a plan (n, 3) from Pose2D start to Pose2D goal, both included and exact; raises PlanError.

        Rows are poses of the robot: astern, it moves against its yaw; rows at one place are a turn. A goal that cannot be reached
        moves to the nearest place that can, within default_tolerance; ``goal_used`` says.
        """
        require_finite(start, goal)
        self.goal_used = goal
        problem = self._problem(costmap, start)
        try:
            return problem.plan(start, goal)
        except PlanError:
            for place in self._places(problem, start, goal):
                try:
                    plan = problem.plan(start, place)
                except PlanError:
                    continue
                self.goal_used = place
                return plan
            raise

    def explore(self, costmap, start):
        """Return bool (rows, columns): cells that a plan from Pose2D start may lead to; not that every yaw fits there."""
        return self._problem(costmap, start).explore(start)

    def _places(self, problem, start, goal):
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
            if all(place.distance(other) > 0.2 for other in taken) and problem.gap(place) >= self.config.hard_margin:
                taken.append(place)
                yield place
                if len(taken) == TRIES:
                    return

    def _problem(self, costmap, start):
        g = costmap.geometry
        if g.to_cell(start.x, start.y) is None:
            raise PlanError('the robot at (%.2f, %.2f) is off the map' % (start.x, start.y))
        if self._body is None or self._body.resolution != g.resolution:
            self._body = lattice_body.Body(self._corners, g.resolution)
        reach = self._body.circumscribed + 2.0 * self.config.soft
        if self._field is None or not self._field.holds(costmap, not self.config.allow_unknown, reach):
            self._field = lattice_field.Field(costmap, not self.config.allow_unknown, reach)
        return _Problem(self, self._field, self._body)


class _Problem:
    """One costmap with one body on it."""

    def __init__(self, planner, field, body):
        self.planner, self.config, self.field, self.body = planner, planner.config, field, body
        self.rules = self.config.rules(field.geometry, body)
        self.world = field.metres, self.rules, body.outline, body.inside
        self.radius = body.inscribed + self.config.hard_margin - 0.5 * field.geometry.resolution

    def gap(self, pose):
        """Return the gap (m) at a Pose2D, or minus the number of its points that lie on obstacles."""
        return lattice_body.gap(*self.world, pose.x, pose.y, pose.yaw, -1e9)

    def plan(self, start, goal):
        """Return the plan (n, 3); raises PlanError."""
        if self.field.geometry.to_cell(goal.x, goal.y) is None:
            raise PlanError('the goal (%.2f, %.2f) is off the map' % (goal.x, goal.y))
        limit, limit_end = (min(self.gap(pose), self.config.hard_margin) for pose in (start, goal))
        if limit_end < 0.0:
            raise PlanError('the footprint at the goal (%.2f, %.2f, %.0f deg) overlaps an obstacle%s' % (
                goal.x, goal.y, math.degrees(goal.yaw), ', unknown space or the edge of the map' if self.field.unknown_blocks
                else ' or the edge of the map'))
        ends = self._ends(goal, limit_end)
        wave = self.field.wave_from(ends[:, [0, 1, 3]], self._pace)
        poses, moves = self._search(start, goal, limit, ends, wave)
        steps = lattice_straighten.straighten(*self.world, poses, moves, limit, limit_end, max(self.radius, 0.0), 100, 3.0)
        return as_plan(steps, start, goal, self.config.path_spacing)

    def explore(self, start):
        """Return bool (rows, columns) of the cells that the circle within the body comes to from a Pose2D."""
        wave = self.field.wave_from([(start.x, start.y, 0.0)], self._pace)
        reached = wave < lattice_search.FAR
        return reached[:-1, :-1] | reached[:-1, 1:] | reached[1:, :-1] | reached[1:, 1:]

    def _pace(self, distances):
        # Between two corners there may be half a cell more room than at either.
        return self.config.pace(distances - self.body.inscribed + 0.5 * self.field.geometry.resolution)

    def _ends(self, goal, limit):
        """Return (m, 4) x, y, yaw, s: the goal, and poses from which the way to it is straight along its yaw and free."""
        ends = [(goal.x, goal.y, goal.yaw, 0.0)] if limit >= self.config.hard_margin else []
        for way in (1.0, -1.0):
            for k in range(1, round(APPROACH / APPROACH_STEP) + 1):
                length = way * k * APPROACH_STEP
                seconds = lattice_body.arrive(*self.world, goal.x, goal.y, goal.yaw, length, 0.0, limit)
                if seconds == math.inf:
                    break
                ends.append((goal.x - length * math.cos(goal.yaw), goal.y - length * math.sin(goal.yaw), goal.yaw, seconds))
        if not ends or limit < self.config.hard_margin:
            for turn in np.arange(-6, 7) * (math.pi / 12.0):
                seconds = lattice_body.arrive(*self.world, goal.x, goal.y, goal.yaw, 0.0, turn, limit) if turn else math.inf
                if seconds < math.inf:
                    ends.append((goal.x, goal.y, goal.yaw - turn, seconds + self.config.turn_cost))
        return np.array(ends).reshape(-1, 4)

    def _search(self, start, goal, limit, ends, wave):
        """Return poses (n, 3) and the moves (n - 1, 2) between them, from start to goal."""
        c = self.config
        first = np.array([start.x, start.y, start.yaw])
        status, expanded, moves, final = lattice_search.search(
            self.world[0], wave, *self.world[1:], first, limit, ends, max(self.radius, 0.0), c.greed, c.max_expansions)
        self.planner.expanded = expanded
        if status != lattice_search.FOUND:
            raise PlanError('no way leads the footprint from (%.2f, %.2f, %.0f deg) to the goal (%.2f, %.2f, %.0f deg)%s' % (
                start.x, start.y, math.degrees(start.yaw), goal.x, goal.y, math.degrees(goal.yaw),
                '' if status == lattice_search.NO_WAY else ' that was found in %d states (max_expansions)' % c.max_expansions))
        x, y, yaw = moves[-1, :3]
        end = ends[int(final[2])]
        last = 0
        for length in moves[:-1, 3]:
            last = last if length == 0.0 else lattice_search.AHEAD if length > 0.0 else lattice_search.ASTERN
        _, turn, length, back = lattice_search.join(*self.world, x, y, yaw, last, limit if len(moves) == 1 else c.hard_margin,
                                                    *end[:3], int(final[1]))
        poses, steps = [*moves[:, :3]], [*moves[:-1, 3:]]
        for run, angle in (*([(0.0, turn)] if turn else []), *_pieces(length), *([(0.0, back)] if back else [])):
            steps.append((run, angle))
            poses.append(np.array(lattice_body.place(*poses[-1], run, angle, 1.0)))
        away = (end[0] - goal.x) * math.cos(goal.yaw) + (end[1] - goal.y) * math.sin(goal.yaw)
        if abs(away) > 1e-9:
            steps.append((-away, 0.0))
        elif end[3] > 0.0:
            steps.append((0.0, wrap(goal.yaw - end[2])))
        if len(steps) == len(poses):
            poses.append(first)
        poses[-1] = np.array([goal.x, goal.y, goal.yaw])
        return np.array(poses), np.array(steps).reshape(-1, 2)


def _pieces(length, most=0.6):
    """Return (length, 0) moves no longer than ``most`` that add up to a straight one."""
    n = math.ceil(abs(length) / most)
    return [(length / n, 0.0)] * n


def as_plan(steps, start, goal, spacing):
    """Return the plan (n, 3) along moves (m, 5), from Pose2D start to Pose2D goal."""
    rows = [np.array([[start.x, start.y, start.yaw]])]
    for x, y, yaw, length, turn in steps:
        n = max(1, math.ceil(abs(length) / spacing - 1e-9), math.ceil(abs(turn) / TURN_ROWS - 1e-9))
        rows.append(np.array([lattice_body.place(x, y, yaw, length, turn, k / n) for k in range(1, n + 1)]))
    plan = np.vstack(rows)
    if len(plan) == 1:
        plan = np.repeat(plan, 2, axis=0)
    plan[:, 2] = wrap(plan[:, 2])
    plan[0], plan[-1] = (start.x, start.y, start.yaw), (goal.x, goal.y, goal.yaw)
    return plan


@functools.lru_cache(maxsize=None)
def warm():
    """Compile, or load from the cache, every kernel of this planner, once; making a planner does it too."""
    for module in (lattice_field, lattice_body, lattice_search, lattice_straighten):
        module.warm()
