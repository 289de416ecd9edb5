"""One costmap with one body on it: what LatticePlanner asks of search, straightening and smoothing, in their order."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.lattice import body as lattice_body
from sara_nav.lattice import gates, joining, search, smooth, straighten
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.lattice.field import Field
from sara_nav.lattice.moves import AHEAD, ASTERN, FAR
from sara_nav.lattice.poses import along, as_plan, pieces
from sara_nav.lattice.world import Body, World
from sara_nav.planners.planning import PlanError

APPROACH, APPROACH_STEP = 1.6, 0.2
"""m along the goal's yaw, ahead and astern of it, from which it is approached."""
SOON = 400
"""States after which a start or a goal without room to turn about is looked at apart: how to get from there to where
there is some.
"""
LONGEST, ASTERN_WITHIN = 10.0, 3.0
"""m, of a leg, and of one astern, that a path is made straight with."""
PATIENT_GREED = 2.0
"""A greedy search that sets out astern may stay so where it could have turned about: one that goes farther than
ASTERN_WITHIN is searched once more with this greed.
"""
ESCAPE_GREED, ESCAPE_MOST = 5.0, 15000
"""Of the searches for room to turn about."""
SEARCH_CARE = 0.3
"""Share of what gaps cost that the search counts; it is to find where the body can go, straightening where it had
better go.
"""
NO_ENDS, NO_WAVE = np.empty((0, 4)), np.empty((1, 1), np.float32)


class Tail(NamedTuple):
    """An end of a path, known before the search: poses (n, 3) and moves (n - 1, 2) to the goal, and the seconds that
    they take.
    """

    poses: np.ndarray
    moves: np.ndarray
    seconds: float


