"""A robot that obeys move_base while it is fuzzed, and the judge of what it is told."""

from __future__ import annotations

import math
import random
from typing import TYPE_CHECKING, Any

from sara_common.planar import Pose2D
from sara_lab.fuzz.navigation import fuzz_world as world
from sara_nav.goals.move_base_config import ABORTED, ACTIVE, IDLE, PREEMPTED, SUCCEEDED

if TYPE_CHECKING:
    from sara_nav.costmaps.layered_costmap import LayeredCostmap
    from sara_nav.costmaps.layers.static import StaticLayer
    from sara_nav.goals.move_base_config import StepResult

DT = 0.05
FASTEST, QUICKEST = 0.56, 1.01
"""m/s and rad/s that no planner here exceeds with its parameters."""
ZERO = (0.0, 0.0)


class FuzzFailure(AssertionError):
    """Which input made move_base do what it must not."""


class Trial:
    """One machine, the robot it drives, and what is expected of its next step."""

    def __init__(self, chance: random.Random, tally: dict[str, int]) -> None:
        self.machine, self.offset = world.machine(chance)
        self.tally = tally
        self.calm = chance.choice((0.0, 0.0, 0.7, 0.97, 1.0))
        self.t = chance.choice((0.0, 1.7e9))
        self.pose = Pose2D(1.0, 1.0, 0.0)
        self.told = self.pose
        self.told_at = 0.0
        self.velocity = None
        self.command = ZERO
        self.goal = False
        self.expected = None
        self.strange = False
        first = world.house(chance)
        for layer in self.static():
            layer.set_map(first)

    def costmaps(self) -> tuple[LayeredCostmap, LayeredCostmap]:
        """Return both costmaps."""
        return self.machine.global_costmap, self.machine.local_costmap

    def static(self) -> list[StaticLayer]:
        """Return the static layers."""
        return [costmap.layers['static'] for costmap in self.costmaps()]

    def count(self, what: str) -> None:
        """Note that something came of an input."""
        self.tally[what] = self.tally.get(what, 0) + 1

    def set_goal(self, pose: Pose2D) -> None:
        """Give a goal; a refusal must say why and end in the next step."""
        reason = self.machine.set_goal(pose, self.t)
        self.goal = not reason
        self.expected = ABORTED if reason else None
        self.count('refused' if reason else 'taken')
        if reason and not reason.startswith('Goal refused: '):
            raise FuzzFailure(f'the refusal of {pose} is {reason!r}')
        if not pose.is_finite() and not reason:
            raise FuzzFailure(f'{pose} was taken for a goal')

    def end(self, status: str) -> None:
        """The goal was given up; the next step must say so."""
        if self.goal:
            self.goal, self.expected = False, status

    def step(self) -> StepResult:
        """Let the machine make a step and judge it; the robot obeys."""
        told, at = (self.told, self.told_at) if self.strange else (self.pose, self.t)
        local = None if self.offset is None or told is None else self.offset.compose(told) if told.is_finite() else told
        result = self.machine.step(self.t, told, self.velocity, at, local)
        fault = self.fault(result, told, at)
        if fault:
            raise FuzzFailure(f'{fault}; {result}')
        if result.status in (SUCCEEDED, PREEMPTED, ABORTED):
            self.goal = False
        self.expected, self.strange = None, False
        self.command = result.command
        self.pose = self.pose.advance(*self.command, DT)
        self.velocity = None
        self.t += DT
        return result

    def fault(self, result: Any, told: Any, at: Any) -> str:
        """Return what is wrong with a result, '' when nothing is."""
        v, w = result.command
        if not (math.isfinite(v) and math.isfinite(w) and abs(v) <= FASTEST and abs(w) <= QUICKEST):
            return 'the command is out of all bounds'
        if self.expected is not None and result.status != self.expected:
            return f'this step should have said {self.expected}'
        if not self.goal and self.expected is None and result.status != IDLE:
            return 'there is no goal, but the machine is not idle'
        if result.status in (SUCCEEDED, PREEMPTED, ABORTED) and not result.text:
            return 'the end is not explained'
        if result.command == ZERO:
            return ''
        if result.status != ACTIVE or not self.goal:
            return 'it moves without a valid goal'
        if told is None or not told.is_finite() or not self.t - at <= self.machine.config.transform_tolerance + 1e-9:
            return 'it moves without knowing where it is'
        if self.machine.local_costmap.current(self.t):
            return f'it moves though {self.machine.local_costmap.current(self.t)}'
        return ''
