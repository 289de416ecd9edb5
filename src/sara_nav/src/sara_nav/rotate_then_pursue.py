"""A local planner for a chair: turn in place the short way, drive the leg by pursuit, stop gently, turn to the goal.

Pursuit is Coulter's pure pursuit (1992) with the speed regulated by curvature and by the way that is left: it is planned
within the limits of acceleration and jerk, so that what smooths commands further on has nothing to change. The
state is predicted forward over the age of the pose and the lag of the drive before anything is computed from it;
without that, a chair whose pose comes late turns too far and has to turn back.
"""
import math
from dataclasses import dataclass, field

from sara_nav.geometry import Pose2D, wrap
from sara_nav.local_command import BLOCKED, FAILED, LOCAL_PLANNERS, OFF_PATH, REACHED, LocalCommand
from sara_nav.path_tracker import Leg, split_legs
from sara_nav.smooth_speed import SpeedLimits, next_speed
from sara_nav.ways import arc

CREEP = 0.02
"""The slowest speed (m/s) of the end of a leg, which would else be neared for ever."""
# Phases of one goal, in their order.
TURN, FOLLOW, SETTLE, FINAL_TURN, DONE = 'turn to path', 'follow path', 'settle', 'turn to goal', 'done'


def approach_speed(left, deceleration, gain=2.0):
    """Return the speed at which to come to rest in ``left`` (m or rad) braking no harder than ``deceleration``.

    v = gain * left near the end, sqrt(2 a (left - a / (2 gain^2))) before, where both have the same slope: braking is
    even, and the end is reached without a jolt and without an endless crawl.
    """
    if left <= deceleration / (gain * gain):
        return gain * max(left, 0.0)
    return math.sqrt(2.0 * deceleration * (left - 0.5 * deceleration / (gain * gain)))


@dataclass(frozen=True)
class RotateThenPursueConfig:
    """Limits and tolerances, SI units; where the name is the peers', so is the meaning."""

    max_vel_x: float = 0.5
    max_vel_theta: float = 0.4
    min_in_place_vel_theta: float = 0.05
    acc_lim_x: float = 0.4
    dec_lim_x: float = 0.8
    comfort_dec_x: float = 0.4
    jerk_lim_x: float = 0.8
    acc_lim_theta: float = 0.8
    comfort_dec_theta: float = 0.3
    xy_goal_tolerance: float = 0.05
    yaw_goal_tolerance: float = 0.035
    lookahead_time: float = 1.4
    min_lookahead: float = 0.5
    max_lookahead: float = 0.9
    corner_angle: float = 0.5
    turn_first_angle: float = 0.08
    turn_in_place_angle: float = 0.7
    max_path_distance: float = 0.5
    drive_latency: float = 0.12
    trans_stopped_vel: float = 0.02
    theta_stopped_vel: float = 0.03
    settle_time: float = 0.25

    def faults(self):
        """Return a list of sentences, one for each bad value."""
        result = []
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            zero_allowed = name in ('drive_latency', 'settle_time')
            high = math.pi if name.endswith('_angle') else 10.0
            if not (math.isfinite(value) and value <= high and (value > 0.0 or (zero_allowed and value == 0.0))):
                result.append('%s is %r but must be a number %s 0 and <= %.4g' % (
                    name, value, '>=' if zero_allowed else '>', high))
        if not result and self.max_lookahead < self.min_lookahead:
            result.append('max_lookahead is %r but must be at least min_lookahead (%r)' % (
                self.max_lookahead, self.min_lookahead))
        return result


@dataclass
class _Progress:
    """What is remembered about the goal being driven to."""

    legs: list = field(default_factory=list)
    leg: int = 0
    phase: str = DONE
    turn_sign: float = 0.0
    holding: bool = False
    still_since: float = None
    approaches: int = 0