class Problem:
    """Finds plans on one Field for one Body. ``expanded``: states that its searches expanded."""

    def __init__(self, config: LatticePlannerConfig, field: Field, body: Body) -> None:
        self.config, self.field, self.body, self.expanded = config, field, body, 0
        self.world = World(
            field.metres, config.rules(field.geometry, body), body.outline, body.inside, body.ends(config.blind)
        )
        self.radius = max(body.inscribed + config.hard_margin - 0.5 * field.geometry.resolution, 0.0)

    def gap(self, pose: Pose2D) -> float:
        """Return the gap (m) at a pose, or minus the number of the body's points that lie on obstacles."""
        return lattice_body.gap(self.world, _floats(pose), -1e9)

    def may_turn(self, pose: Pose2D, yaw: float) -> bool:
        """Whether the body keeps its margin while it turns in place from a pose to another yaw, the short way."""
        turn, margin = float(wrap(yaw - pose.yaw)), float(self.config.hard_margin)
        seconds, _ = lattice_body.move(self.world, _floats(pose), 0.0, turn, margin)
        return seconds < math.inf

    def plan(self, start: Pose2D, goal: Pose2D) -> np.ndarray:
        """Return the plan (n, 3), x, y, yaw, that keeps hard_margin, or where there is none, one that keeps less, down
        to least_margin; raises PlanError.
        """
        start, goal = _floats(start), _floats(goal)
        problems = self._by_margin()
        try:
            for problem in problems[:-1]:
                with contextlib.suppress(PlanError):
                    return problem._plan(start, goal)
            return problems[-1]._plan(start, goal)
        finally:
            self.expanded += sum(problem.expanded for problem in problems[1:])

    def explore(self, start: Pose2D) -> np.ndarray:
        """Return bool (rows, columns) of the cells that the circle within the body comes to from a pose."""
        wave = self.field.wave_from([(start.x, start.y, 0.0)], self._by_margin()[-1]._pace)
        reached = wave < FAR
        return reached[:-1, :-1] | reached[:-1, 1:] | reached[1:, :-1] | reached[1:, 1:]

    def _by_margin(self):
        """This Problem, and where least_margin is less than hard_margin and not 0, those whose plans keep half-way
        between the two, and least_margin.
        """
        hard, least = self.config.hard_margin, self.config.least_margin
        less = (0.5 * (hard + least), least) if 0.0 < least < hard else ()
        return [self, *(self._other(hard_margin=margin) for margin in less)]

    def _other(self, **parameters):
        """The same Problem by other parameters."""
        return Problem(replace(self.config, **parameters), self.field, self.body)

    def _plan(self, start, goal):
        if self.field.geometry.to_cell(goal.x, goal.y) is None:
            raise PlanError(f'the goal ({goal.x:.2f}, {goal.y:.2f}) is off the map')
        limit, limit_end = self._limit(start), self._limit(goal)
        if limit_end < 0.0:
            unknown = ', unknown space or' if self.field.unknown_blocks else ' or'
            raise PlanError(
                f'the footprint at the goal {_text(goal)} overlaps an obstacle{unknown} the edge of the map'
            )
        steps = self._steps(start, goal, limit, limit_end)
        if astern(steps) > ASTERN_WITHIN and self.config.greed > PATIENT_GREED:
            patient = self._other(greed=PATIENT_GREED)
            with contextlib.suppress(PlanError):
                steps = min(steps, patient._steps(start, goal, limit, limit_end), key=astern)
            self.expanded += patient.expanded
        law = float(self.config.bend_deviation), float(self.config.curve_margin)
        return as_plan(self.world, steps, (start, goal), self.config.path_spacing, law)

    def _limit(self, pose):
        """Return the gap to be kept about a pose: the margin, or where it has less, see body.margin_at."""
        gap, hard = self.gap(pose), self.config.hard_margin
        return float(hard if gap >= hard else lattice_body.margin_at(gap))

    def _pace(self, distances):
        # Between two corners there may be half a cell more room than at either.
        return self.config.pace(distances - self.body.inscribed + 0.5 * self.field.geometry.resolution)

    def _steps(self, start, goal, limit, limit_end):
        """Return the moves (m, 5) from start to goal; raises PlanError."""
        return self._straightened(*self._path(start, goal, limit, limit_end), limit, limit_end)

    def _straightened(self, poses, moves, limit, limit_end):
        """Return moves (m, 5) that take less time than the path of poses (n, 3) and moves (n - 1, 2)."""
        found = np.column_stack([poses[:-1], moves])
        poses, moves, follow = gates.with_gates(self.world, poses, moves, self.body.inscribed)
        anchors = straighten.anchors_of(self.world, poses, follow)
        path = straighten.Path(poses, moves, follow, limit, limit_end)
        steps = straighten.straighten(self.world, path, anchors, straighten.Reach(self.radius, LONGEST, ASTERN_WITHIN))
        if len(steps) == 0:
            # Pieces of its moves that are sampled elsewhere do not all keep the margin to the last tenth of a
            # millimetre.
            return found
        if not self.config.smooth:
            return steps
        start, goal = (Pose2D(*row.tolist()) for row in (poses[0], poses[-1]))
        by = self.config.shortcuts(self.world, self.body.corners)
        return smooth.smooth(self.world, steps, (start, goal), (limit, limit_end), by)

    # -- finding a path ------------------------------------------------------------------------------------------

    def _path(self, start, goal, limit, limit_end):
        """Return poses (n, 3) and the moves (n - 1, 2) between them, from start to goal; raises PlanError."""
        tails, begin, head, status, moves, joint, limit = self._search_in_turn(start, goal, limit, limit_end)
        if status != search.FOUND:
            most = self.config.max_expansions
            raise PlanError(
                f'no way leads the footprint from {_text(start)} to the goal {_text(goal)}'
                + ('' if status == search.NO_PATH else f' that was found in {most} states (max_expansions)')
            )
        moves = np.vstack([head, moves])
        last, limit = 0, limit if len(moves) == 1 else self.config.hard_margin
        for length in moves[:-1, 3]:
            last = last if length == 0.0 else AHEAD if length > 0.0 else ASTERN
        tail = tails[int(joint[2])]
        here, there = Pose2D(*moves[-1, :3].tolist()), Pose2D(*tail.poses[0].tolist())
        _, turn, length, back = joining.join(self.world, here, last, float(limit), there, int(joint[1]))
        turns = [(0.0, turn)] if turn else [], [(0.0, back)] if back else []
        between = along(here, [*turns[0], *pieces(length), *turns[1]])
        poses = np.vstack([moves[:-1, :3], between[0][:-1], tail.poses])
        steps = np.vstack([moves[:-1, 3:], between[1], tail.moves])
        if len(poses) == 1:  # the goal is where the robot is
            poses, steps = np.vstack([begin, poses]), np.zeros((1, 2))
        poses[0], poses[-1] = start, goal
        return poses, steps

    def _search_in_turn(self, start, goal, limit, limit_end):
        """Return (tails, begin, head, status, moves, joint, limit): the search began at the Pose2D ``begin``, to which
        the moves ``head`` (n, 5) lead from the start; the rest as of search.search.

        Where the search does not soon find a path, and there is no room to turn about at the start or at the goal, the
        paths from there to the nearest pose that has some are searched first, the goal's backwards.
        """
        begin, head, budget = start, np.empty((0, 5)), self.config.max_expansions
        tight, tight_end = (self.field.at(pose.x, pose.y) < self._turning_room for pose in (start, goal))
        tails = self._tails(goal, limit_end)
        at_first = min(SOON, budget) if tight or tight_end else budget
        status, moves, joint = self._search_to(tails, begin, limit, at_first)
        if status != search.FOUND and (tight or tight_end):
            if tight_end:
                escapes, exhaustive = self._escape(goal, limit_end)
                tails = escapes or tails
                budget = min(budget, ESCAPE_MOST // 3) if exhaustive and not escapes else budget
            if tight:
                status, found, _ = self._search(begin, limit, min(ESCAPE_MOST, budget))
                if status == search.FOUND:
                    begin, limit, head = Pose2D(*found[-1, :3].tolist()), self.config.hard_margin, found[:-1]
            status, moves, joint = self._search_to(tails, begin, limit, budget)
        return tails, begin, head, status, moves, joint, limit

    @property
    def _turning_room(self):
        """m from an obstacle, from which on the robot can turn about."""
        return self.body.circumscribed + self.config.hard_margin

    def _search(self, pose, limit, most, aim=None, backwards=False):
        """Return (status, moves (n, 5), joint), see search.search. aim: the ends and the wave from them; None: any pose
        with room to turn about.

        Moves are pieces of legs, so that no run-up is asked for; and the time astern counts less than it will, or greed
        would drive astern for being quick.
        """
        c, rules, escape = self.config, self.world.rules, aim is None
        greed = float(ESCAPE_GREED if escape else c.greed)
        ends, wave = (NO_ENDS, NO_WAVE) if escape else aim
        rules = rules._replace(
            reverse_factor=1.0 + 0.25 * greed * (rules.reverse_factor - 1.0),
            clearance_weight=rules.clearance_weight * SEARCH_CARE,
            turning_room_weight=rules.turning_room_weight * SEARCH_CARE,
            run_up_cost=0.0,
            sense=-1.0 if backwards else 1.0,
        )
        world, room = self.world._replace(rules=rules), float(c.hard_margin) if escape else -1.0
        quest = search.Quest(world, wave, ends, self.radius, greed, most, room)
        status, expanded, moves, joint = search.search(quest, pose, float(limit))
        self.expanded += expanded
        return status, moves, joint

    def _search_to(self, tails, pose, limit, most):
        """Return (status, moves (n, 5), joint), see search.search, of the path to one of the tails."""
        if not tails:
            return search.NO_PATH, None, None
        ends = np.array([(*tail.poses[0], tail.seconds) for tail in tails])
        return self._search(pose, limit, most, (ends, self.field.wave_from(ends[:, [0, 1, 3]], self._pace)))

    def _tails(self, goal, limit):
        """Return the Tails straight to the goal, and the goal itself where it has its margin."""
        tails = []
        if limit >= self.config.hard_margin:
            tails.append(Tail(np.array([goal]), np.empty((0, 2)), 0.0))
        for sense in (1.0, -1.0):
            for k in range(1, round(APPROACH / APPROACH_STEP) + 1):
                length = sense * k * APPROACH_STEP
                seconds = lattice_body.arrive(self.world, goal, length, 0.0, limit)
                if seconds == math.inf:
                    break
                begin = lattice_body.place(goal, -length, 0.0, 1.0)
                tails.append(Tail(np.array([begin, goal]), np.array([[length, 0.0]]), seconds))
        return tails

    def _escape(self, goal, limit):
        """Return ([the Tail from where there is room to turn about to the goal, if one is found], whether the search
        was exhaustive).
        """
        most = min(ESCAPE_MOST, self.config.max_expansions)
        status, moves, _ = self._search(goal, limit, most, backwards=True)
        if status != search.FOUND:
            return [], status == search.NO_PATH
        seconds = sum(
            lattice_body.arrive(self.world, Pose2D(x, y, yaw), -length, -turn, limit)
            for x, y, yaw, length, turn in moves[:-1].tolist()
        )
        return [Tail(moves[::-1, :3].copy(), -moves[-2::-1, 3:], seconds)], True


def astern(steps: np.ndarray) -> float:
    """Return how far (m) moves (m, 5) go astern."""
    return -float(np.minimum(steps[:, 3], 0.0).sum())


def _floats(pose):
    """Return a pose as the kernels are compiled for it: a Pose2D of Python's floats."""
    return Pose2D(float(pose.x), float(pose.y), float(pose.yaw))


def _text(pose):
    return f'({pose.x:.2f}, {pose.y:.2f}, {math.degrees(pose.yaw):.0f} deg)'
