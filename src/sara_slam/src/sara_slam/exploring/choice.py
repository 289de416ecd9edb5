"""Which frontier is driven to next: the one that costs least, as explore_lite has it, by plans of the robot's own
planner.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.costmaps.costmap import Costmap
from sara_nav.planners.planning import PlanError, path_length
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.frontiers import Frontier
from sara_slam.exploring.viewpoints import Surroundings

COMPARED = 3
"""Frontiers that there are plans to, among which the cheapest is chosen."""
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
