"""The end of a drive: come within tolerance, stop, turn to the goal's heading, and be done; without hunting.

The stages are those of base_local_planner's stop-and-rotate controllers. A sampling planner alone may circle just
outside its tolerance for ever, because none of its samples ends nearer; so when the robot no longer gets nearer though
the goal lies within its horizon and the straight way is free, that way is driven: turn to the goal, drive up, stop.
"""

import math
from dataclasses import dataclass

from sara_common.planar import wrap
from sara_nav.sampled.in_place_turn import GIVE_UP, InPlaceTurn, TurnLimits

FOLLOW, FACE, APPROACH, STOP, ROTATE, DONE = (
    'follow path',
    'face goal',
    'approach goal',
    'stop',
    'turn to goal',
    'done',
)
STALL_TIME = 3.0
"""Seconds without getting nearer, inside the horizon, after which the goal is approached straight."""
RIM_TIME = 0.5
"""Seconds for which a robot at the rim of the tolerance may go on towards its middle."""
MAX_APPROACHES = 8


@dataclass(frozen=True)
class GoalLimits:
    """What the end of a drive keeps to, SI units; names as in the planners' parameters. horizon: m, how near the goal
    must be to be approached straight; crawl: m/s, the slowest speed forward that is commanded."""

    xy_goal_tolerance: float
    yaw_goal_tolerance: float
    latch_xy_goal_tolerance: bool
    max_vel_x: float
    max_vel_theta: float
    min_in_place_vel_theta: float
    acc_lim_x: float
    acc_lim_theta: float
    trans_stopped_vel: float
    theta_stopped_vel: float
    horizon: float
    blind: float
    crawl: float = 0.03

    @property
    def turn(self):
        """The TurnLimits of turns in place."""
        return TurnLimits(
            min(self.min_in_place_vel_theta, self.max_vel_theta),
            self.max_vel_theta,
            self.acc_lim_theta,
            self.theta_stopped_vel,
        )


