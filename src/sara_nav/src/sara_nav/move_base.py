"""The state machine that takes a goal and drives the robot there: plan, control, give up with a reason.

Names of parameters and the meaning of patience are those of the C++ move_base. It knows nothing of ROS: a shell
gives it goals, the time, the robot's pose and velocity, and sends its commands on. Whatever goes wrong, the command
of that step is zero.
"""
import math
from dataclasses import dataclass

import numpy as np

from sara_nav import local_planner as lp
from sara_nav.collision import CollisionChecker
from sara_nav.grid_planner import GLOBAL_PLANNERS
from sara_nav.local_planner import LOCAL_PLANNERS
from sara_nav.planning import PlanError

IDLE, ACTIVE, SUCCEEDED, PREEMPTED, ABORTED = 'idle', 'active', 'succeeded', 'preempted', 'aborted'
PLANNING, CONTROLLING = 'planning', 'controlling'
REPLAN_PERIOD = 1.0
"""Seconds between two tries to plan while there is no valid plan or the way is blocked."""


@dataclass(frozen=True)
class MoveBaseConfig:
    """Parameters of move_base (Hz, s, m). transform_tolerance: the oldest pose that is still driven on, and the longest
    a robot on its way may be without one: then the goal is aborted, so that it never sets off by itself when the pose is
    back. localization_patience: how long a new goal waits for the first pose before it is aborted."""

    base_global_planner: str = 'sara_nav/GridPlanner'
    base_local_planner: str = 'sara_nav/RotateThenPursue'
    controller_frequency: float = 20.0
    planner_frequency: float = 0.0
    planner_patience: float = 5.0
    controller_patience: float = 15.0
    transform_tolerance: float = 0.5
    localization_patience: float = 1.0

    def faults(self):
        """Return a list of sentences, one for each bad value."""
        result = []
        for name, low, high in (('controller_frequency', 1.0, 200.0), ('planner_frequency', 0.0, 50.0),
                                ('planner_patience', 0.0, 600.0), ('controller_patience', 0.0, 600.0),
                                ('transform_tolerance', 0.0, 10.0), ('localization_patience', 0.0, 60.0)):
            value = getattr(self, name)
            if not (math.isfinite(value) and low <= value <= high):
                result.append('%s is %r but must be in %g..%g' % (name, value, low, high))
        for registry, name in ((GLOBAL_PLANNERS, self.base_global_planner), (LOCAL_PLANNERS, self.base_local_planner)):
            try:
                registry.find(name)
            except ValueError as error:
                result.append(str(error))
        return result


@dataclass(frozen=True)
class StepResult:
    """What came of one control step.

    status: idle, active, succeeded, preempted or aborted; the last three are told once, in the step they happen.
    phase: idle, planning or controlling. plan: a new plan (n, 3), or None. command: (v m/s, w rad/s).
    """

    command: tuple
    status: str
    text: str = ''
    phase: str = IDLE
    plan: np.ndarray = None


@dataclass
class _Goal:
    """A goal being driven to, and since when things are as they are (s)."""

    pose: object
    set_at: float
    phase: str = PLANNING
    last_plan_try: float = -math.inf
    planning_since: float = None
    valid_control_at: float = None
    pose_at: float = None
    started: bool = False
    problem: str = ''


@dataclass
class Counters:
    """What happened since the start."""

    goals: int = 0
    succeeded: int = 0
    preempted: int = 0
    aborted: int = 0
    plans: int = 0
    failed_plans: int = 0
    blocked_steps: int = 0
    stale_poses: int = 0
    bad_poses: int = 0
    bad_velocities: int = 0


