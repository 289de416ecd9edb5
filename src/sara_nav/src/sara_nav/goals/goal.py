"""The goal that move_base drives to, and since when things are as they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from sara_common.planar import Pose2D, wrap
from sara_nav.goals.move_base_config import CLEARING, PLANNING, MoveBaseConfig

BY_PLANNING, BY_CONTROL, BY_OSCILLATION, BY_STUCK = (
    'Failed to find a valid plan. Even after executing recovery behaviors.',
    'Failed to find a valid control. Even after executing recovery behaviors.',
    'Robot is oscillating. Even after executing recovery behaviors.',
    'Robot is held. Even after executing recovery behaviors.',
)
"""What leads to recovery, by the peer's last word when recovery is exhausted; the particulars follow it. (The last is
not the peer's.)
"""
STILL = 0.02
"""A robot that has moved less than this (m, rad) has not moved."""


@dataclass
class Goal:
    """A goal (Pose2D, global frame) under way; times in s.

    used: where the plan leads when that is not ``pose``. problem: what to say while the robot stands. valid_control_at:
    the last command, or else the first plan. crossed: m along the plan to something new on it, or None. trigger and
    why: what led to the last recovery; recovery_index: the behaviour whose
    turn is next, recovery: the one under way; recovered_at: where (Pose2D) recoveries began, and which behaviour is
    next there.
    doubted_since: since when it waits, for the robot may be lost; None: it does not.
    begins_anew: a recovery is over, which may have moved the robot: nothing counts as reached any more.
    has_plan: it is planned anew, but for the map alone: there is a plan that was good on the one before.
    """

    pose: Pose2D
    set_at: float
    phase: str = PLANNING
    used: Pose2D = None
    last_plan_try: float = -math.inf
    planning_since: float = None
    tries: int = 0
    valid_control_at: float = None
    pose_at: float = None
    stale_since: float = None
    problem: str = ''
    oscillation_pose: Pose2D = None
    oscillation_since: float = None
    trigger: str = ''
    why: str = ''
    crossed: float = None
    still_pose: Pose2D = None
    still_since: float = None
    recovered_at: list = field(default_factory=list)
    recovery_index: int = 0
    recovery: object = None
    begins_anew: bool = False
    has_plan: bool = False
    doubted_since: float = None

    def watch_oscillation(self, t: float, pose: Pose2D, distance: float) -> None:
        """Take note of the robot's pose: ``distance`` (m) from where it was last noted it is getting on."""
        if self.oscillation_pose is None or pose.distance(self.oscillation_pose) >= distance:
            self.oscillation_pose, self.oscillation_since = pose, t
            for trigger in (BY_OSCILLATION, BY_STUCK) if self.phase != CLEARING else ():
                self.found(trigger)

    def excuse_standing(self) -> None:
        """It is not in vain that the robot has stood until now."""
        self.still_pose = None
        if self.recovery is not None:
            self.recovery.excuse_standing()

    def stuck_for(self, t: float, pose: Pose2D, command: tuple[float, float]) -> float:
        """The robot is at a Pose2D and told to drive (v m/s, w rad/s); return for how long (s) it has been told so in
        vain.
        """
        still = self.still_pose
        if (
            command == (0.0, 0.0)
            or still is None
            or pose.distance(still) > STILL
            or abs(wrap(pose.yaw - still.yaw)) > STILL
        ):
            self.still_pose, self.still_since = pose, t
        return t - self.still_since

    def take_up(self, pose: Pose2D, memory: float, recoveries: Sequence = ()) -> None:
        """Recovery begins at a Pose2D: it goes on where one within ``memory`` (m) of there ended, and remembers this
        one.

        A robot that is held has a plan and a safe command: clearing costmaps is passed over for it, where there is more
        to do.
        """
        if memory > 0.0:
            near = [index for place, index in self.recovered_at if pose.distance(place) <= memory]
            self.recovery_index = max([self.recovery_index, *near])
        if self.trigger == BY_STUCK:
            more = (
                i for i, r in enumerate(recoveries) if i >= self.recovery_index and not getattr(r, 'clears_only', False)
            )
            self.recovery_index = next(more, self.recovery_index)
        if memory > 0.0:
            self.recovered_at.append((pose, self.recovery_index + 1))

    def found(self, trigger: str) -> None:
        """What led to recovery has passed: the next one begins with the first behaviour."""
        if self.trigger == trigger:
            self.recovery_index, self.trigger = 0, ''

    def recovered(self, t: float) -> None:
        """A behaviour is through: plan anew, with fresh patience; the next recovery takes the next one."""
        self.recovery_index += 1
        self.recovery, self.phase, self.problem, self.begins_anew = None, PLANNING, '', True
        self.planning_since, self.last_plan_try, self.oscillation_since = None, -math.inf, t
        self.still_pose = None

    def plan_failed(self, t: float, config: MoveBaseConfig) -> str:
        """One more try to plan failed, for ``problem``; return why that was the last, or ''."""
        self.tries += 1
        if 0 <= config.max_planning_retries < self.tries:
            return (
                f'No plan was found in {self.tries} tries (max_planning_retries is '
                f'{config.max_planning_retries}): {self.problem}'
            )
        if t - self.planning_since >= config.planner_patience - 1e-6:
            return f'No plan was found within planner_patience ({config.planner_patience:.1f} s): {self.problem}'
        return ''

    def lost(self, t: float, config: MoveBaseConfig) -> bool:
        """There is no pose of the robot; return whether that is so for as long as it may be."""
        if self.pose_at is None:
            return t - self.set_at >= config.localization_patience - 1e-6
        return t - self.pose_at > config.transform_tolerance

    def stale_for(self, t: float) -> float:
        """A sensor is out of date; return for how long (s) so far."""
        self.stale_since = t if self.stale_since is None else self.stale_since
        return t - self.stale_since

    def doubted_for(self, t: float) -> float:
        """The robot may be lost; return for how long (s) so far."""
        self.doubted_since = t if self.doubted_since is None else self.doubted_since
        return t - self.doubted_since

    def lead_to(self, used: Pose2D | None) -> bool:
        """Note where the plan leads (Pose2D or None: to ``pose``); return True when that is another place than
        before.
        """
        if used is not None and used.distance(self.pose) < 1e-6:
            used = None
        elsewhere = used != self.used
        self.used = used
        return elsewhere

    @property
    def moved(self) -> str:
        """The sentence that says that the plan does not lead to ``pose``, or ''."""
        if self.used is None:
            return ''
        return (
            f'the goal ({self.pose.x:.2f}, {self.pose.y:.2f}) cannot be reached: driving to ({self.used.x:.2f}, '
            f'{self.used.y:.2f}), {self.used.distance(self.pose):.2f} m from it (default_tolerance)'
        )

    def reached(self) -> str:
        """Return the sentence of success."""
        if self.used is None:
            return 'Goal reached.'
        return (
            f'Goal reached: ({self.used.x:.2f}, {self.used.y:.2f}), {self.used.distance(self.pose):.2f} m from '
            'the one asked for.'
        )
