"""A local planner for a chair: turns in place the short way, keeps to the path, slows for what is ahead, ends gently on
the goal.

A plan is taken as it was made, stage by stage (plan_stages): legs forward and in reverse, turns in place between them.
On a leg the law of tracking_law bends towards the path, and speed_plan says how fast; both commands change within their
limits of acceleration and jerk, so that what smooths commands further on has nothing to change. All is computed from
where the robot will be when the command takes effect (prediction); without that, a chair whose pose comes late turns
too far and back.
"""

import math

from sara_common.planar import Pose2D, wrap
from sara_nav.planners.local_command import BLOCKED, DRIVING, LOCAL_PLANNERS, OFF_PATH, REACHED, LocalCommand
from sara_nav.pursuit.curvature_law import TrackingLaw
from sara_nav.pursuit.driving_progress import DONE, FINAL_TURN, FOLLOW, SETTLE, TURN, Progress
from sara_nav.pursuit.goal_approach import GoalApproach
from sara_nav.pursuit.messages import Words, following
from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.plan_stages import Turn
from sara_nav.pursuit.prediction import Prediction
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_speed import approach
from sara_nav.pursuit.speed_plan import BLOCKED as STOPPED
from sara_nav.pursuit.speed_plan import SpeedPlan
from sara_nav.pursuit.stopping_path import blocked_where, stopping_path
from sara_nav.pursuit.turning_in_place import TurningInPlace

SETTING_OUT = 0.05
"""Below this speed (m/s) the curvature is chosen freely: turn rates are small."""
ENDED = 0.01
"""The end of a leg is reached this way (m) before it."""
NEARLY_EXACT = 0.25
"""Share of path_deviation by which a path is smoothed where there is no room for more."""


