"""The end of a drive: come within tolerance, stop, turn to the goal's heading, and be done; without hunting.

The stages are those of base_local_planner's stop-and-rotate controllers. A sampling planner alone may circle just
outside its tolerance for ever, because none of its samples ends nearer; so when the robot no longer gets nearer though
the goal lies within its horizon and the straight way is free, that way is driven: turn to the goal, drive up, stop.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sara_common.planar import Pose2D, wrap
from sara_nav.grids.free_motions import Ways
from sara_nav.sampled.in_place_turn import GIVE_UP, InPlaceTurn, Rates, TurnLimits

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
    def turn(self) -> TurnLimits:
        """The TurnLimits of turns in place."""
        return TurnLimits(
            min(self.min_in_place_vel_theta, self.max_vel_theta),
            self.max_vel_theta,
            self.acc_lim_theta,
            self.theta_stopped_vel,
        )


class Cycle(NamedTuple):
    """What a control cycle of a sampling planner begins with. t, dt: s. pose: where the robot is now, goal: global
    frame. velocity: measured, last: commanded last (v m/s, w rad/s). ways: from here.
    """

    t: float
    dt: float
    pose: Pose2D
    velocity: tuple[float, float]
    last: tuple[float, float]
    goal: Pose2D
    limits: GoalLimits
    ways: Ways

    @property
    def near(self) -> float:
        """The distance to the goal (m)."""
        return self.pose.distance(self.goal)

    @property
    def rates(self) -> Rates:
        """The turn rates."""
        return Rates(self.velocity[1], self.last[1])

    def slower(self) -> tuple[float, float]:
        """Return the last command brought towards zero within the accelerations."""
        v, w = self.last
        return _nearer_zero(v, self.limits.acc_lim_x * self.dt), _nearer_zero(w, self.limits.acc_lim_theta * self.dt)


class GoalStage:
    """Which stage of the end of a drive the robot is in, and what to command there."""

    def __init__(self):
        self._turn = InPlaceTurn()
        self.begin()

    def begin(self) -> None:
        """Forget the last goal."""
        self.phase = FOLLOW
        self.latched = False
        self.approaches = 0
        self._best = math.inf
        self._best_at = None
        self._inside = None
        self._zero_since = None
        self._turn.begin()

    def failed(self, pose: Pose2D, goal: Pose2D) -> str:
        """Return why the goal is given up, '' while it is not."""
        if self.approaches <= MAX_APPROACHES:
            return ''
        return (
            f'the goal cannot be approached to within xy_goal_tolerance ({pose.distance(goal):.3f} m off after '
            f'{MAX_APPROACHES} tries)'
        )

    def update(self, cycle: Cycle) -> tuple[float, float] | None:
        """Return (v m/s, w rad/s) to command, or None while the path is to be followed; see ``phase`` for the stage."""
        if cycle.last != (0.0, 0.0):
            self._zero_since = None
        elif self._zero_since is None:
            self._zero_since = cycle.t
        if self.phase == FOLLOW:
            self._follow(cycle)
        if self.phase in (FACE, APPROACH):
            command = self._approach(cycle)
            if command is not None:
                return command
        if self.phase == STOP:
            if not self._stands(cycle):
                return cycle.slower()
            self._judge(cycle)
        if self.phase in (FACE, APPROACH):
            return 0.0, 0.0
        if self.phase == ROTATE:
            return self._rotate(cycle)
        return None if self.phase == FOLLOW else (0.0, 0.0)

    def take_over(self, cycle: Cycle) -> bool:
        """Return whether the goal can be approached straight, now that sampling finds nothing; begin so if it can."""
        if cycle.near > cycle.limits.horizon or not cycle.ways.straight_is_free(cycle.pose, cycle.goal):
            return False
        self._to(FACE)
        return True

    # -- stages ------------------------------------------------------------------------------------------------

    def _follow(self, cycle):
        t, near, limits, ways = cycle.t, cycle.near, cycle.limits, cycle.ways
        if self._well_inside(t, near, limits):
            # At the rim of the tolerance there may be no room to turn where in its middle there is.
            nearer = not ways.turn_is_free(cycle.pose, cycle.goal.yaw) and ways.straight_is_free(cycle.pose, cycle.goal)
            self._to(FACE if nearer else STOP)
            return
        if near > limits.horizon:
            self._best, self._best_at = math.inf, None
        elif limits.xy_goal_tolerance < near <= limits.blind and self.take_over(cycle):
            return
        elif near < self._best - 0.02:
            self._best, self._best_at = near, t
        elif t - self._best_at >= STALL_TIME:
            self.take_over(cycle)

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

    def _approach(self, cycle):
        """Turn to the goal, then drive up to it; None once it is to stop."""
        limits, goal, near, last = cycle.limits, cycle.goal, cycle.near, cycle.last
        error = wrap(math.atan2(goal.y - cycle.pose.y, goal.x - cycle.pose.x) - cycle.pose.yaw)
        if self.phase == FACE:
            if self._still_drives(cycle):
                return cycle.slower()
            miss = math.atan2(0.4 * limits.xy_goal_tolerance, near)
            rate = self._turn.rate(cycle.t, cycle.dt, error, cycle.rates, limits.turn, max(miss, 0.02))
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
            abs(last[0]) + limits.acc_lim_x * cycle.dt,
        )
        turn = min(max(speed * 2.0 * math.sin(error) / max(near, 0.1), -limits.max_vel_theta), limits.max_vel_theta)
        return speed, turn

    def _still_drives(self, cycle):
        """True while the robot goes on, or is told to, so that it may not be turned in place yet."""
        if abs(cycle.last[0]) > 0.0:
            return True
        waited = cycle.t - (self._zero_since or cycle.t)
        drives = abs(cycle.velocity[0]) > cycle.limits.trans_stopped_vel
        return drives and waited < GIVE_UP and cycle.last[1] == 0.0

    def _stands(self, cycle):
        if self._zero_since is None:
            return False
        v, w = cycle.velocity
        stands = abs(v) <= cycle.limits.trans_stopped_vel and abs(w) <= cycle.limits.theta_stopped_vel
        return stands or cycle.t - self._zero_since >= GIVE_UP

    def _judge(self, cycle):
        """Standing: turn to the goal's heading, or approach (once more)."""
        if cycle.limits.latch_xy_goal_tolerance:
            self.latched = True
        self._to(ROTATE if self.latched or cycle.near <= cycle.limits.xy_goal_tolerance else FACE)

    def _rotate(self, cycle):
        limits = cycle.limits
        if cycle.near > limits.xy_goal_tolerance and not self.latched:
            self._to(STOP)
            return cycle.slower()
        error = wrap(cycle.goal.yaw - cycle.pose.yaw)
        rate = self._turn.rate(cycle.t, cycle.dt, error, cycle.rates, limits.turn, limits.yaw_goal_tolerance)
        if rate is None:
            self.phase = DONE
            return 0.0, 0.0
        return 0.0, rate


def _nearer_zero(speed, most):
    """Return a speed brought towards zero by at most so much."""
    return math.copysign(max(0.0, abs(speed) - most), speed) if abs(speed) > most else 0.0
