"""How far the drive to one goal has come: its phases, and what is remembered between control cycles."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.plan_stages import Stretch, final_angle, stages
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig

# Phases of one goal, in their order; turning to a leg and following it come in turns.
TURN, FOLLOW, SETTLE, FINAL_TURN, DONE = 'turn to path', 'follow path', 'settle', 'turn to goal', 'done'

LOST = 0.2
"""What was reached stays reached, unless the robot is farther from it than this (m): pushed away, or the pose is
another one now.
"""


@dataclass
class Progress:
    """stages: what is left of the plan (plan_stages), the leg or turn under way first. leg: the Leg of that, once it
    was begun. final_angle: how the plan turns at its end (rad). holding: the final turn is over, and rest is waited
    for. approaches: repairs of the place so far.
    """

    stages: list = field(default_factory=list)
    leg: Leg = None
    phase: str = DONE
    final_angle: float = 0.0
    holding: bool = False
    still_since: float = None
    approaches: int = 0
    fresh: bool = True

    def take(self, plan: np.ndarray, corner_angle: float) -> None:
        """Go on along a plan (n, 3), from its beginning."""
        self.stages, self.final_angle = stages(plan, corner_angle), final_angle(plan)
        self.phase, self.leg, self.fresh = TURN, None, True

    def drive_to(self, points: Sequence[tuple[float, float]], backward: bool) -> None:
        """Go on along a straight line between two points ((x, y), (x, y))."""
        self.stages, self.leg, self.phase = [Stretch(points, backward, False)], None, TURN

    def next_stage(self) -> None:
        """The stage under way is over: the next has its turn, or rest at the goal."""
        self.stages.pop(0)
        self.leg, self.phase = None, TURN if self.stages else SETTLE
        if not self.stages:
            self.still_since = None

    def is_lost(self, distance: float) -> bool:
        """True when the goal that was reached is ``distance`` (m) away, too far to count as reached: another plan is to
        be taken.
        """
        if distance > LOST:
            self.phase = TURN
        return distance > LOST

    def begins_at_goal(self, distance: float, tolerance: float) -> bool:
        """True, once for each plan, when it begins within ``tolerance`` of the goal and leads nowhere else. distance:
        to the goal, m.
        """
        fresh, self.fresh = self.fresh, False
        if not fresh or self.approaches or distance > tolerance:
            return False
        return (
            sum(math.dist(a, b) for s in self.stages if isinstance(s, Stretch) for a, b in zip(s.points, s.points[1:]))
            <= 2.0 * tolerance
        )

    def is_still(
        self, t: float, velocity: tuple[float, float], commanded: tuple[float, float], config: RotateThenPursueConfig
    ) -> bool:
        """True once the robot has been commanded to stand, and measured standing, for settle_time; to be asked in each
        cycle.
        """
        if (
            commanded != (0.0, 0.0)
            or abs(velocity[0]) > config.trans_stopped_vel
            or abs(velocity[1]) > config.theta_stopped_vel
        ):
            self.still_since = None
        elif self.still_since is None:
            self.still_since = t
        return self.still_since is not None and t - self.still_since >= config.settle_time
