"""What a robot has passed: what was in sight of its way, and near."""

from __future__ import annotations

import math

import numpy as np

from sara_common.planar import Pose2D
from sara_slam.exploring.cones import FREE_CELL, WALL_CELL, Cells, mark_seen

PASSED, APART = 2.4, 0.3
"""m from the robot up to which it has passed what is in sight; between poses from which that is looked at."""


class Passed:
    """`at` and `on_cells` tell of the robot's way and of the newest map."""

    def __init__(self) -> None:
        self._trail: list[tuple[float, float]] = []
        self._held: int | None = None  # how much of the trail counts for share_from; None: all
        self._grounds: tuple[Cells, ...] = ()
        self._marked: list[tuple[np.ndarray, int]] = []  # which cells were seen from how much of the trail

    def at(self, pose: Pose2D) -> None:
        """The robot is at a pose."""
        if not self._trail or math.dist(self._trail[-1], (pose.x, pose.y)) >= APART:
            self._trail.append((pose.x, pose.y))

    def on_cells(self, cells: Cells) -> None:
        """The newest map."""
        # of what is free; and of what is not known, too, for walls may stand anywhere there
        self._grounds = cells, cells._replace(kinds=np.where(cells.kinds == WALL_CELL, cells.kinds, FREE_CELL))
        self._marked = [(np.zeros(cells.kinds.shape, bool), 0) for _ in self._grounds]

    def free(self) -> np.ndarray:
        """bool (rows, columns): which free cells it has passed."""
        return self._seen(0)

    def hold(self) -> None:
        """For share_from, from now on, nothing more has been passed."""
        self._held = len(self._trail) if self._held is None else self._held

    def release(self) -> None:
        """Everything counts again."""
        self._held = None

    def share_from(self, x: float, y: float) -> float:
        """Of what would be in sight from a place, m, and near: the share that it has passed, until hold was called."""
        before, there = self._seen(1, self._held), np.zeros(self._marked[1][0].shape, bool)
        mark_seen(self._grounds[1], np.array([[x, y]]), PASSED, there)
        return float(before[there].mean()) if there.any() else 1.0

    def _seen(self, ground, until=None):
        seen, looked = self._marked[ground]
        trail = np.array(self._trail[:until]).reshape(-1, 2)
        mark_seen(self._grounds[ground], trail[looked:], PASSED, seen)
        self._marked[ground] = seen, len(trail)
        return seen
