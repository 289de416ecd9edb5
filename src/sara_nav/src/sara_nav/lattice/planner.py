"""A global planner for a body that is no circle: plans poses (x, y, yaw) that the footprint fits at and can drive to.

The way is searched among straights, arcs and turns in place (lattice_search.py), ahead and astern, then made of few
straight legs (lattice_straighten.py). So it goes through doors that are little wider than the body, turns where there
is room to turn, and backs out where there is none.
"""

import functools
import math

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.lattice import body as lattice_body
from sara_nav.lattice import field as lattice_field
from sara_nav.lattice import gates as lattice_gates
from sara_nav.lattice import search as lattice_search
from sara_nav.lattice import smooth as lattice_smooth
from sara_nav.lattice import straighten as lattice_straighten
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.planners.planning import GLOBAL_PLANNERS, PlanError, require_finite

FOOTPRINT = ((0.54, 0.29), (0.54, -0.29), (-0.54, -0.29), (-0.54, 0.29))
"""SARA's, until another is set; corners about base_link, m."""
APPROACH, APPROACH_STEP = 1.6, 0.2
"""m along the goal's yaw, ahead and astern of it, from which it is come up to."""
TURN_ROWS = 0.1
"""rad between the rows of a turn in place."""
SOON = 400
"""States after which a start or a goal without room to turn about is looked at apart: how to get from there to where
there is some.
"""
LONGEST, ASTERN = 10.0, 3.0
"""m, of a leg, and of one astern, that a way is made straight with."""
ESCAPE_GREED, ESCAPE_MOST = 5.0, 15000
"""Of the searches for room to turn about."""
SEARCH_CARE = 0.3
"""Share of what gaps cost that the search goes by; it is to find where the body can go, straightening where it had
better go.
"""
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

        Rows are poses of the robot: astern, it moves against its yaw; rows at one place are a turn. A goal that cannot
        be reached moves to the nearest place that can, within default_tolerance; ``goal_used`` says.
        """
        require_finite(start, goal)
        self.goal_used, self.expanded = goal, 0
        start, goal = (
            pose if abs(pose.yaw) <= math.pi else Pose2D(pose.x, pose.y, float(wrap(pose.yaw)))
            for pose in (start, goal)
        )
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
            raise PlanError(f'the robot at ({start.x:.2f}, {start.y:.2f}) is off the map')
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

    def _limit(self, pose):
        """Return the gap to be kept about a Pose2D: the margin, or where it has less, see lattice_body.margin_at."""
        gap, hard = self.gap(pose), self.config.hard_margin
        return hard if gap >= hard else lattice_body.margin_at(gap)

    def gap(self, pose):
        """Return the gap (m) at a Pose2D, or minus the number of its points that lie on obstacles."""
        return lattice_body.gap(*self.world, pose.x, pose.y, pose.yaw, -1e9)

    def plan(self, start, goal):
        """Return the plan (n, 3); raises PlanError."""
        if self.field.geometry.to_cell(goal.x, goal.y) is None:
            raise PlanError(f'the goal ({goal.x:.2f}, {goal.y:.2f}) is off the map')
        limit, limit_end = (self._limit(pose) for pose in (start, goal))
        if limit_end < 0.0:
            raise PlanError(
                'the footprint at the goal ({:.2f}, {:.2f}, {:.0f} deg) overlaps an obstacle{}'.format(
                    goal.x,
                    goal.y,
                    math.degrees(goal.yaw),
                    ', unknown space or the edge of the map'
                    if self.field.unknown_blocks
                    else ' or the edge of the map',
                )
            )
        poses, moves = self._way(start, goal, limit, limit_end)
        found = np.column_stack([poses[:-1], moves])
        poses, moves, follow = lattice_gates.with_gates(self.world, poses, moves, self.body.inscribed)
        anchors = lattice_straighten.anchors_of(*self.world[:2], poses, follow)
        steps = lattice_straighten.straighten(
            *self.world, poses, moves, follow, anchors, limit, limit_end, max(self.radius, 0.0), LONGEST, ASTERN
        )
        if (
            len(steps) == 0
            # pieces of its moves that are sampled elsewhere do not all keep the margin to the last tenth of a millimetre
        ):
            steps = found
        elif self.config.smooth:
            steps = lattice_smooth.smooth(self.world, steps, poses[0], poses[-1], limit, limit_end)
        return as_plan(steps, start, goal, self.config.path_spacing)

    def explore(self, start):
        """Return bool (rows, columns) of the cells that the circle within the body comes to from a Pose2D."""
        wave = self.field.wave_from([(start.x, start.y, 0.0)], self._pace)
        reached = wave < lattice_search.FAR
        return reached[:-1, :-1] | reached[:-1, 1:] | reached[1:, :-1] | reached[1:, 1:]

    def _pace(self, distances):
        # Between two corners there may be half a cell more room than at either.
        return self.config.pace(distances - self.body.inscribed + 0.5 * self.field.geometry.resolution)

    def _way(self, start, goal, limit, limit_end):
        """Return poses (n, 3) and the moves (n - 1, 2) between them, from start to goal; raises PlanError.

        Where the search does not soon find one, and there is no room to turn about at the start or at the goal, the
        ways from there to the nearest pose that has some are looked for first, the goal's backwards.
        """
        first, head, budget = np.array([start.x, start.y, start.yaw]), np.empty((0, 5)), self.config.max_expansions
        tight, tight_end = (self.field.at(pose.x, pose.y) < self._room for pose in (start, goal))
        tails = self._tails(goal, limit_end)
        status, moves, final = self._search_to(tails, first, limit, min(SOON, budget) if tight or tight_end else budget)
        if status != lattice_search.FOUND and (tight or tight_end):
            if tight_end:
                ways, known = self._escape(goal, limit_end)
                tails = ways or tails
                budget = min(budget, ESCAPE_MOST // 3) if known and not ways else budget
            if tight:
                status, found, _ = self._search(first, limit, min(ESCAPE_MOST, budget), escape=True)
                if status == lattice_search.FOUND:
                    first, limit, head = found[-1, :3], self.config.hard_margin, found[:-1]
            status, moves, final = self._search_to(tails, first, limit, budget)
        if status != lattice_search.FOUND:
            raise PlanError(
                'no way leads the footprint from ({:.2f}, {:.2f}, {:.0f} deg) to the goal ({:.2f}, {:.2f}, {:.0f} deg){}'.format(
                    start.x,
                    start.y,
                    math.degrees(start.yaw),
                    goal.x,
                    goal.y,
                    math.degrees(goal.yaw),
                    ''
                    if status == lattice_search.NO_WAY
                    else ' that was found in %d states (max_expansions)' % self.config.max_expansions,
                )
            )
        moves = np.vstack([head, moves])
        last, limit = 0, limit if len(moves) == 1 else self.config.hard_margin
        for length in moves[:-1, 3]:
            last = last if length == 0.0 else lattice_search.AHEAD if length > 0.0 else lattice_search.ASTERN
        poses, steps, _ = tails[int(final[2])]
        _, turn, length, back = lattice_search.join(*self.world, *moves[-1, :3], last, limit, *poses[0], int(final[1]))
        joint = _along(
            moves[-1, :3], [*([(0.0, turn)] if turn else []), *_pieces(length), *([(0.0, back)] if back else [])]
        )
        poses = np.vstack([moves[:-1, :3], joint[0][:-1], poses])
        steps = np.vstack([moves[:-1, 3:], joint[1], steps])
        if len(poses) == 1:  # the goal is where the robot is
            poses, steps = np.vstack([first, poses]), np.zeros((1, 2))
        poses[0], poses[-1] = (start.x, start.y, start.yaw), (goal.x, goal.y, goal.yaw)
        return poses, steps

    @property
    def _room(self):
        """m from an obstacle, from which on the robot can turn about."""
        return self.body.circumscribed + self.config.hard_margin

    def _search(
        self, pose, limit, most, ends=np.empty((0, 4)), wave=np.empty((1, 1), np.float32), escape=False, backwards=False
    ):
        """Return (status, moves (n, 5), final), see lattice_search.search."""
        c, rules = self.config, self.rules.copy()
        greed = ESCAPE_GREED if escape else c.greed
        rules[lattice_body.REVERSE] = 1.0 + 0.25 * greed * (
            c.reverse_factor - 1.0
        )  # or greed would drive astern for being quick
        for weight in (lattice_body.WEIGHT, lattice_body.ROOM_WEIGHT):
            rules[weight] *= SEARCH_CARE
        rules[lattice_body.RUN_UP_COST] = 0.0  # its moves are pieces of legs
        rules[lattice_body.SENSE] = -1.0 if backwards else 1.0
        status, expanded, moves, final = lattice_search.search(
            self.field.metres,
            wave,
            rules,
            self.body.outline,
            self.body.inside,
            np.array(pose),
            limit,
            ends,
            max(self.radius, 0.0),
            greed,
            most,
            c.hard_margin if escape else -1.0,
        )
        self.planner.expanded += expanded
        return status, moves, final

    def _tails(self, goal, limit):
        """Return [(poses (n, 3), moves (n - 1, 2), seconds)]: ways that end at the goal, the goal itself where it has
        its margin.
        """
        pose, tails = np.array([goal.x, goal.y, goal.yaw]), []
        if limit >= self.config.hard_margin:
            tails.append((pose[None], np.empty((0, 2)), 0.0))
        for way in (1.0, -1.0):
            for k in range(1, round(APPROACH / APPROACH_STEP) + 1):
                length = way * k * APPROACH_STEP
                seconds = lattice_body.arrive(*self.world, *pose, length, 0.0, limit)
                if seconds == math.inf:
                    break
                tails.append(
                    (np.array([lattice_body.place(*pose, -length, 0.0, 1.0), pose]), np.array([[length, 0.0]]), seconds)
                )
        return tails

    def _escape(self, goal, limit):
        """Return ([the tail from where there is room to turn about to the goal, if one is found], whether the search
        was exhaustive).
        """
        pose = np.array([goal.x, goal.y, goal.yaw])
        status, moves, _ = self._search(
            pose, limit, min(ESCAPE_MOST, self.config.max_expansions), escape=True, backwards=True
        )
        if status != lattice_search.FOUND:
            return [], status == lattice_search.NO_WAY
        seconds = sum(
            lattice_body.arrive(*self.world, *move[:3], -move[3], -move[4], limit) for move in moves[:-1].tolist()
        )
        return [(moves[::-1, :3].copy(), -moves[-2::-1, 3:], seconds)], True

    def _search_to(self, tails, pose, limit, most):
        """Return (status, moves (n, 5), final), see lattice_search.search, of the way to one of the tails."""
        if not tails:
            return lattice_search.NO_WAY, None, None
        ends = np.array([(*poses[0], seconds) for poses, _, seconds in tails])
        return self._search(pose, limit, most, ends=ends, wave=self.field.wave_from(ends[:, [0, 1, 3]], self._pace))


def _along(pose, moves):
    """Return poses (n, 3) and moves (n - 1, 2): those moves from a pose on."""
    poses = [np.asarray(pose)]
    for length, turn in moves:
        poses.append(np.array(lattice_body.place(*poses[-1], length, turn, 1.0)))
    return np.array(poses), np.array(moves).reshape(-1, 2)


def _pieces(length, most=0.2):
    """Return (length, 0) moves no longer than ``most`` that add up to a straight one."""
    if length == 0.0:
        return []
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


@functools.cache
def warm():
    """Compile, or load from the cache, every kernel of this planner, once; making a planner does it too."""
    for module in (lattice_field, lattice_body, lattice_gates, lattice_search, lattice_smooth, lattice_straighten):
        module.warm()
