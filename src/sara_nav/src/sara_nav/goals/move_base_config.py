"""What move_base is told and what it answers: its parameters, the result of a control step, its counters.

Names, units and defaults of the parameters are those of the C++ move_base.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sara_common.config import is_number, range_faults

IDLE, ACTIVE, SUCCEEDED, PREEMPTED, ABORTED = 'idle', 'active', 'succeeded', 'preempted', 'aborted'
PLANNING, CONTROLLING, CLEARING = 'planning', 'controlling', 'clearing'

LIMITS = {
    'controller_frequency': (1.0, 200.0),
    'planner_frequency': (0.0, 100.0),
    'planner_patience': (0.0, 600.0),
    'controller_patience': (0.0, 600.0),
    'max_planning_retries': (-1, 1000),
    'oscillation_timeout': (0.0, 600.0),
    'oscillation_distance': (0.0, 10.0),
    'conservative_reset_dist': (0.0, 50.0),
    'clearing_radius': (0.0, 50.0),
    'transform_tolerance': (0.0, 10.0),
    'localization_patience': (0.0, 60.0),
    'stuck_timeout': (0.0, 600.0),
    'recovery_memory': (0.0, 100.0),
    'lost_limit': (0.0, 1.0),
    'found_limit': (0.0, 1.0),
    'lost_patience': (0.0, 600.0),
}
"""What is allowed, both ends included."""


def lost_limits_faults(config: object) -> list[str]:
    """A sentence where a configuration's `found_limit` is above its `lost_limit`, which would make no hysteresis."""
    found, lost = config.found_limit, config.lost_limit
    if not (is_number(found) and is_number(lost)) or found <= lost:
        return []
    return [f'found_limit is {found!r}, allowed is at most lost_limit, which is {lost!r}']


@dataclass(frozen=True)
class MoveBaseConfig:
    """Parameters of move_base (Hz, s, m), with the peer's meaning but for the following.

    controller_patience: 15 s from start to end; the peer's falls to 5 s at the first dynamic reconfiguration.
    transform_tolerance: the oldest pose that is still driven on, and the longest a robot on its way may be without one:
    then the goal is aborted, so that it never sets off by itself when the pose is back. localization_patience (not the
    peer's): how long a new goal waits for the first pose before it is aborted.

    Not the peer's, and without effect by default: replan_when_blocked: plan anew as soon as the global costmap shows
    something new on the plan, and do not turn back for another map on which the plan is free. stuck_timeout: recover
    when the robot is told to move for so long and does not, 0: never. recovery_memory: a recovery within so many metres
    of where one began before, for the same goal, goes on with the behaviour after the last one there, 0: with the
    first, once what led to it was over. lost_topic: where the localization publishes the probability of being lost;
    from lost_limit on, until it falls to found_limit, the robot stands and the goal waits, lost_patience at most.
    """

    base_global_planner: str = 'navfn/NavfnROS'
    base_local_planner: str = 'base_local_planner/TrajectoryPlannerROS'
    controller_frequency: float = 20.0
    planner_frequency: float = 0.0
    planner_patience: float = 5.0
    controller_patience: float = 15.0
    max_planning_retries: int = -1
    oscillation_timeout: float = 0.0
    oscillation_distance: float = 0.5
    recovery_behavior_enabled: bool = True
    clearing_rotation_allowed: bool = True
    conservative_reset_dist: float = 3.0
    shutdown_costmaps: bool = False
    clearing_radius: float = 0.46
    make_plan_clear_costmap: bool = True
    make_plan_add_unreachable_goal: bool = True
    transform_tolerance: float = 0.5
    localization_patience: float = 1.0
    replan_when_blocked: bool = False
    stuck_timeout: float = 0.0
    recovery_memory: float = 0.0
    lost_topic: str = ''
    lost_limit: float = 0.5
    found_limit: float = 0.2
    lost_patience: float = 30.0

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return range_faults(self, LIMITS) + lost_limits_faults(self)


class StepResult(NamedTuple):
    """What came of one control step.

    command: (v m/s, w rad/s). status: idle, active, succeeded, preempted or aborted; the last three are told once, in
    the step they happen. phase: idle, planning, controlling or clearing. plan: a new plan (n, 3), or None. goal_used:
    the Pose2D a new plan leads to where that is not the goal that was asked for. recovery: (index, how many, name) of a
    recovery behaviour that begins in this step, or None. stale: the sentence that says which sensor is out of date, or
    ''. help: what a person is asked for while the robot waits for that, or ''. doing: what the local planner says it is
    doing while it drives, and why slowly, or ''.
    """

    command: tuple
    status: str
    text: str = ''
    phase: str = IDLE
    plan: np.ndarray = None
    goal_used: object = None
    recovery: tuple = None
    stale: str = ''
    help: str = ''
    doing: str = ''


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
    recoveries: int = 0
    stale_poses: int = 0
    stale_sensors: int = 0
    bad_poses: int = 0
    bad_velocities: int = 0

    def end(self, status: str) -> None:
        """A goal ended so."""
        if status == SUCCEEDED:
            self.succeeded += 1
        elif status == ABORTED:
            self.aborted += 1
        else:
            self.preempted += 1
