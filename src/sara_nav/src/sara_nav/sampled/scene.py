"""What a sampling planner chooses from in a cycle, and what it chose."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.grids.collision import LocalWorld


class Scene(NamedTuple):
    """What is sampled in, all in the costmap's frame."""

    dt: float
    pose: Pose2D
    velocity: tuple[float, float]
    """The speed (v, w), as commanded, that the base is on its way to."""
    plan: np.ndarray
    """(n, 3) near the robot."""
    cells: np.ndarray
    """(m, 2) of the plan."""
    world: LocalWorld
    can_stop: Callable[[float, float], bool]
    """Whether the robot could stop from a command (v, w) without touching anything."""

    @property
    def left(self) -> float:
        """The distance to the end of the plan near the robot (m)."""
        return math.hypot(self.plan[-1, 0] - self.pose.x, self.plan[-1, 1] - self.pose.y)


class Choice(NamedTuple):
    """The command (v, w) chosen and its trajectory (n, 3), costmap's frame; or None, None, and why there is none."""

    command: tuple[float, float] | None
    poses: np.ndarray | None
    text: str = ''