class GoalStage:
    """Which stage of the end of a drive the robot is in, and what to command there."""

    def __init__(self):
        self._turn = InPlaceTurn()
        self.begin()

    def begin(self):
        """Forget the last goal."""
        self.phase = FOLLOW
        self.latched = False
        self.approaches = 0
        self._best = math.inf
        self._best_at = None
        self._inside = None
        self._zero_since = None
        self._turn.begin()

    def failed(self, pose, goal):
        """Return why the goal is given up, '' while it is not."""
        if self.approaches <= MAX_APPROACHES:
            return ''
        return (
            f'the goal cannot be approached to within xy_goal_tolerance ({pose.distance(goal):.3f} m off after '
            f'{MAX_APPROACHES} tries)'
        )

    def update(self, t, dt, pose, velocity, last, goal, limits, ways):
        """Return (v m/s, w rad/s) to command, or None while the path is to be followed; see ``phase`` for the stage.

        pose: Pose2D now. velocity, last: measured and last commanded (v, w). ways: Ways from here.
        """
        self._zero_since = None if last != (0.0, 0.0) else t if self._zero_since is None else self._zero_since
        near = pose.distance(goal)
        if self.phase == FOLLOW:
            self._follow(t, pose, near, goal, limits, ways)
        if self.phase in (FACE, APPROACH):
            command = self._approach(t, dt, pose, velocity, last, near, goal, limits)
            if command is not None:
                return command
        if self.phase == STOP:
            if not self._stands(t, velocity, limits):
                return _slower(last, limits, dt)
            self._judge(near, limits)
        if self.phase in (FACE, APPROACH):
            return 0.0, 0.0
        if self.phase == ROTATE:
            return self._rotate(t, dt, pose, velocity, last, near, goal, limits)
        return None if self.phase == FOLLOW else (0.0, 0.0)

    def take_over(self, pose, goal, limits, ways):
        """Return whether the goal can be approached straight, now that sampling finds nothing; begin so if it can."""
        if pose.distance(goal) > limits.horizon or not ways.straight_is_free(pose, goal):
            return False
        self._to(FACE)
        return True

    # -- stages ------------------------------------------------------------------------------------------------

    def _follow(self, t, pose, near, goal, limits, ways):
        if self._well_inside(t, near, limits):
            # At the rim of the tolerance there may be no room to turn where in its middle there is.
            nearer = not ways.turn_is_free(pose, goal.yaw) and ways.straight_is_free(pose, goal)
            self._to(FACE if nearer else STOP)
            return
        if near > limits.horizon:
            self._best, self._best_at = math.inf, None
        elif limits.xy_goal_tolerance < near <= limits.blind and self.take_over(pose, goal, limits, ways):
            return
        elif near < self._best - 0.02:
            self._best, self._best_at = near, t
        elif t - self._best_at >= STALL_TIME:
            self.take_over(pose, goal, limits, ways)

    def _well_inside(self, t, near, limits):
        """True when it is time to stop: inside the tolerance with a margin, or inside and not getting further in.

        A robot that stops at the very rim finds itself outside when its pose shakes.
        """
        if near > limits.xy_goal_tolerance:
            self._inside = None
            return False
        if self._inside is None:
            self._inside = t
        return near <= 0.85 * limits.xy_goal_tolerance or t - self._inside >= RIM_TIME

    def _to(self, phase):
        if phase == FACE:
            self.approaches += 1
        self.phase = phase
        self._turn.begin()

    def _approach(self, t, dt, pose, velocity, last, near, goal, limits):
        bearing = math.atan2(goal.y - pose.y, goal.x - pose.x)
        error = wrap(bearing - pose.yaw)
        if self.phase == FACE:
            if abs(last[0]) > 0.0 or (
                abs(velocity[0]) > limits.trans_stopped_vel and t - (self._zero_since or t) < GIVE_UP and last[1] == 0.0
            ):
                return _slower(last, limits, dt)
            miss = math.atan2(0.4 * limits.xy_goal_tolerance, near)
            rate = self._turn.rate(t, dt, error, velocity[1], last[1], limits.turn, max(miss, 0.02))
            if rate is not None:
                return 0.0, rate
            self.phase = APPROACH
        left = near * math.cos(error)
        if left <= abs(last[0]) * self._turn.coast + 0.1 * limits.xy_goal_tolerance:
            self.phase = STOP
            return None
        speed = min(
            limits.max_vel_x,
            max(limits.crawl, math.sqrt(limits.acc_lim_x * left)),
            max(limits.crawl, left),
            abs(last[0]) + limits.acc_lim_x * dt,
        )
        turn = min(max(speed * 2.0 * math.sin(error) / max(near, 0.1), -limits.max_vel_theta), limits.max_vel_theta)
        return speed, turn

    def _stands(self, t, velocity, limits):
        if self._zero_since is None:
            return False
        waited = t - self._zero_since
        return waited >= GIVE_UP or (
            abs(velocity[0]) <= limits.trans_stopped_vel and abs(velocity[1]) <= limits.theta_stopped_vel
        )

    def _judge(self, near, limits):
        """Standing: turn to the goal's heading, or approach (once more)."""
        if limits.latch_xy_goal_tolerance:
            self.latched = True
        self._to(ROTATE if self.latched or near <= limits.xy_goal_tolerance else FACE)

    def _rotate(self, t, dt, pose, velocity, last, near, goal, limits):
        if near > limits.xy_goal_tolerance and not self.latched:
            self._to(STOP)
            return _slower(last, limits, dt)
        rate = self._turn.rate(
            t, dt, wrap(goal.yaw - pose.yaw), velocity[1], last[1], limits.turn, limits.yaw_goal_tolerance
        )
        if rate is None:
            self.phase = DONE
            return 0.0, 0.0
        return 0.0, rate


def _slower(last, limits, dt):
    """Return the last command brought towards zero within the accelerations."""
    return tuple(
        math.copysign(max(0.0, abs(speed) - acceleration * dt), speed) if abs(speed) > acceleration * dt else 0.0
        for speed, acceleration in zip(last, (limits.acc_lim_x, limits.acc_lim_theta))
    )
