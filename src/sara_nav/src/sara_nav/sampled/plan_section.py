"""The part of a plan that lies about the robot: what is left behind is dropped (prune_plan), as the peers do."""

import math

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.grids.collision import LocalWorld
from sara_nav.sampled.map_grid import adjust_plan_resolution

PRUNE_DISTANCE = 1.0
"""Metres from the robot at which prune_plan keeps the plan behind it, the peers' value."""
PROGRESS_WINDOW = 2.0
"""Metres of plan ahead among which the point nearest to the robot is looked for."""


class PlanSection:
    """A plan (n, 3) in the global frame, and how far along it the robot has come."""

    def __init__(self, plan: np.ndarray):
        self._plan = plan
        self._dense, self._reached = None, 0

    def near(self, now: Pose2D, world: LocalWorld, prune: bool) -> np.ndarray | None:
        """Return the plan (n, 3) around the robot in the costmap's frame; None when it is nowhere near.

        It reaches from the plan's point nearest to the robot as far as half the local costmap goes, ahead and, unless
        ``prune``, behind. The peer begins with the first point of all that lies within: where the way comes near to an
        earlier part of itself, that leads back.
        """
        g = world.costmap.geometry
        if self._dense is None:
            self._dense = adjust_plan_resolution(self._plan, g.resolution)
        distance = np.hypot(*(self._dense[:, :2] - (now.x, now.y)).T)
        ahead = self._reached + math.ceil(PROGRESS_WINDOW / g.resolution)
        self._reached += int(distance[self._reached : ahead].argmin())
        if distance[self._reached] >= PRUNE_DISTANCE:
            self._reached = int(distance.argmin())
        near = distance <= 0.5 * g.resolution * max(g.width, g.height)
        behind = distance < PRUNE_DISTANCE if prune else near
        if not behind[self._reached]:
            return None
        before = ~behind[self._reached :: -1]
        first = self._reached - (int(before.argmax()) - 1 if before.any() else self._reached)
        later = ~near[self._reached :]
        end = self._reached + (int(later.argmax()) + 1 if later.any() else len(later))
        return world.to_local(self._dense[first:end])


def towards_plan(plan: np.ndarray, pose: Pose2D) -> float:
    """Return the bearing (rad) of the plan's point half a metre from a Pose2D, ahead of the one nearest to it."""
    distance = np.hypot(*(plan[:, :2] - (pose.x, pose.y)).T)
    nearest = int(distance.argmin())
    far = distance[nearest:] >= 0.5
    x, y = plan[nearest + int(far.argmax()) if far.any() else -1, :2]
    return math.atan2(y - pose.y, x - pose.x)