class MoveBase:
    """Drives one goal at a time over a static costmap.

    costmap: Costmap, or None until ``set_costmap``. footprint: corners (k, 2) in metres.
    global_planner, local_planner: objects of the registered classes; made with their defaults when not given.
    Poses and goals are Pose2D in the costmap's frame.
    """

    def __init__(self, config, footprint, costmap=None, global_planner=None, local_planner=None):
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        self.config = config
        self.footprint = np.asarray(footprint, float)
        self.global_planner = global_planner or GLOBAL_PLANNERS.find(config.base_global_planner)()
        self.local_planner = local_planner or LOCAL_PLANNERS.find(config.base_local_planner)()
        self.counters = Counters()
        self.costmap = None
        self.checker = None
        self._goal = None
        self._ended = None
        self._last_t = None
        self._model = (0.0, 0.0)
        self._command = (0.0, 0.0)
        if costmap is not None:
            self.set_costmap(costmap)

    # -- what the shell calls ----------------------------------------------------------------------------------

    def set_costmap(self, costmap):
        """Drive on this Costmap from now on; a goal being driven to is planned anew."""
        self.costmap = costmap
        unknown_blocks = not getattr(self.global_planner.config, 'allow_unknown', False)
        self.checker = CollisionChecker(costmap, self.footprint, unknown_blocks)
        if self._goal is not None:
            self._goal.last_plan_try = -math.inf
            self._goal.phase = PLANNING

    @property
    def active(self):
        """True while there is a goal."""
        return self._goal is not None

    @property
    def goal(self):
        """The Pose2D being driven to, or None."""
        return self._goal.pose if self._goal else None

    def refusal(self, pose):
        """Return why a goal cannot be taken, '' when it can."""
        if self.costmap is None:
            return 'Goal refused: there is no map yet.'
        if not pose.is_finite():
            return 'Goal refused: it holds a NaN or an infinity.'
        if self.costmap.geometry.to_cell(pose.x, pose.y) is None:
            return 'Goal refused: (%.2f, %.2f) is off the map.' % (pose.x, pose.y)
        if self.checker.collides(pose):
            return ('Goal refused: at (%.2f, %.2f, %.0f deg) the footprint would overlap an obstacle, unknown space '
                    'or the edge of the map.' % (pose.x, pose.y, math.degrees(pose.yaw)))
        return ''

    def set_goal(self, pose, t):
        """Take a goal (Pose2D) at time t (s); one being driven to is preempted without a stop between.

        Returns '' or the reason why it is refused; then the robot stands and the next step says aborted.
        """
        self.counters.goals += 1
        if self._goal is not None:
            self.counters.preempted += 1
        self._ended = None
        self._goal = None
        reason = self.refusal(pose)
        if reason:
            self._end(ABORTED, reason)
            return reason
        self._goal = _Goal(pose, t)
        return ''

    def cancel(self, t, text='Goal cancelled.'):
        """Give the goal up; the next step commands zero and says preempted."""
        if self._goal is not None:
            self._end(PREEMPTED, text)

    def abort(self, text):
        """Give the goal up because something the shell knows of went wrong; the next step says aborted."""
        if self._goal is not None:
            self._end(ABORTED, text)

    def step(self, t, pose, velocity=None, pose_time=None):
        """Return the StepResult of one control cycle.

        t: now (s). pose: Pose2D, or None when there is none. pose_time: when it was measured (s), t when not
        given. velocity: measured (v m/s, w rad/s), or None: then it is reckoned from the commands.
        """
        dt = self._elapsed(t)
        if dt is None:
            self.abort('Time jumped back; the goal is given up.')
            dt = 0.0
        velocity = self._velocity(velocity, dt)
        if self._ended is not None:
            (status, text), self._ended = self._ended, None
            return self._result((0.0, 0.0), status, text)
        goal = self._goal
        if goal is None:
            return self._result((0.0, 0.0), IDLE)
        age = self._pose_age(t, pose, pose_time)
        if age is None:
            return self._without_pose(goal, t)
        goal.pose_at = t - age
        plan = self._plan_if_due(goal, t, pose)
        if self._ended is not None:
            return self.step(t, pose, velocity, pose_time)
        if goal.phase == PLANNING:
            self.local_planner.stop()
            return self._result((0.0, 0.0), ACTIVE, goal.problem, PLANNING)
        return self._control(goal, t, dt, pose, velocity, age, plan)

    # -- inside ------------------------------------------------------------------------------------------------

    def _end(self, status, text):
        self._goal = None
        self._ended = (status, text)
        self.local_planner.stop()
        if status == SUCCEEDED:
            self.counters.succeeded += 1
        elif status == ABORTED:
            self.counters.aborted += 1
        else:
            self.counters.preempted += 1

    def _result(self, command, status, text='', phase=IDLE, plan=None):
        self._command = command
        return StepResult(command, status, text, phase, plan)

    def _elapsed(self, t):
        """Return the seconds since the last step, at most three periods; None when time went back."""
        last, self._last_t = self._last_t, t
        period = 1.0 / self.config.controller_frequency
        if last is None:
            return period
        if t < last - 1e-6:
            return None
        return min(max(t - last, 0.0), 3.0 * period)

    def _velocity(self, velocity, dt):
        """Return the measured velocity when it is sound, else one reckoned from the commands with a lag of 0.1 s."""
        share = 1.0 - math.exp(-dt / 0.1)
        self._model = tuple(m + share * (c - m) for m, c in zip(self._model, self._command))
        if velocity is None:
            return self._model
        if not (math.isfinite(velocity[0]) and math.isfinite(velocity[1])):
            self.counters.bad_velocities += 1
            return self._model
        return velocity

    def _pose_age(self, t, pose, pose_time):
        """Return how old the pose is (s), or None when it cannot be driven on."""
        if pose is None:
            return None
        if not pose.is_finite() or (pose_time is not None and not math.isfinite(pose_time)):
            self.counters.bad_poses += 1
            return None
        age = 0.0 if pose_time is None else t - pose_time
        if age > self.config.transform_tolerance:
            self.counters.stale_poses += 1
            return None
        return max(age, 0.0)

    def _without_pose(self, goal, t):
        self.local_planner.stop()
        text = 'no pose of the robot newer than %.2f s (transform_tolerance)' % self.config.transform_tolerance
        if goal.pose_at is None:
            lost = t - goal.set_at >= self.config.localization_patience - 1e-6
        else:
            lost = t - goal.pose_at > self.config.transform_tolerance
        if lost:
            self._end(ABORTED, 'Goal aborted: there is %s.' % text)
            (status, text), self._ended = self._ended, None
            return self._result((0.0, 0.0), status, text)
        return self._result((0.0, 0.0), ACTIVE, text, goal.phase)

    def _plan_if_due(self, goal, t, pose):
        """Plan when there is no plan, or planner_frequency says so; return the new plan or None."""
        waiting = goal.phase == PLANNING
        period = REPLAN_PERIOD if waiting or not self.config.planner_frequency else 1.0 / self.config.planner_frequency
        blocked = goal.valid_control_at is not None and t - goal.valid_control_at >= REPLAN_PERIOD
        if not (waiting or blocked or self.config.planner_frequency) or t - goal.last_plan_try < period:
            return None
        goal.last_plan_try = t
        if waiting and goal.planning_since is None:
            goal.planning_since = t
        try:
            plan = self.global_planner.plan(self.costmap, pose, goal.pose)
        except PlanError as error:
            self.counters.failed_plans += 1
            goal.problem = str(error)
            if waiting and t - goal.planning_since >= self.config.planner_patience:
                self._end(ABORTED, 'Goal aborted: no plan was found within planner_patience (%.1f s): %s.' % (
                    self.config.planner_patience, error))
            return None
        self.counters.plans += 1
        if goal.started:
            self.local_planner.replan(plan)
        else:
            self.local_planner.start(plan)
        if waiting:
            goal.valid_control_at = t
        goal.started, goal.phase, goal.planning_since, goal.problem = True, CONTROLLING, None, ''
        return plan

    def _control(self, goal, t, dt, pose, velocity, age, plan):
        command = self.local_planner.update(t, dt, pose, velocity, age, self.checker)
        if command.state == lp.REACHED:
            self._end(SUCCEEDED, 'Goal reached.')
        elif command.state == lp.FAILED:
            self._end(ABORTED, 'Goal aborted: %s.' % command.text)
        elif command.state == lp.DRIVING:
            goal.valid_control_at = t
        else:
            self.counters.blocked_steps += 1
            if command.state == lp.OFF_PATH:
                goal.phase = PLANNING
            if t - goal.valid_control_at >= self.config.controller_patience:
                self._end(ABORTED, 'Goal aborted: no safe command was found within controller_patience (%.1f s): %s.'
                          % (self.config.controller_patience, command.text))
        if self._ended is not None:
            (status, text), self._ended = self._ended, None
            return self._result((0.0, 0.0), status, text, IDLE, plan)
        return self._result((command.v, command.w), ACTIVE, command.text, goal.phase, plan)
