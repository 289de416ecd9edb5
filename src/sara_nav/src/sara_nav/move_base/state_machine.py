"""The state machine that takes a goal and drives the robot there: plan, control, recover, give up with a reason.

Its states, patience and texts are those of the C++ move_base. It knows nothing of ROS: a shell gives it goals, the
time, the robot's pose and velocity, feeds the layers of its costmaps, and sends its commands on. Whatever goes wrong,
the command of that step is zero.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.costmaps.layered_costmap import LayeredCostmap
from sara_nav.goals.driven_path import Track
from sara_nav.goals.goal import BY_PLANNING, Goal
from sara_nav.goals.move_base_config import (
    ABORTED,
    CLEARING,
    CONTROLLING,
    IDLE,
    PLANNING,
    PREEMPTED,
    Counters,
    MoveBaseConfig,
    StepResult,
)
from sara_nav.goals.plan_maker import PlanMaker
from sara_nav.move_base.control_step import ZERO, ControlStep, Cycle, End, Means, exhausted, standing
from sara_nav.move_base.lost import LostWatch
from sara_nav.move_base.robot_state import RobotState, sound
from sara_nav.move_base.waiting import in_doubt, out_of_date, without_pose

FAR = 2.0
"""m: what is farther from the robot than this, its sensors do not see well enough to refuse a goal for it."""


class MoveBase:
    """Drives one goal at a time: plans on the global costmap, steers and looks for collisions on the local one.

    config: MoveBaseConfig. global_costmap, local_costmap: LayeredCostmaps; the machine updates both when they are due.
    global_planner, local_planner: objects of the registered classes. recoveries: behaviours (recovery.py), in their
    order. Poses and goals are Pose2D in the global costmap's frame. ``before_planning`` is called before a plan that
    may take longer than the robot may drive without a command: it is to send a zero.
    """

    def __init__(
        self,
        config: MoveBaseConfig,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
        global_planner: Any,
        local_planner: Any,
        recoveries: Sequence = (),
    ):
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        self.config = config
        self.costmaps = CostmapPair(global_costmap, local_costmap)
        self.global_costmap, self.local_costmap = global_costmap, local_costmap
        self.local_planner = local_planner
        self.recoveries = tuple(recoveries)
        self.counters = Counters()
        self.before_planning: Callable[[], None] = lambda: None
        self.plans = PlanMaker(global_planner, self.costmaps, self.counters, lambda: self.before_planning())
        self._goal = None
        self._ended = None
        self._lets_pass = False
        self._pose = None  # the last that was sound
        self._state = RobotState(self.counters)
        self.lost = LostWatch()
        self._command = ZERO
        self._track = Track()
        self._steps = ControlStep(self.costmaps, self.plans, self.counters, self._track)

    @property
    def active(self) -> bool:
        """True while there is a goal."""
        return self._goal is not None

    @property
    def goal(self) -> Pose2D | None:
        """The Pose2D that was asked for, or None."""
        return self._goal.pose if self._goal else None

    @property
    def global_planner(self) -> Any:
        """The object that plans."""
        return self.plans.planner

    @property
    def costmaps_run(self) -> bool:
        """False while shutdown_costmaps keeps the costmaps still, because there is no goal."""
        return self._goal is not None or not self.config.shutdown_costmaps

    def refusal(self, pose: Pose2D, t: float) -> str:
        """Return why a goal cannot be taken at t (s), '' when it can.

        A goal where the footprint would overlap something is refused, unless the planner has a default_tolerance within
        which it may move the goal.
        """
        self.costmaps.ensure(t)
        tolerance = getattr(self.global_planner.config, 'default_tolerance', 0.0)
        return self.costmaps.refusal(pose, tolerance <= 0.0, self.plans.unknown_blocks)

    def set_goal(self, pose: Pose2D, t: float) -> str:
        """Take a goal (Pose2D) at time t (s); one being driven to is preempted without a stop between.

        What sensors saw at a goal far away is forgotten. Returns '' or the reason why it is refused; then the robot
        stands and the next step says aborted.
        """
        self.counters.goals += 1
        if self._goal is not None:
            self.counters.preempted += 1
        if not self.costmaps_run:
            self.costmaps.update(t, None, None)
            self.costmaps.wake()
        self._ended = None
        self._goal = None
        reason = self.refusal(pose, t)
        far = self._pose is not None and pose.distance(self._pose) > FAR
        if reason and far and not self.costmaps.refusal(pose, False, False):
            self.costmaps.forget_about(pose, t)
            reason = self.refusal(pose, t)
        if reason:
            self._end(ABORTED, reason)
            return reason
        self._goal = Goal(pose, t)
        return ''

    def cancel(self, t: float, text: str = 'Goal cancelled.') -> None:
        """Give the goal up; the next step commands zero and says preempted."""
        if self._goal is not None:
            self._end(PREEMPTED, text)

    def abort(self, text: str) -> None:
        """Give the goal up because something the shell knows of went wrong; the next step says aborted."""
        if self._goal is not None:
            self._end(ABORTED, text)

    def excuse_standing(self) -> None:
        """Who stops the robot lets somebody pass now: until here it has not been stuck. The costmaps hear of it in the
        next step.
        """
        self._lets_pass = True
        if self._goal is not None:
            self._goal.excuse_standing()

    def take_end(self) -> tuple[str, str] | None:
        """Return (status, text) of an end that no step has told yet, or None; no step will tell it any more."""
        end, self._ended = self._ended, None
        return end

    def replan(self) -> None:
        """Build both costmaps and plan anew in the next step, because the map is another one."""
        self.costmaps.wake()
        if self._goal is not None and self._goal.phase != CLEARING:
            self._goal.has_plan = self._goal.has_plan or self._goal.phase == CONTROLLING
            self._goal.phase, self._goal.last_plan_try = PLANNING, -math.inf

    def reconfigure(
        self,
        config: MoveBaseConfig,
        global_planner: Any = None,
        local_planner: Any = None,
        recoveries: Sequence | None = None,
    ) -> None:
        """Go on with another configuration and, where given, other planners and behaviours; a goal is planned anew
        then.
        """
        self.config = config
        self.plans.planner = global_planner or self.plans.planner
        if recoveries is not None:
            self.recoveries = tuple(recoveries)
        if local_planner is not None:
            self.local_planner.stop()
            self.local_planner = local_planner
        if global_planner or local_planner or recoveries is not None:
            self.restart()

    def restart(self) -> None:
        """Go on to the goal as if it had just been given, because a planner or a behaviour is another one."""
        if self._goal is not None:
            self._goal = Goal(self._goal.pose, self._goal.set_at, pose_at=self._goal.pose_at)

    def make_plan(
        self, t: float, start: Pose2D, goal: Pose2D, tolerance: float = 0.0, give_up: Callable[[], bool] = lambda: False
    ) -> tuple[np.ndarray | None, str]:
        """Return (plan (n, 3) or None, text): see goal_search. Raises ValueError where no plan can be asked for."""
        self.costmaps.ensure(t)
        if self.active:
            raise ValueError('move_base must be in an inactive state to make a plan for an external user')
        return self.plans.search(start, goal, tolerance, self.config, give_up)

    def step(
        self,
        t: float,
        pose: Pose2D | None,
        velocity: tuple[float, float] | None = None,
        pose_time: float | None = None,
        local_pose: Pose2D | None = None,
    ) -> StepResult:
        """Return the StepResult of one control cycle.

        t: now (s). pose: Pose2D, or None when there is none. pose_time: when it was measured (s), t when not given.
        velocity: measured (v m/s, w rad/s), or None: then it is reckoned from the commands. local_pose: the pose in the
        local costmap's frame, where that is another.
        """
        if self._lets_pass:
            self._lets_pass = False
            self.costmaps.let_pass(t)
        dt = self._state.elapsed(t, 1.0 / self.config.controller_frequency)
        if dt is None:
            self.abort('Goal aborted: time jumped back.')
            dt = 0.0
        velocity = self._state.velocity(velocity, self._command, dt)
        age = self._state.pose_age(t, pose, pose_time, self.config.transform_tolerance)
        local_sound = local_pose is None or sound(local_pose)
        if not local_sound:
            age = None
        known = local_sound and pose is not None and sound(pose)
        self._pose = pose if known else self._pose
        if self.costmaps_run:
            self.costmaps.update(t, pose if known else None, local_pose if known else None)
        if age is not None and (self._goal is None or self._goal.phase != CLEARING):
            self._track.keep(local_pose or pose)
        result = StepResult(ZERO, IDLE)
        if self._ended is None and self._goal is not None:
            result = self._pursue(self._goal, Cycle(t, dt, pose, velocity, age, local_pose))
            if isinstance(result, End):
                self._end(*result)
        end = self.take_end()
        if end:
            result = StepResult(ZERO, *end)
        self._command = result.command
        return result

    def _pursue(self, goal, cycle):
        """Return the StepResult of a cycle with a goal, or its End."""
        t, pose = cycle.t, cycle.pose
        if cycle.age is None:
            return without_pose(goal, t, self._means)
        goal.pose_at = t - cycle.age
        doubt = self.lost.doubt(t, self.config)
        if doubt:
            if goal.doubted_since is None:
                self.restart()  # what was planned, or tried to get free, is of a pose that may be wrong
            return in_doubt(self._goal, t, doubt, self.lost.help(t), self._means)
        goal.doubted_since = None
        goal.watch_oscillation(t, pose, self.config.oscillation_distance)
        stale = self.local_costmap.current(t)
        if stale:
            self.counters.stale_sensors += 1
            return out_of_date(goal, t, stale, self._means)
        goal.stale_since = None
        if goal.phase == CLEARING:
            return self._steps.recover(goal, cycle, self._means)
        plan, end = self._plan_if_due(goal, t, pose)
        if end:
            return end
        if goal.phase != CONTROLLING:
            return standing(goal, self._means, goal.problem)
        return self._steps.control(goal, cycle._replace(plan=plan), self._means)

    @property
    def _means(self):
        return Means(self.config, self.local_planner, self.recoveries)

    def _plan_if_due(self, goal, t, pose):
        """Plan when that is due; return (the new plan or None, the End of the goal or None)."""
        if not self.plans.due(goal, t, pose, self.config):
            return None, None
        plan, why = self.plans.make(goal, t, pose, self.config)
        if plan is None:
            return None, exhausted(goal, self._means, BY_PLANNING, why, pose) if why else None
        if (
            goal.lead_to(getattr(self.global_planner, 'goal_used', None))
            or goal.valid_control_at is None
            or goal.begins_anew
        ):
            self.local_planner.start(plan)
            goal.begins_anew = False
        else:
            self.local_planner.replan(plan)
        if goal.valid_control_at is None:
            goal.valid_control_at = t
        goal.found(BY_PLANNING)
        goal.phase, goal.planning_since, goal.problem = CONTROLLING, None, ''
        return plan, None

    def _end(self, status, text):
        self._goal = None
        self._ended = (status, text)
        self.local_planner.stop()
        self.counters.end(status)
