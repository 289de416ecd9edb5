"""Which frontier is driven to next: the one that costs least, as explore_lite has it, by plans of the robot's own
planner. One that stays a frontier though the robot has looked at it from near, and one that it could not get to, are
tried once more when no other is left, from elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.costmaps.costmap import Costmap
from sara_nav.planners.planning import PlanError, path_length
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.frontiers import Frontier, share_near
from sara_slam.exploring.viewpoints import Surroundings

COMPARED = 3
"""Frontiers that there are plans to, among which the cheapest is chosen."""
SAME = 0.5
"""Share of the cells of two frontiers that lie together if they are the same one on maps of two times."""
TRIES = 3
"""Viewpoints of one frontier that are planned to."""


class Planner(Protocol):
    """A global planner of sara_nav."""

    def plan(self, costmap: Costmap, start: Pose2D, goal: Pose2D) -> np.ndarray:
        """A plan (n, 3); raises PlanError."""


class Choice(NamedTuple):
    """A frontier, from where it is looked at, and what that costs."""

    frontier: Frontier
    pose: Pose2D
    cost: float


class Chooser(Protocol):
    """Knows the newest map, and chooses where to on it. `ground`: that one, as the robot goes by it."""

    ground: Costmap | None

    def on_costmap(self, costmap: Costmap, found: Sequence[Frontier]) -> None:
        """The newest map, and its frontiers."""

    def at(self, pose: Pose2D) -> None:
        """The robot is at a pose."""

    def choose(self, planner: Planner, footprint: np.ndarray, start: Pose2D, under_way: bool) -> Choice | None:
        """Where to from a pose `start`, None where nothing is left that a plan leads to. under_way: the robot drives to
        an earlier choice, so that only a good one will do.
        """

    def stays(self, choice: Choice) -> bool:
        """Whether what was chosen is still to be driven to. To be asked at each look on the way there."""

    def tried(self, choice: Choice, reached: bool) -> None:
        """The robot has looked from there, or could not get there."""

    def given_up(self, frontier: Frontier) -> bool:
        """Whether a frontier is not driven to any more."""

    def looks_again(self) -> bool:
        """Nothing is left to drive to, on a map that is up to date: whether there is now, to be looked at once more."""

    def forget(self) -> None:
        """Try again what was tried."""

    def finish(self, home: Pose2D | None) -> None:
        """Little time is left until it has to drive home; home: where that is if the way counts."""

    def on_way_home(
        self, planner: Planner, footprint: np.ndarray, start: Pose2D, home: Pose2D, left: float
    ) -> Choice | None:
        """As choose with little time left, what takes at most `left` s more than the way home."""


class ByFrontiers:
    """The Chooser for a robot with a laser scanner."""

    def __init__(self, config: ExploreConfig) -> None:
        self._config = config
        self.ground: Costmap | None = None
        self._found: Sequence[Frontier] = ()
        self._strikes: list[tuple[Frontier, int]] = []
        self._looked_from: list[Pose2D] = []

    def on_costmap(self, costmap: Costmap, found: Sequence[Frontier]) -> None:
        """See Chooser."""
        self.ground, self._found = costmap, found

    def at(self, pose: Pose2D) -> None:
        """Nothing comes of it: what the robot sees is on the map."""

    def choose(self, planner: Planner, footprint: np.ndarray, start: Pose2D, under_way: bool) -> Choice | None:
        """See Chooser."""
        around = Surroundings(self.ground, start, footprint)
        for strikes in (0,) if under_way else (0, 1):
            due = [frontier for frontier in self._found if self._strikes_of(frontier) <= strikes]
            choice = choose(self._config, planner, around, start, due, self._looked_from)
            if choice is not None:
                return choice
        return None

    def stays(self, choice: Choice) -> bool:
        """See Chooser."""
        return share_near(choice.frontier, self._found) >= SAME

    def tried(self, choice: Choice, reached: bool) -> None:
        """See Chooser."""
        if reached:
            self._looked_from.append(choice.pose)
        self._strikes.append((choice.frontier, self._strikes_of(choice.frontier) + 1))

    def given_up(self, frontier: Frontier) -> bool:
        """See Chooser."""
        return self._strikes_of(frontier) > 1

    def finish(self, home: Pose2D | None) -> None:
        """Frontiers are chosen as before."""

    def on_way_home(
        self, planner: Planner, footprint: np.ndarray, start: Pose2D, home: Pose2D, left: float
    ) -> Choice | None:
        """None: what a scanner has not seen on the way out is where it turned back."""
        return None

    def looks_again(self) -> bool:
        """False: what a scanner has not seen from near is out of its sight."""
        return False

    def forget(self) -> None:
        """See Chooser."""
        self._strikes.clear()
        self._looked_from.clear()

    def _strikes_of(self, frontier):
        return max((count for other, count in self._strikes if share_near(frontier, [other]) >= SAME), default=0)


def cost(config: ExploreConfig, way: float, turn: float, size: float) -> float:
    """What driving to a frontier costs: `way` m and `turn` rad (of any sign) until it sets out, against its size, m."""
    return config.potential_scale * way + config.orientation_scale * abs(turn) - config.gain_scale * size


def choose(
    config: ExploreConfig,
    planner: Planner,
    around: Surroundings,
    start: Pose2D,
    found: Sequence[Frontier],
    looked_from: Sequence[Pose2D] = (),
) -> Choice | None:
    """The cheapest of the frontiers `found` that a plan leads to from `start`, not to where the robot has looked from
    before; None where none does.
    """
    ranked = []
    for frontier in found:
        views = around.views(frontier, TRIES, looked_from)
        if views:
            ranked.append((cost(config, views[0].way, 0.0, frontier.size), frontier, views))
    ranked.sort(key=lambda entry: entry[0])
    choices: list[Choice] = []
    for least, frontier, views in ranked:
        if len(choices) == COMPARED or (choices and least >= min(choice.cost for choice in choices)):
            break
        for view in views:
            try:
                plan = planner.plan(around.costmap, start, view.pose)
            except PlanError:
                continue
            way, turn = path_length(plan), _first_turn(plan)
            choices.append(Choice(frontier, view.pose, cost(config, way, turn, frontier.size)))
            break
    return min(choices, key=lambda choice: choice.cost, default=None)


def _first_turn(plan):
    """rad that a plan (n, 3) turns before it leaves its first place."""
    off = np.hypot(*(plan[:, :2] - plan[0, :2]).T)
    away = int(np.argmax(off > 1e-3)) if (off > 1e-3).any() else len(plan) - 1
    return float(wrap(plan[max(away - 1, 0), 2] - plan[0, 2])) if away else 0.0
