"""How often the safety gate slows or holds the chair for a pedestrian where none walks.

A sensor's cone that sweeps over an edge sees a distance shrink as it would for a pedestrian who approaches. A detection
that changes nothing of the drive is no stop.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sara_lab.judge.time_split import SLOWING

if TYPE_CHECKING:
    from sara_bringup.lockstep.lockstep import Lockstep
    from sara_sim.chair import SimulatedChair

REACH = 3.5  # m from base_link: ranges are 2.5 m at most, from the edge of the body
APART = 1.0  # s: what follows sooner belongs to the same stop


class FalseStops:
    """Watches a Lockstep: call `after` with it after each step. `count`: of the false stops so far."""

    def __init__(self) -> None:
        self.count = 0
        self._last = -math.inf
        self._counted = False

    def after(self, lockstep: Lockstep) -> None:
        """See whether the gate slows or holds the chair now, and takes something for a pedestrian."""
        wheels = lockstep.wheels
        if not wheels.guard.zones.pedestrian_moving:
            return
        if lockstep.time - self._last > APART:
            self._counted = False
        self._last = lockstep.time
        if not self._counted and wheels.decision.state in SLOWING and not _pedestrian_near(lockstep.chair):
            self.count += 1
            self._counted = True


def _pedestrian_near(chair: SimulatedChair) -> bool:
    """Whether an obstacle that walks is within REACH of the chair."""
    obstacles = chair.world.obstacles
    places = (obstacle.pose(obstacles.time) for obstacle in obstacles.all if obstacle.path)
    return any(place is not None and math.dist(place[:2], chair.pose[:2]) < REACH for place in places)
