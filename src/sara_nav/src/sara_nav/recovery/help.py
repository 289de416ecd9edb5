"""Recovery by asking: the robot stands, says in one sentence what is wrong and what a person could do, and waits.

Once a second it tries to plan. Where the way was blocked it goes on as soon as it is free. When its patience is over it
leaves the goal to the next behaviour, or to one more try.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_common.config import range_faults
from sara_common.planar import Pose2D
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import LETHAL
from sara_nav.planners.planning import PlanError, distances_along
from sara_nav.recovery.behaviours import RECOVERIES, Recovery, RecoveryStep, Situation

PERIOD = 1.0
"""Seconds between two tries to plan."""
SIDES = (
    'ahead',
    'ahead on the left',
    'on the left',
    'behind on the left',
    'behind',
    'behind on the right',
    'on the right',
    'ahead on the right',
)


@dataclass(frozen=True)
class AskForHelpConfig:
    """patience: s it waits. look_ahead: m of a new plan along which the footprint must be free on the local costmap.
    nearby: m from the footprint within which what stands there is told of.
    """

    patience: float = 30.0
    look_ahead: float = 1.0
    nearby: float = 1.0

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return range_faults(self, {'patience': (1.0, 3600.0), 'look_ahead': (0.0, 100.0), 'nearby': (0.0, 10.0)})


@RECOVERIES.register('sara_nav/AskForHelp')
class AskForHelp(Recovery):
    """Waits for a person; see the module."""

    config_class = AskForHelpConfig

    def __init__(self, name: str, config: AskForHelpConfig | None = None) -> None:
        super().__init__(name, config)
        self._began = self._tried = -math.inf
        self._was_blocked = False
        self._sentence = ''

    def start(self, situation: Situation) -> None:
        """Begin."""
        self._began = self._tried = situation.t
        self._was_blocked = self._way(situation) is None
        near = nearest_obstacle(situation.world, situation.pose, self.config.nearby)
        self._sentence = (
            'Help, please: I cannot get on to ({:.2f}, {:.2f}). {}. {} Please {}, or drive me on by hand.'.format(
                situation.goal.x,
                situation.goal.y,
                situation.why.rstrip('.'),
                'The nearest thing stands {:.2f} m {}.'.format(*near) if near else 'Nothing stands near me.',
                'see what holds me' if not self._was_blocked else 'clear the way' if near else 'open a way for me',
            )
        )

    def update(self, situation: Situation) -> RecoveryStep:
        """Stand, and look whether the way is free."""
        waited = situation.t - self._began
        if self._was_blocked and situation.t - self._tried >= PERIOD - 1e-3:
            self._tried = situation.t
            if self._way(situation) is not None:
                return RecoveryStep(text=f'{self.name}: the way is free')
        if waited >= self.config.patience:
            return RecoveryStep(text=f'{self.name}: nobody helped for {waited:.0f} s (patience)')
        return RecoveryStep(
            done=False,
            text=f'{self._sentence} ({self.name}: waiting {self.config.patience:.0f} s)',
            help=self._sentence,
        )

    def _way(self, situation):
        """Return a plan (n, 3) whose beginning the footprint can follow, or None."""
        try:
            plan = situation.plan()
        except PlanError:
            return None
        along = distances_along(plan)
        poses = np.vstack(
            [[situation.pose.x, situation.pose.y, situation.pose.yaw], plan[along <= self.config.look_ahead]]
        )
        return None if situation.world.worsens(poses) else plan


def nearest_obstacle(world: LocalWorld, pose: Pose2D, within: float) -> tuple[float, str] | None:
    """Return (m from the box about the footprint, which side) of the obstacle nearest to a robot at a Pose2D, or None
    beyond ``within``.
    """
    g = world.geometry
    x, y, yaw = world.to_local([[pose.x, pose.y, pose.yaw]])[0]
    rows, columns = np.nonzero(world.costmap.costs == LETHAL)
    if not len(rows):
        return None
    cx, cy = g.to_world(columns, rows)
    c, s = math.cos(yaw), math.sin(yaw)
    u, v = c * (cx - x) + s * (cy - y), c * (cy - y) - s * (cx - x)
    low, high = world.footprint.min(axis=0), world.footprint.max(axis=0)
    aside = np.maximum(np.maximum(low[0] - u, u - high[0]), 0.0), np.maximum(np.maximum(low[1] - v, v - high[1]), 0.0)
    gaps = np.hypot(*aside)
    k = int(gaps.argmin())
    if gaps[k] > within:
        return None
    # The side as the footprint has it: what lies before the front edge is ahead, however near it is to a corner.
    front = math.copysign(aside[0][k], u[k]) if aside[0][k] else 0.0
    left = math.copysign(aside[1][k], v[k]) if aside[1][k] else 0.0
    if not (front or left):
        front, left = u[k], v[k]
    return float(gaps[k]), SIDES[round(math.atan2(left, front) / (math.pi / 4)) % 8]