@LOCAL_PLANNERS.register('sara_nav/RotateThenPursue')
class RotateThenPursue(GoalApproach):
    """Drives a plan; see the module. One object drives one goal after the other."""

    config_class = RotateThenPursueConfig
    MAX_APPROACHES = 4

    def __init__(self, config=RotateThenPursueConfig()):
        self.goal = None
        self._p = Progress()
        self._last = (0.0, 0.0)
        self._last_t = -math.inf
        self._bending = 0.0  # acceleration of the turn rate on a leg, rad/s2
        self._words = Words()
        self._prediction = Prediction(config.drive_latency)
        self.reconfigure(config)

    def reconfigure(self, config):
        """Go on with another configuration; what was learned of the base stays."""
        self.config = config
        self._prediction.latency = config.drive_latency
        self._law = TrackingLaw(config.tracking_length, config.tracking_time)
        self._speed = SpeedPlan(config)
        self._turning = TurningInPlace(config, self._words)

    @property
    def phase(self):
        """Name of the phase: turn to path, follow path, settle, turn to goal, done."""
        return self._p.phase

    def start(self, plan):
        """Begin a new goal: plan (n, 3), its last row the goal."""
        self.goal = Pose2D(*(float(v) for v in plan[-1]))
        self._p = Progress()
        self._p.take(plan, self.config.corner_angle)
        self._turning.drop()

    def replan(self, plan):
        """Take a better plan to the same goal; what has been reached stays reached."""
        if self._p.phase not in (SETTLE, FINAL_TURN, DONE):
            self._p.take(plan, self.config.corner_angle)
            self._turning.drop()

    def stop(self):
        """Forget the last command, because the robot was told to stop at once."""
        self._prediction.commanded(self._last_t + 1e-6, 0.0, 0.0)
        self._rest()

    def update(self, t, dt, pose, velocity, pose_age, world):
        """Return the LocalCommand for time t (s).

        dt: since the last command (s). pose: Pose2D as it was pose_age seconds ago. velocity: measured (v, w).
        world: LocalWorld of the local costmap.
        """
        now = self._prediction.ahead(t, pose, pose_age, velocity[0], dt)
        command = self._drive(t, dt, now, pose, velocity, world)
        if command.state != DRIVING:
            self._rest()
        self._last, self._last_t = (command.v, command.w), t
        self._prediction.commanded(t, command.v, command.w)
        return command

    # -- inside ------------------------------------------------------------------------------------------------

    def _rest(self):
        self._last, self._bending, self._speed.acceleration = (0.0, 0.0), 0.0, 0.0
        self._turning.drop()

    def _drive(self, t, dt, now, pose, velocity, world):
        p, c = self._p, self.config
        still = p.is_still(t, velocity, self._last, c)
        if p.begins_at_goal(pose.distance(self.goal), c.xy_goal_tolerance):
            p.stages, p.phase = [], FINAL_TURN
        if p.phase == SETTLE:
            if not still:
                return self._braked(t, dt, now, world, 'comes to rest')
            failed = self._settled(pose)
            if failed:
                return failed
        if p.phase == TURN:
            command = self._begin_stage(t, dt, now, velocity, world)
            if command is not None:
                return command
        if p.phase == FOLLOW:
            command = self._follow(t, dt, now, world)
            if command is not None:
                return command
        if p.phase == FINAL_TURN:
            return self._turn_to_goal(t, dt, now, pose, still, velocity, world)
        if p.phase == DONE:
            return LocalCommand(0.0, 0.0, REACHED)
        return self._braked(t, dt, now, world, 'comes to rest')

    def _begin_stage(self, t, dt, now, velocity, world):
        """Turn in place to where the next stage begins; None when it has (phase FOLLOW), or when no stage is left
        (phase SETTLE).
        """
        p, c = self._p, self.config
        if not p.stages:
            p.phase, p.still_since = SETTLE, None
            return None
        stage = p.stages[0]
        planned = isinstance(stage, Turn)
        if planned:
            error, what = wrap(stage.yaw - now.yaw), 'the next part of the path'
            if (
                not self._turning.under_way
                and len(p.stages) > 1
                and abs(stage.angle) < math.pi
                and abs(error) <= self._left_to_law(now, error, world)
            ):
                p.next_stage()
                return self._begin_stage(t, dt, now, velocity, world)
        else:
            if p.leg is None:
                p.leg = self._leg(stage, world)
            leg = p.leg
            leg.locate(now.x, now.y)
            error, what = -wrap(leg.heading_error(now.yaw, leg.along) - self._law.heading(leg.offset, 0.0)), 'the path'
            sense = -1.0 if leg.backward else 1.0
            this_way = (
                sense * self._last[0] >= 0.0 and sense * velocity[0] > -2.0 * c.trans_stopped_vel
            )  # else it comes to rest first
            if not self._turning.under_way and this_way and abs(error) <= self._left_to_law(now, error, world):
                p.phase = FOLLOW
                return None
        if self._last[0] != 0.0 or abs(velocity[0]) > 2.0 * c.trans_stopped_vel:
            return self._braked(t, dt, now, world, 'comes to rest to turn')
        if not self._turning.under_way:
            blocked = self._turning.begin(
                now,
                error,
                world,
                stage.angle if planned else 0.0,
                0.0 if planned else 0.5 * c.turn_in_place_angle,
                c.turn_first_angle,
            )
            if blocked and (planned or abs(error) > c.turn_in_place_angle):
                return blocked
            if blocked:
                p.phase = FOLLOW  # the law has to do it
                return None
        command = self._turned(t, dt, now, error, world, what)
        if command is not None:
            return command
        if planned:
            p.next_stage()
            return self._begin_stage(t, dt, now, velocity, world)
        p.phase = FOLLOW
        return None

    def _left_to_law(self, now, error, world):
        """Return the heading error (rad) up to which a leg is begun without turning in place first: more on the way,
        and where turning is tight.
        """
        c = self.config
        if self._last[0] != 0.0:
            return c.turn_in_place_angle
        return (
            0.5 * c.turn_in_place_angle
            if abs(error) > c.turn_first_angle and self._turning.tight(now, error, world)
            else c.turn_first_angle
        )

    def _turned(self, t, dt, now, error, world, what):
        """One cycle of the turn in place under way; None when it is done."""
        return self._turning.step(t, dt, now, error, self._last[1], self._prediction.turn_gain, world, what)

    def _follow(self, t, dt, now, world):
        """One cycle along the leg; None when it is over."""
        p, c = self._p, self.config
        leg, gain = p.leg, self._prediction.turn_gain
        leg.locate(now.x, now.y)
        if abs(leg.offset) > c.max_path_distance:
            return LocalCommand(0.0, 0.0, OFF_PATH, f'the robot is {abs(leg.offset):.2f} m off its path')
        if leg.left <= ENDED:
            p.next_stage()
            return self._braked(t, dt, now, world, 'comes to rest')
        speed = abs(self._last[0])
        error = leg.heading_error(now.yaw, leg.along)
        if abs(wrap(error - self._law.heading(leg.offset, speed))) > c.turn_in_place_angle:
            p.phase = TURN
            return self._braked(t, dt, now, world, 'comes to rest to turn')
        curvature = self._curvature(leg, speed, error, dt)
        pace = self._speed.pace(leg, speed, curvature, world, gain, dt)
        if pace.speed == 0.0 and pace.cause.kind == STOPPED:
            poses = leg.poses([leg.along, leg.along + 0.1])
            return LocalCommand(
                0.0, 0.0, BLOCKED, f'the way is blocked: the {blocked_where(world, poses)} would touch something'
            )
        self._speed.acceleration = pace.acceleration
        for share in (1.0, 0.5, 0.2):
            v = share * pace.speed
            way = stopping_path(leg, self._law, now, v, curvature, c)
            if not world.worsens(way):
                break
        else:
            return LocalCommand(0.0, 0.0, BLOCKED, f'the {blocked_where(world, way)} would touch something')
        if share < 1.0:
            self._speed.acceleration = 0.0
        w = self._bent(max(min(v * curvature / gain, c.max_vel_theta), -c.max_vel_theta), dt)
        return LocalCommand(
            -v if leg.backward else v, w, DRIVING, self._words.say(t, *following(leg, pace, self._then()))
        )

    def _curvature(self, leg, speed, error, dt):
        """Return the curvature (1/m) to drive after dt, by the tracking law; error: of the heading (rad)."""
        path = leg.bend(leg.along)
        if speed < SETTING_OUT:
            return self._law.curvature(leg.offset, error, path[0], speed)
        driven = self._prediction.turn_gain * self._last[1] / speed
        return self._law.next_curvature(driven, speed * dt, leg.offset, error, path, speed)

    def _bent(self, wanted, dt):
        """Return the turn rate (rad/s) nearest to the one wanted that acceleration and jerk allow after the last
        command.
        """
        c, w = self.config, self._last[1]
        most = min(self._bending + c.jerk_lim_theta * dt, c.acc_lim_theta)
        least = max(self._bending - c.jerk_lim_theta * dt, -c.acc_lim_theta)
        self._bending = min(max((wanted - w) / dt, least), most)
        return w + self._bending * dt

    def _then(self):
        following_stages = self._p.stages[1:]
        if not following_stages:
            return 'the goal'
        return (
            'a turn'
            if isinstance(following_stages[0], Turn) or following_stages[0].backward == self._p.leg.backward
            else 'a change of direction'
        )

    def _braked(self, t, dt, now, world, text):
        """Come to rest as the limits allow, on the curve driven now."""
        c = self.config
        v0, w0 = self._last
        size, self._speed.acceleration = approach(abs(v0), self._speed.acceleration, 0.0, c.dec_lim_x, c.jerk_lim_x, dt)
        if size < 0.03:
            size = self._speed.acceleration = 0.0
        v = math.copysign(size, v0)
        w, self._bending = approach(
            w0, self._bending, w0 * v / v0 if v0 else 0.0, c.acc_lim_theta, c.jerk_lim_theta, dt
        )
        if abs(w) < 0.005:
            w = self._bending = 0.0
        return LocalCommand(v, w, DRIVING, self._words.say(t, text, text))

    def _leg(self, stretch, world):
        """Return the Leg of a Stretch, smoothed less where the smooth one would touch what the plan does not, as far as
        the costmap reaches.
        """
        g, size = world.geometry, world.radius
        reach = 0.5 * min(g.width, g.height) * g.resolution - size

        def touches(leg):
            return int(world.touched(leg.poses(leg.s[leg.s <= reach])).sum())

        leg = Leg(stretch.points, stretch.backward, self.config.path_deviation)
        if not touches(leg):
            return leg
        close = Leg(stretch.points, stretch.backward, NEARLY_EXACT * self.config.path_deviation)
        return close if touches(close) < touches(leg) else leg
