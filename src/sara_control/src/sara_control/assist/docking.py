"""Whether the rider heads squarely for something that stands free and is at least as broad as the body: a bed, a table.
They are brought up to it, not round it; who then backs off and comes again wants to go by.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_control.assist.local_grid import Field, LocalGrid, distance_at, field_of

RAYS = 7
"""Across the body, from its front, or its rear."""
FLAT = 0.12
"""m by which these may differ: 10 deg over the width of a chair, and a cell."""
BESIDE, BEHIND = 0.7, 0.3
"""m beside the body where it ends, or it is a wall; m that is free there behind its front."""
STRAIGHT = 0.3
"""1/m; who bends more than that goes by."""
BACKED, GONE, FORGOTTEN = 0.15, 1.2, 60.0
"""m from where the robot was nearest: who was so far away comes again; who was so far does not, nor after so many s."""
TOUCHES, STEP = 0.01, 0.02
"""m to what is blocked that ends a ray; least m between two looks."""


@kernel
def faces(
    field: Field, size: tuple[float, float], pose: tuple[float, float, float], sense: float, reach: float
) -> bool:
    """Whether a body (length, width; m) at a pose (m, rad) has such a thing squarely before it within `reach` (m).
    sense: 1.0 before it, -1.0 behind it.
    """
    nearest, farthest = np.inf, 0.0
    for k in range(RAYS):
        far = _far(field, size, pose, (sense, size[1] * (k / (RAYS - 1) - 0.5), reach))
        nearest, farthest = min(nearest, far), max(farthest, far)
        if far >= reach or farthest - nearest > FLAT:
            return False
    there, beside = nearest + BEHIND, 0.5 * size[1] + BESIDE
    left, right = _far(field, size, pose, (sense, beside, there)), _far(field, size, pose, (sense, -beside, there))
    return min(left, right) >= there


@kernel
def _far(field, size, pose, ray):
    """m from the front of a body to what is blocked ahead of it, at most about `reach`. ray: its sense, m aside, reach
    (m).
    """
    sense, aside, reach = ray
    c, s = sense * math.cos(pose[2]), sense * math.sin(pose[2])
    x, y = pose[0] + 0.5 * size[0] * c - aside * s, pose[1] + 0.5 * size[0] * s + aside * c
    far = 0.0
    while far < reach:
        free = distance_at(field, x + far * c, y + far * s)
        if free < TOUCHES:
            return far
        far += max(free, STEP)
    return far


class Docked:
    """When and where the robot was brought up to such a thing last. `again`: whether it has been backed off since, and
    is still about there.
    """

    def __init__(self) -> None:
        self.again = False
        self._last: tuple[float, tuple[float, float]] | None = None

    def see(self, t: float, pose: tuple[float, float, float]) -> None:
        """The robot is at a pose (m, rad) at t (s)."""
        if self._last is None:
            return
        since, place = self._last
        away = math.dist(pose[:2], place)
        self.again = self.again or away > BACKED
        if away > GONE or not 0.0 <= t - since <= FORGOTTEN:
            self.again, self._last = False, None

    def brings_up(self, t: float, pose: tuple[float, float, float]) -> None:
        """It is brought up, and at a pose at t."""
        self.again, self._last = False, (t, pose[:2])


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = field_of(LocalGrid(np.zeros((3, 3), bool), 0.1, 0.0, 0.0), 0.2)
    faces(field, (1.0, 0.6), (0.0, 0.0, 0.0), 1.0, 0.5)