@LOCAL_PLANNERS.register('sara_nav/RotateThenPursue')
class RotateThenPursue:
    """Drives a plan; see the module. One object drives one goal after the other."""

    config_class = RotateThenPursueConfig
    MAX_APPROACHES = 4

    def __init__(self, config=RotateThenPursueConfig()):
        self.config = config
        self.goal = None
        self._p = _Progress()
        self._last = (0.0, 0.0)
        self._acceleration = 0.0   # of the speed along the leg, m/s2
        self._speed_limits = SpeedLimits(config.acc_lim_x, config.comfort_dec_x, config.jerk_lim_x)

    @property
    def phase(self):
        """Name of the phase: turn to path, follow path, settle, turn to goal, done."""
        return self._p.phase

    def start(self, plan):
        """Begin a new goal: plan (n, 3), its last row the goal."""
        self.goal = Pose2D(*(float(v) for v in plan[-1]))
        self._p = _Progress(legs=split_legs(plan, self.config.corner_angle), phase=TURN)

    def replan(self, plan):
        """Take a better plan to the same goal; what has been reached stays reached."""
        if self._p.phase in (SETTLE, FINAL_TURN, DONE):
            return
        self._p.legs = split_legs(plan, self.config.corner_angle)
        self._p.leg = 0

    def stop(self):
        """Forget the last command, because the robot was told to stop at once."""
        self._last = (0.0, 0.0)

    def update(self, t, dt, pose, velocity, pose_age, checker):
        """Return the LocalCommand for time t (s).

        dt: since the last command (s). pose: Pose2D as it was pose_age seconds ago. velocity: measured (v, w).
        checker: LocalWorld of the local costmap.
        """
        p, c = self._p, self.config
        now = pose.advance(velocity[0], velocity[1], pose_age + c.drive_latency)
        still = self._still(t, velocity)
        if p.phase == TURN and p.leg == 0 and p.approaches == 0 and pose.distance(self.goal) <= c.xy_goal_tolerance:
            p.phase = FINAL_TURN
        if p.phase == SETTLE and still:
            self._settled(pose)
            if p.phase == FINAL_TURN and p.approaches > self.MAX_APPROACHES:
                self._last = (0.0, 0.0)
                return LocalCommand(0.0, 0.0, FAILED, 'the goal cannot be approached to within xy_goal_tolerance '
                                    '(%.3f m off after %d tries)' % (pose.distance(self.goal), p.approaches))
        if p.phase == TURN:
            wanted = self._turn_to_leg(now, velocity)
        elif p.phase == FINAL_TURN:
            wanted = self._turn_to_goal(now, pose, velocity, still)
        else:
            wanted = 0.0, 0.0
        if p.phase == DONE:
            self._last = (0.0, 0.0)
            return LocalCommand(0.0, 0.0, REACHED)
        if p.phase == FOLLOW:
            leg = p.legs[p.leg]
            leg.locate(now.x, now.y)
            if leg.offset > c.max_path_distance:
                self._last = (0.0, 0.0)
                return LocalCommand(0.0, 0.0, OFF_PATH, 'the robot is %.2f m off its path' % leg.offset)
            wanted = self._follow(leg, now, dt)
        if p.phase != FOLLOW:
            self._acceleration = 0.0
        return self._checked(now, self._limited(wanted, dt), checker)

    # -- phases ------------------------------------------------------------------------------------------------

    def _turn_to_leg(self, now, velocity):
        p, c = self._p, self.config
        leg = p.legs[p.leg]
        leg.locate(now.x, now.y)
        x, y = leg.point_ahead(c.min_lookahead)
        heading = now.yaw + (math.pi if leg.backward else 0.0)
        error = wrap(math.atan2(y - now.y, x - now.x) - heading)
        # A turn once begun is finished properly; a leg that needs hardly any is left to the pursuit.
        enough = 0.25 * c.turn_first_angle if p.turn_sign else c.turn_first_angle
        if abs(error) <= enough:
            p.phase, p.turn_sign = FOLLOW, 0.0
            return 0.0, 0.0
        if abs(velocity[0]) > 2.0 * c.trans_stopped_vel and abs(self._last[0]) > 0.0:
            return 0.0, 0.0
        return 0.0, self._turn_rate(error)

    def _turn_to_goal(self, now, pose, velocity, still):
        p, c = self._p, self.config
        error = wrap(self.goal.yaw - now.yaw)
        if p.holding:
            if not still:
                return 0.0, 0.0
            if abs(wrap(self.goal.yaw - pose.yaw)) <= c.yaw_goal_tolerance:
                p.phase = DONE
                return 0.0, 0.0
            p.holding = False
        if abs(error) <= 0.2 * c.yaw_goal_tolerance:
            p.holding, p.still_since = True, None
            return 0.0, 0.0
        return 0.0, self._turn_rate(error)

    def _turn_rate(self, error):
        """Return the rate (rad/s) that stops at ``error`` = 0 with comfort_dec_theta, slower still at the very end.

        Near half a turn either way is as short: the side first chosen is kept, so that noise cannot swap it.
        """
        p, c = self._p, self.config
        sign = math.copysign(1.0, error)
        if p.turn_sign and abs(error) > 2.6:
            sign = p.turn_sign
        p.turn_sign = sign
        size = abs(error)
        rate = min(c.max_vel_theta, approach_speed(size, c.comfort_dec_theta))
        return sign * max(rate, c.min_in_place_vel_theta)

    def _follow(self, leg, now, dt):
        p, c = self._p, self.config
        left = leg.left
        if left <= 0.01:
            if p.leg + 1 < len(p.legs):
                p.leg, p.phase, p.turn_sign = p.leg + 1, TURN, 0.0
            else:
                p.phase, p.still_since = SETTLE, None
            return 0.0, 0.0
        lookahead = min(max(c.lookahead_time * abs(self._last[0]), c.min_lookahead), c.max_lookahead)
        x, y = leg.point_ahead(lookahead)
        heading = now.yaw + (math.pi if leg.backward else 0.0)
        bearing = wrap(math.atan2(y - now.y, x - now.x) - heading)
        if abs(bearing) > c.turn_in_place_angle:
            p.phase, p.turn_sign = TURN, 0.0
            return 0.0, 0.0
        curvature = 2.0 * math.sin(bearing) / max(math.hypot(x - now.x, y - now.y), 0.1)
        highest, before = min(c.max_vel_x, c.max_vel_theta / max(abs(curvature), 1e-6)), abs(self._last[0])
        speed, self._acceleration = next_speed(before, self._acceleration, left, highest, self._speed_limits, dt)
        speed = min(speed, max(highest, before - c.dec_lim_x * dt))  # a bend that comes suddenly is braked for harder
        if self._acceleration <= 0.0:
            speed = max(speed, CREEP)
        return (-speed if leg.backward else speed), speed * curvature

    def _settled(self, pose):
        """Standing still at the end of the last leg: go on to the turn, or approach once more."""
        p, c = self._p, self.config
        p.turn_sign = 0.0
        if pose.distance(self.goal) <= c.xy_goal_tolerance:
            p.phase = FINAL_TURN
            return
        p.approaches += 1
        if p.approaches > self.MAX_APPROACHES:
            p.phase = FINAL_TURN
            return
        bearing = wrap(math.atan2(self.goal.y - pose.y, self.goal.x - pose.x) - pose.yaw)
        backward = abs(bearing) > 0.5 * math.pi and pose.distance(self.goal) < 0.3
        p.legs = [Leg([(pose.x, pose.y), (self.goal.x, self.goal.y)], backward)]
        p.leg, p.phase = 0, TURN

    # -- limits ------------------------------------------------------------------------------------------------

    def _still(self, t, velocity):
        """True once the robot has been commanded to stand, and measured standing, for settle_time."""
        p, c = self._p, self.config
        if (self._last != (0.0, 0.0) or abs(velocity[0]) > c.trans_stopped_vel
                or abs(velocity[1]) > c.theta_stopped_vel):
            p.still_since = None
        elif p.still_since is None:
            p.still_since = t
        return p.still_since is not None and t - p.still_since >= c.settle_time

    def _limited(self, wanted, dt):
        """Return wanted (v, w) brought within the accelerations of the last command."""
        c = self.config
        v0, w0 = self._last
        v, w = wanted
        toward_zero = abs(v) < abs(v0) or v * v0 < 0.0
        step = (c.dec_lim_x if toward_zero else c.acc_lim_x) * dt
        v = min(max(v, v0 - step), v0 + step)
        step = c.acc_lim_theta * dt
        w = min(max(w, w0 - step), w0 + step)
        return v, w

    def _checked(self, now, command, checker):
        """Return the command, or a slower one, along whose stopping way the footprint touches nothing new."""
        v, w = command
        for scale in (1.0, 0.5, 0.2):
            if (v == 0.0 and w == 0.0) or not checker.worsens(self._stopping_way(now, scale * v, scale * w)):
                self._last = (scale * v, scale * w)
                self._acceleration *= scale == 1.0
                return LocalCommand(*self._last)
        self._last = (0.0, 0.0)
        return LocalCommand(0.0, 0.0, BLOCKED, 'an obstacle is in the way of the footprint while it is to %s' % (
            self._p.phase if v == 0.0 else 'drive'))

    def _stopping_way(self, now, v, w):
        """Return poses (n, 3) from ``now`` along the arc (v, w) until the robot would stand, and a margin."""
        c = self.config
        reaction = 0.2
        way = abs(v) * reaction + v * v / (2.0 * c.dec_lim_x) + (0.03 if v else 0.0)
        angle = abs(w) * reaction + w * w / (2.0 * c.acc_lim_theta) + (0.02 if w else 0.0)
        duration = max(way / abs(v) if v else 0.0, angle / abs(w) if w and not v else 0.0)
        steps = max(2, math.ceil(max(way, 0.6 * angle) / 0.04))
        return arc(now, v, w, duration, steps)
