"""Whether a plan that is being driven has been crossed by something new since it was made."""

from __future__ import annotations

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.grids.clearance import room
from sara_nav.grids.collision import LocalWorld
from sara_nav.planners.planning import distances_along

AHEAD = 1.0
"""The robot is looked for on the next so many metres of its plan."""
BEGIN = 0.3
"""m of a plan that tell which way it leaves."""
NEXT, NEAR, LESS = 2.0, 0.2, 0.01
"""m of plans of which it is compared how near they come to obstacles, the gap from which on nothing is near, and how
much less room is less, m.
"""


class PlanWatch:
    """Remembers how much the robot's footprint touches at each pose of a plan; where it touches more later, the plan is
    blocked.

    What it touched from the beginning is the planner's business: one that plans for the robot's centre may lead a
    corner of the footprint through something, and would do so again.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """There is no plan any more."""
        self._plan = None

    def take(self, plan: np.ndarray, world: LocalWorld) -> None:
        """Watch a new plan (n, 3), made on a LocalWorld of the global costmap."""
        self._plan = np.ascontiguousarray(plan, dtype=np.float64)
        self._along = distances_along(self._plan)
        self._touched, self._at = world.touched(self._plan), 0

    def follow(self, pose: Pose2D) -> None:
        """The robot is at a Pose2D, some way further along the plan."""
        if self._plan is not None:
            self._at = nearest(self._plan, self._along, self._at, float(pose.x), float(pose.y))

    def blocked(self, world: LocalWorld) -> float | None:
        """Return how far (m) along the plan from the robot it is blocked now, or None when it is not."""
        if self._plan is None:
            return None
        worse = np.flatnonzero(world.touched(self._plan[self._at :]) > self._touched[self._at :])
        return float(self._along[self._at + worse[0]] - self._along[self._at]) if len(worse) else None

    def turns_back(self, other: np.ndarray) -> bool:
        """Whether another plan (n, 3) from where the robot is leaves against the way that this one goes on."""
        if self._plan is None:
            return False
        ahead, back = _way_out(self._plan[self._at :]), _way_out(other)
        return ahead is not None and back is not None and float(ahead @ back) < 0.0

    def leaves_less_room(self, other: np.ndarray, world: LocalWorld) -> bool:
        """Whether another plan (n, 3) from where the robot is soon comes nearer to obstacles on a LocalWorld of the
        global costmap than this one does from there on.
        """
        return self._plan is not None and _least_gap(other, world) < _least_gap(self._plan[self._at :], world) - LESS


def _way_out(plan):
    """(2,) m: where a plan (n, 3) leads in its first BEGIN; None for a shorter one."""
    there = np.flatnonzero(distances_along(plan) >= BEGIN)
    return plan[there[0], :2] - plan[0, :2] if len(there) else None


def _least_gap(plan, world):
    """m between the footprint and what is nearest to it on the next part of a plan (n, 3); NEAR at most."""
    gaps = room(world, plan[distances_along(plan) <= NEXT], False, 0.0, NEAR).gap
    return min(float(gaps.min()), NEAR)


@kernel
def nearest(plan: np.ndarray, along: np.ndarray, at: int, x: float, y: float) -> int:
    """Return the index of the pose of a plan (n, 3) that is nearest to (x, y), from ``at`` on and AHEAD further along
    (n,) m at most.
    """
    best, least = at, np.inf
    for k in range(at, len(plan)):
        if along[k] > along[at] + AHEAD:
            break
        squared = (plan[k, 0] - x) ** 2 + (plan[k, 1] - y) ** 2
        if squared < least:
            best, least = k, squared
    return best


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    nearest(np.zeros((2, 3)), np.zeros(2), 0, 0.0, 0.0)
