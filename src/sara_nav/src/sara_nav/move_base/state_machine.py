"""The state machine that takes a goal and drives the robot there: plan, control, recover, give up with a reason.

Its states, patience and texts are those of the C++ move_base. It knows nothing of ROS: a shell gives it goals, the
time, the robot's pose and velocity, feeds the layers of its costmaps, and sends its commands on. Whatever goes wrong,
the command of that step is zero.
"""

import math

from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.goals.driven_path import Track
from sara_nav.goals.goal import BY_PLANNING, Goal
from sara_nav.goals.move_base_config import (
    ABORTED,
    ACTIVE,
    CLEARING,
    CONTROLLING,
    IDLE,
    PLANNING,
    PREEMPTED,
    Counters,
    StepResult,
)
from sara_nav.goals.plan_maker import PlanMaker
from sara_nav.move_base.control_step import ZERO, ControlStep
from sara_nav.move_base.robot_state import RobotState, sound


class MoveBase(ControlStep):
    """Drives one goal at a time: plans on the global costmap, steers and looks for collisions on the local one.

    config: MoveBaseConfig. global_costmap, local_costmap: LayeredCostmaps; the machine updates both when they are due.
    global_planner, local_planner: objects of the registered classes. recoveries: behaviours (recovery.py), in their
    order. Poses and goals are Pose2D in the global costmap's frame.
    """

    def __init__(self, config, global_costmap, local_costmap, global_planner, local_planner, recoveries=()):
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        self.config = config
        self.costmaps = CostmapPair(global_costmap, local_costmap)
        self.global_costmap, self.local_costmap = global_costmap, local_costmap
        self.local_planner = local_planner
        self.recoveries = tuple(recoveries)
        self.counters = Counters()
        self._plans = PlanMaker(global_planner, self.costmaps, self.counters)
        self._goal = None
        self._ended = None
        self._state = RobotState(self.counters)
        self._command = ZERO
        self._track = Track()

    @property
    def active(self):
        """True while there is a goal."""
        return self._goal is not None

    @property
    def goal(self):
        """The Pose2D that was asked for, or None."""
        return self._goal.pose if self._goal else None

    @property
    def global_planner(self):
        """The object that plans."""
        return self._plans.planner

    @property
    def costmaps_run(self):
        """False while shutdown_costmaps keeps the costmaps still, because there is no goal."""
        return self._goal is not None or not self.config.shutdown_costmaps

    def refusal(self, pose, t):
        """Return why a goal cannot be taken at t (s), '' when it can.

        A goal where the footprint would overlap something is refused, unless the planner has a default_tolerance within
        which it may move the goal.
        """
        self.costmaps.ensure(t)
        tolerance = getattr(self.global_planner.config, 'default_tolerance', 0.0)
        return self.costmaps.refusal(pose, tolerance <= 0.0, self._plans.unknown_blocks)

    def set_goal(self, pose, t):
        """Take a goal (Pose2D) at time t (s); one being driven to is preempted without a stop between.

        Returns '' or the reason why it is refused; then the robot stands and the next step says aborted.
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
        if reason:
            self._end(ABORTED, reason)
            return reason
        self._goal = Goal(pose, t)
        return ''

    def cancel(self, t, text='Goal cancelled.'):
        """Give the goal up; the next step commands zero and says preempted."""
        if self._goal is not None:
            self._end(PREEMPTED, text)

    def abort(self, text):
        """Give the goal up because something the shell knows of went wrong; the next step says aborted."""
        if self._goal is not None:
            self._end(ABORTED, text)

    def excuse_standing(self):
        """Who stops the robot lets somebody pass now: until here it has not been stuck."""
        if self._goal is not None:
            self._goal.excuse_standing()

    def take_end(self):
        """Return (status, text) of an end that no step has told yet, or None; no step will tell it any more."""
        end, self._ended = self._ended, None
        return end

    def replan(self):
        """Build both costmaps and plan anew in the next step, because the map is another one."""
        self.costmaps.wake()
        if self._goal is not None and self._goal.phase != CLEARING:
            self._goal.phase, self._goal.last_plan_try = PLANNING, -math.inf

    def reconfigure(self, config, global_planner=None, local_planner=None, recoveries=None):
        """Go on with another configuration and, where given, other planners and behaviours; a goal is planned anew
        then.
        """
        self.config = config
        self._plans.planner = global_planner or self._plans.planner
        if recoveries is not None:
            self.recoveries = tuple(recoveries)
        if local_planner is not None:
            self.local_planner.stop()
            self.local_planner = local_planner
        if global_planner or local_planner or recoveries is not None:
            self.restart()

    def restart(self):
        """Go on to the goal as if it had just been given, because a planner or a behaviour is another one."""
        if self._goal is not None:
            self._goal = Goal(self._goal.pose, self._goal.set_at, pose_at=self._goal.pose_at)

    def make_plan(self, t, start, goal, tolerance=0.0, give_up=lambda: False):
        """Return (plan (n, 3) or None, text): see goal_search. Raises ValueError where no plan can be asked for."""
        self.costmaps.ensure(t)
        if self.active:
            raise ValueError('move_base must be in an inactive state to make a plan for an external user')
        return self._plans.search(start, goal, tolerance, self.config, give_up)

    def step(self, t, pose, velocity=None, pose_time=None, local_pose=None):
        """Return the StepResult of one control cycle.

        t: now (s). pose: Pose2D, or None when there is none. pose_time: when it was measured (s), t when not given.
        velocity: measured (v m/s, w rad/s), or None: then it is reckoned from the commands. local_pose: the pose in the
        local costmap's frame, where that is another.
        """
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
        if self.costmaps_run:
            self.costmaps.update(t, pose if known else None, local_pose if known else None)
        if age is not None and (self._goal is None or self._goal.phase != CLEARING):
            self._track.keep(local_pose or pose)
        plan = None
        if self._ended is None and self._goal is not None:
            result = self._pursue(self._goal, t, dt, pose, velocity, age, local_pose)
            if self._ended is None:
                return result
            plan = result.plan if result else None
        end = self.take_end()
        return self._result(ZERO, *end, plan=plan) if end else self._result(ZERO, IDLE)

    def _pursue(self, goal, t, dt, pose, velocity, age, local_pose):
        if age is None:
            return self._without_pose(goal, t)
        goal.pose_at = t - age
        goal.watch_oscillation(t, pose, self.config.oscillation_distance)
        stale = self.local_costmap.current(t)
        if stale:
            return self._out_of_date(goal, t, stale)
        goal.stale_since = None
        if goal.phase == CLEARING:
            return self._recover(goal, t, dt, pose, local_pose or pose, velocity)
        plan = self._plan_if_due(goal, t, pose)
        if self._ended is not None:
            return None
        if goal.phase != CONTROLLING:
            return self._stand(goal, goal.problem)
        return self._control(goal, t, dt, pose, velocity, age, local_pose, plan)

    def _without_pose(self, goal, t):
        text = f'no pose of the robot newer than {self.config.transform_tolerance:.2f} s (transform_tolerance)'
        if goal.lost(t, self.config):
            return self._end(ABORTED, f'Goal aborted: there is {text}.')
        return self._stand(goal, text)

    def _out_of_date(self, goal, t, stale):
        self.counters.stale_sensors += 1
        text = f"Sensor data is out of date, we're not going to allow commanding of the base for safety: {stale}"
        if goal.stale_for(t) >= self.config.controller_patience:
            return self._end(
                ABORTED, f'Goal aborted: {text} for controller_patience ({self.config.controller_patience:.1f} s).'
            )
        return self._stand(goal, text, stale)

    def _plan_if_due(self, goal, t, pose):
        """Plan when that is due; return the new plan or None."""
        if not self._plans.due(goal, t, pose, self.config):
            return None
        plan, why = self._plans.make(goal, t, pose, self.config)
        if why:
            self._exhausted(goal, BY_PLANNING, why, pose)
        if plan is None:
            return None
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
        return plan

    def _end(self, status, text):
        self._goal = None
        self._ended = (status, text)
        self.local_planner.stop()
        self.counters.end(status)

    def _stand(self, goal, text, stale='', plan=None):
        self.local_planner.stop()
        return self._result(ZERO, ACTIVE, text, goal.phase, plan, goal, stale=stale)

    def _result(
        self, command, status, text='', phase=IDLE, plan=None, goal=None, recovery=None, stale='', help='', doing=''
    ):
        self._command = command
        used = goal.used if goal is not None and plan is not None else None
        return StepResult(command, status, text, phase, plan, used, recovery, stale, help, doing)
