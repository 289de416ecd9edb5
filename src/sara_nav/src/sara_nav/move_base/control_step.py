"""What move_base does in a cycle with a plan: drive along it, or recover where it cannot."""

import math
from typing import Any, NamedTuple

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.goals.driven_path import Track
from sara_nav.goals.goal import BY_CONTROL, BY_OSCILLATION, BY_STUCK, Goal
from sara_nav.goals.move_base_config import (
    ABORTED,
    ACTIVE,
    CLEARING,
    PLANNING,
    SUCCEEDED,
    Counters,
    MoveBaseConfig,
    StepResult,
)
from sara_nav.goals.plan_maker import PlanMaker
from sara_nav.move_base.robot_state import within_limits
from sara_nav.planners.local_command import DRIVING, FAILED, OFF_PATH, REACHED
from sara_nav.recovery.behaviours import Situation

ZERO = (0.0, 0.0)
"""The command to stand."""


class Cycle(NamedTuple):
    """What a control cycle begins with. t: now, dt: since the last one, age: of the pose (s; None: there is none that
    can be driven on). velocity: (v m/s, w rad/s). local_pose: in the local costmap's frame, where that is another.
    plan: one that was made in this cycle.
    """

    t: float
    dt: float
    pose: Pose2D | None
    velocity: tuple[float, float]
    age: float | None
    local_pose: Pose2D | None
    plan: np.ndarray | None = None


class Means(NamedTuple):
    """What may be configured anew while a goal is under way: local_planner of a registered class, and recoveries:
    behaviours in their order.
    """

    config: MoveBaseConfig
    local_planner: Any
    recoveries: tuple


class End(NamedTuple):
    """The goal is over: succeeded or aborted, and why."""

    status: str
    text: str


def standing(goal: Goal, means: Means, text: str, plan: np.ndarray | None = None, stale: str = '') -> StepResult:
    """Return the StepResult of a cycle in which the robot is told to stand; what it stood before was not in vain."""
    means.local_planner.stop()
    goal.excuse_standing()
    return StepResult(ZERO, ACTIVE, text, goal.phase, plan, _used(goal, plan), stale=stale)


def exhausted(goal: Goal, means: Means, trigger: str, why: str, pose: Pose2D) -> End | None:
    """Patience is at its end: recover from the next cycle on, or return the End when there is nothing left to try."""
    goal.trigger, goal.why = trigger, why
    goal.take_up(pose, means.config.recovery_memory, means.recoveries)
    if means.config.recovery_behavior_enabled and goal.recovery_index < len(means.recoveries):
        goal.phase, goal.recovery, goal.problem = CLEARING, None, why
        return None
    return End(ABORTED, f'{trigger} {why}.')


class ControlStep:
    """The controlling and clearing phases of MoveBase. track: the way the robot came by."""

    def __init__(self, costmaps: CostmapPair, plans: PlanMaker, counters: Counters, track: Track):
        self._costmaps, self._plans, self._counters, self._track = costmaps, plans, counters, track

    def control(self, goal: Goal, cycle: Cycle, means: Means) -> StepResult | End:
        """One cycle along the plan."""
        c, t = means.config, cycle.t
        if c.oscillation_timeout > 0.0 and t - goal.oscillation_since > c.oscillation_timeout:
            why = (
                f'It moved less than {c.oscillation_distance:.2f} m (oscillation_distance) in '
                f'{c.oscillation_timeout:.1f} s (oscillation_timeout)'
            )
            end = exhausted(goal, means, BY_OSCILLATION, why, cycle.pose)
            return end or standing(goal, means, goal.why, cycle.plan)
        world = self._costmaps.around(cycle.pose, cycle.local_pose, self._plans.unknown_blocks)
        command = means.local_planner.update(t, cycle.dt, cycle.pose, cycle.velocity, cycle.age, world)
        if command.state == REACHED:
            return End(SUCCEEDED, goal.reached())
        if command.state == FAILED:
            return End(ABORTED, f'Goal aborted: {command.text}.')
        if command.state == DRIVING:
            return self._drive(goal, cycle, means, command, world)
        return self._hindered(goal, cycle, means, command)

    def _drive(self, goal, cycle, means, command, world):
        """The local planner has a safe command."""
        c = means.config
        goal.valid_control_at = cycle.t
        goal.found(BY_CONTROL)
        if not (math.isfinite(command.v) and math.isfinite(command.w)):
            return End(ABORTED, f'Goal aborted: the local planner commanded {command.v!r}, {command.w!r}.')
        text = '' if cycle.plan is None else goal.moved
        slow = float(world.speed_share(np.array([cycle.pose]))[0])
        driven = within_limits(command.v, command.w, means.local_planner.config, slow)
        if 0.0 < c.stuck_timeout < goal.stuck_for(cycle.t, cycle.pose, driven):
            why = f'It is told to move but has stood for {c.stuck_timeout:.1f} s (stuck_timeout)'
            end = exhausted(goal, means, BY_STUCK, why, cycle.pose)
            return end or standing(goal, means, goal.why, cycle.plan)
        used = _used(goal, cycle.plan)
        return StepResult(driven, ACTIVE, text, goal.phase, cycle.plan, used, doing=command.text)

    def _hindered(self, goal, cycle, means, command):
        """The local planner has no safe command, or cannot follow the plan from here."""
        patience = means.config.controller_patience
        self._counters.blocked_steps += 1
        if command.state == OFF_PATH:
            goal.phase = PLANNING
        end = None
        if cycle.t - goal.valid_control_at >= patience:
            why = f'No safe command was found within controller_patience ({patience:.1f} s): {command.text}'
            end = exhausted(goal, means, BY_CONTROL, why, cycle.pose)
        return end or standing(goal, means, command.text, cycle.plan)

    def recover(self, goal: Goal, cycle: Cycle, means: Means) -> StepResult:
        """One cycle of the behaviour whose turn it is; when it is through, planning has its turn."""
        begins = goal.recovery is None
        situation = self._situation(goal, cycle)
        if begins:
            means.local_planner.stop()
            self._counters.recoveries += 1
            goal.recovery = means.recoveries[goal.recovery_index]
            goal.recovery.start(situation)
        step = goal.recovery.update(situation)
        announced = (goal.recovery_index, len(means.recoveries), goal.recovery.name) if begins else None
        if step.done:
            goal.recovered(cycle.t)
            self._costmaps.wake()  # what was cleared is to be clear before it is planned on
        command = ZERO if step.done else step.command
        return StepResult(command, ACTIVE, step.text, CLEARING, recovery=announced, help=step.help)

    def _situation(self, goal, cycle):
        """Return the Situation that a behaviour is given."""
        pose, local_pose = cycle.pose, cycle.local_pose or cycle.pose
        return Situation(
            cycle.t,
            cycle.dt,
            pose,
            local_pose,
            cycle.velocity,
            self._costmaps.around(pose, local_pose, self._plans.unknown_blocks),
            self._costmaps,
            self._track,
            goal.pose,
            goal.why,
            lambda: self._plans.plan(pose, goal.pose),
        )


def _used(goal, plan):
    """Return where a new plan leads, when that is not the goal that was asked for."""
    return goal.used if plan is not None else None
