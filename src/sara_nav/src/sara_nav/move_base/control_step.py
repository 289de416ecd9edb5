"""What move_base does in a cycle with a plan: drive along it, or recover where it cannot."""

import math

from sara_nav.goals.goal import BY_CONTROL, BY_OSCILLATION, BY_STUCK
from sara_nav.goals.move_base_config import (
    ABORTED,
    ACTIVE,
    CLEARING,
    PLANNING,
    SUCCEEDED,
)
from sara_nav.move_base.robot_state import within_limits
from sara_nav.planners.local_command import DRIVING, FAILED, OFF_PATH, REACHED
from sara_nav.recovery.behaviours import Situation

ZERO = (0.0, 0.0)
"""The command to stand."""


class ControlStep:
    """The controlling and clearing phases of MoveBase; a part of it."""

    def _control(self, goal, t, dt, pose, velocity, age, local_pose, plan):
        c = self.config
        if c.oscillation_timeout > 0.0 and t - goal.oscillation_since > c.oscillation_timeout:
            self._exhausted(
                goal,
                BY_OSCILLATION,
                f'It moved less than {c.oscillation_distance:.2f} m (oscillation_distance) in '
                f'{c.oscillation_timeout:.1f} s (oscillation_timeout)',
                pose,
            )
            return None if self._ended else self._stand(goal, goal.why, plan=plan)
        world = self.costmaps.around(pose, local_pose, self._plans.unknown_blocks)
        command = self.local_planner.update(t, dt, pose, velocity, age, world)
        if command.state == REACHED:
            return self._end(SUCCEEDED, goal.reached())
        if command.state == FAILED:
            return self._end(ABORTED, f'Goal aborted: {command.text}.')
        if command.state == DRIVING:
            goal.valid_control_at = t
            goal.found(BY_CONTROL)
            if not (math.isfinite(command.v) and math.isfinite(command.w)):
                return self._end(ABORTED, f'Goal aborted: the local planner commanded {command.v!r}, {command.w!r}.')
            text = '' if plan is None else goal.moved
            driven = within_limits(command.v, command.w, self.local_planner.config)
            if 0.0 < c.stuck_timeout < goal.stuck_for(t, pose, driven):
                self._exhausted(
                    goal,
                    BY_STUCK,
                    f'It is told to move but has stood for {c.stuck_timeout:.1f} s (stuck_timeout)',
                    pose,
                )
                return None if self._ended else self._stand(goal, goal.why, plan=plan)
            return self._result(driven, ACTIVE, text, goal.phase, plan, goal, doing=command.text)
        self.counters.blocked_steps += 1
        if command.state == OFF_PATH:
            goal.phase = PLANNING
        if t - goal.valid_control_at >= c.controller_patience:
            self._exhausted(
                goal,
                BY_CONTROL,
                f'No safe command was found within controller_patience ({c.controller_patience:.1f} s): {command.text}',
                pose,
            )
        return None if self._ended else self._stand(goal, command.text, plan=plan)

    def _recover(self, goal, t, dt, pose, local_pose, velocity):
        """One cycle of the behaviour whose turn it is; when it is through, planning has its turn."""
        begins = goal.recovery is None
        world = self.costmaps.around(pose, local_pose, self._plans.unknown_blocks)
        situation = Situation(
            t,
            dt,
            pose,
            local_pose,
            velocity,
            world,
            self.costmaps,
            self._track,
            goal.pose,
            goal.why,
            lambda: self._plans.plan(pose, goal.pose),
        )
        if begins:
            self.local_planner.stop()
            self.counters.recoveries += 1
            goal.recovery = self.recoveries[goal.recovery_index]
            goal.recovery.start(situation)
        step = goal.recovery.update(situation)
        announced = (goal.recovery_index, len(self.recoveries), goal.recovery.name) if begins else None
        if step.give_up:
            return self._end(ABORTED, 'Goal aborted: {}.'.format(step.give_up.rstrip('.')))
        if step.done:
            goal.recovered(t)
            self.costmaps.wake()  # what was cleared is to be clear before it is planned on
        return self._result(
            ZERO if step.done else step.command, ACTIVE, step.text, CLEARING, recovery=announced, help=step.help
        )

    def _exhausted(self, goal, trigger, why, pose):
        """Patience is at its end: recover from the next cycle on, or give the goal up when there is nothing left to
        try.
        """
        goal.trigger, goal.why = trigger, why
        goal.take_up(pose, self.config.recovery_memory, self.recoveries)
        if self.config.recovery_behavior_enabled and goal.recovery_index < len(self.recoveries):
            goal.phase, goal.recovery, goal.problem = CLEARING, None, why
        else:
            self._end(ABORTED, f'{trigger} {why}.')
