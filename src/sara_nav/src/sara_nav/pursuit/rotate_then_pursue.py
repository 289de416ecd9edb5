"""A local planner for a chair: turns in place the short way, keeps to the path, slows for what is ahead, ends gently on
the goal.

A plan is taken as it was made, stage by stage (plan_stages): legs forward and in reverse, turns in place between them.
On a leg the law of curvature_law bends towards the path, and speed_plan says how fast; both commands change within
their limits of acceleration and jerk, and are sent so that what smooths commands further on drives them
(smooth_command). All is computed from where the robot will be when the command takes effect (prediction); without that,
a chair whose pose comes late turns too far and back.
"""

import math

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.grids.collision import LocalWorld
from sara_nav.planners.local_command import BLOCKED, DRIVING, LOCAL_PLANNERS, OFF_PATH, REACHED, LocalCommand
from sara_nav.pursuit.curvature_law import Deviation, TrackingLaw
from sara_nav.pursuit.cycle import Cycle
from sara_nav.pursuit.driving_progress import DONE, FINAL_TURN, FOLLOW, SETTLE, TURN, Progress
from sara_nav.pursuit.goal_approach import GoalApproach
from sara_nav.pursuit.messages import Words, following
from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.plan_stages import Turn
from sara_nav.pursuit.prediction import Prediction
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_command import SmoothCommand
from sara_nav.pursuit.smooth_speed import Motion
from sara_nav.pursuit.speed_plan import BLOCKED as STOPPED
from sara_nav.pursuit.speed_plan import SpeedPlan, driven_now
from sara_nav.pursuit.stopping_path import blocked_where, stopping_path
from sara_nav.pursuit.turning_in_place import TurningInPlace

SETTING_OUT = 0.05
"""Below this speed (m/s) the curvature is chosen freely: turn rates are small."""
ENDED = 0.02
"""The end of a leg is reached this way (m) before it."""
NEARLY_EXACT = 0.25
"""Share of path_deviation by which a path is smoothed where there is no room for more."""


@LOCAL_PLANNERS.register('sara_nav/RotateThenPursue')
class RotateThenPursue:
    """Drives a plan; see the module. One object drives one goal after the other."""

    config_class = RotateThenPursueConfig

    def __init__(self, config: RotateThenPursueConfig = RotateThenPursueConfig()):
        self.goal = None
        self._p = Progress()
        self._last_t = -math.inf
        self._words = Words()
        self._command = SmoothCommand(config, self._words)
        self._prediction = Prediction(config.drive_latency, config.turn_latency)
        self.reconfigure(config)

    def reconfigure(self, config: RotateThenPursueConfig) -> None:
        """Go on with another configuration; what was learned of the base stays."""
        self.config = self._command.config = config
        self._command.acceleration = 0.0
        self._prediction.latency, self._prediction.turn_latency = config.drive_latency, config.turn_latency
        self._law = TrackingLaw(config.tracking_length, config.tracking_time)
        self._speed = SpeedPlan(config)
        self._turning = TurningInPlace(config, self._words)
        self._at_goal = GoalApproach(config, self._turning, self._command, self._words)

    @property
    def phase(self) -> str:
        """Name of the phase: turn to path, follow path, settle, turn to goal, done."""
        return self._p.phase

    def start(self, plan: np.ndarray) -> None:
        """Begin a new goal: plan (n, 3), its last row the goal."""
        self.goal = Pose2D(*(float(v) for v in plan[-1]))
        self._p = Progress()
        self._p.take(plan, self.config.corner_angle)
        self._turning.drop()

    def replan(self, plan: np.ndarray) -> None:
        """Take a better plan to the same goal; what has been reached stays reached."""
        if self._p.phase not in (SETTLE, FINAL_TURN, DONE):
            self._p.take(plan, self.config.corner_angle)
            self._turning.drop()

    def stop(self) -> None:
        """Forget the last command, because the robot was told to stop at once."""
        self._prediction.commanded(self._last_t + 1e-6, 0.0, 0.0)
        self._rest()

    def update(
        self, t: float, dt: float, pose: Pose2D, velocity: tuple[float, float], pose_age: float, world: LocalWorld
    ) -> LocalCommand:
        """Return the LocalCommand for time t (s).

        dt: since the last command (s). pose: Pose2D as it was pose_age seconds ago. velocity: measured (v, w).
        world: LocalWorld of the local costmap.
        """
        now = self._prediction.ahead(t, pose, pose_age, velocity[0], dt)
        last = self._command.last
        still = self._p.is_still(t, velocity, last, self.config)
        gain, driven = self._prediction.turn_gain, self._prediction.driven(last[0])
        command = self._drive(Cycle(t, dt, pose, now, velocity, last, gain, still, driven, world))
        if command.state != DRIVING:
            self._rest()
        sent = self._command.sent(command, dt)
        self._command.last, self._last_t = (command.v, command.w), t
        self._prediction.commanded(t, command.v, command.w)
        return sent

    # -- inside ------------------------------------------------------------------------------------------------

    def _rest(self):
        self._command.rest()
        self._turning.drop()

    def _drive(self, cycle):
        p = self._p
        if p.begins_at_goal(cycle.pose.distance(self.goal), self.config.xy_goal_tolerance):
            p.stages, p.phase = [], FINAL_TURN
        if p.phase == SETTLE:
            if not cycle.still:
                return self._command.come_to_rest(cycle, 'comes to rest')
            failed = self._at_goal.settled(p, self.goal, cycle.pose)
            if failed:
                return failed
        if p.phase == TURN:
            command = self._begin_stage(cycle)
            if command is not None:
                return command
        if p.phase == FOLLOW:
            command = self._follow(cycle)
            if command is not None:
                return command
        if p.phase == FINAL_TURN:
            return self._at_goal.turn(p, self.goal, cycle)
        if p.phase == DONE:
            return LocalCommand(0.0, 0.0, REACHED)
        return self._command.come_to_rest(cycle, 'comes to rest')

    def _begin_stage(self, cycle):
        """Turn in place to where the next stage begins; None when it has (phase FOLLOW), or when no stage is left
        (phase SETTLE).
        """
        p = self._p
        if not p.stages:
            p.phase, p.still_since = SETTLE, None
            return None
        stage = p.stages[0]
        return self._turn_as_planned(cycle, stage) if isinstance(stage, Turn) else self._turn_to_leg(cycle, stage)

    def _turn_as_planned(self, cycle, stage):
        """One cycle of a Turn of the plan, and what follows once it is over."""
        p, turning = self._p, self._turning
        error = wrap(stage.yaw - cycle.now.yaw)
        bends_on = not turning.under_way and len(p.stages) > 1 and abs(stage.angle) < math.pi
        if bends_on and abs(error) <= self._left_to_law(cycle, error):
            p.next_stage()
            return self._begin_stage(cycle)
        if cycle.drives(self.config):
            return self._command.come_to_rest(cycle, 'comes to rest to turn')
        if not turning.under_way:
            blocked = turning.begin(cycle, error, stage.angle, 0.0, self.config.turn_first_angle)
            if blocked:
                return blocked
        command = turning.step(cycle, error, 'the next part of the path')
        if command is not None:
            return command
        p.next_stage()
        return self._begin_stage(cycle)

    def _turn_to_leg(self, cycle, stage):
        """One cycle of the turn to where a Stretch begins; None once it is followed."""
        p, c, turning = self._p, self.config, self._turning
        if p.leg is None:
            p.leg = self._leg(stage, cycle.world)
        p.leg.locate(cycle.now.x, cycle.now.y)
        error = -wrap(p.leg.heading_error(cycle.now.yaw, p.leg.along) - self._law.heading(p.leg.offset, 0.0))
        if not turning.under_way and self._goes_along(cycle) and abs(error) <= self._left_to_law(cycle, error):
            p.phase = FOLLOW
            return None
        if cycle.drives(c):
            return self._command.come_to_rest(cycle, 'comes to rest to turn')
        if not turning.under_way:
            blocked = turning.begin(cycle, error, 0.0, 0.5 * c.turn_in_place_angle, c.turn_first_angle)
            if blocked and abs(error) > c.turn_in_place_angle:
                return blocked
            if blocked:
                p.phase = FOLLOW  # the law has to do it
                return None
        command = turning.step(cycle, error, 'the path')
        if command is None:
            p.phase = FOLLOW
        return command

    def _goes_along(self, cycle):
        """Whether the robot stands or moves in the leg's sense; else it comes to rest first."""
        sense = -1.0 if self._p.leg.backward else 1.0
        return sense * cycle.last[0] >= 0.0 and sense * cycle.velocity[0] > -2.0 * self.config.trans_stopped_vel

    def _left_to_law(self, cycle, error):
        """Return the heading error (rad) up to which a leg is begun without turning in place first: more on the way,
        and where turning is tight.
        """
        c = self.config
        if cycle.last[0] != 0.0:
            return c.turn_in_place_angle
        tight = abs(error) > c.turn_first_angle and self._turning.tight(cycle, error)
        return 0.5 * c.turn_in_place_angle if tight else c.turn_first_angle

    def _follow(self, cycle):
        """One cycle along the leg; None when it is over."""
        p, c, now, leg = self._p, self.config, cycle.now, self._p.leg
        leg.locate(now.x, now.y)
        if abs(leg.offset) > c.max_path_distance:
            return LocalCommand(0.0, 0.0, OFF_PATH, f'the robot is {abs(leg.offset):.2f} m off its path')
        if leg.left <= ENDED:
            p.next_stage()
            return self._command.come_to_rest(cycle, 'comes to rest')
        speed = abs(cycle.last[0])
        error = leg.heading_error(now.yaw, leg.along)
        if abs(wrap(error - self._law.heading(leg.offset, cycle.driven))) > c.turn_in_place_angle:
            p.phase = TURN
            return self._command.come_to_rest(cycle, 'comes to rest to turn')
        curvature = self._curvature(cycle, speed, error)
        driven = driven_now(Motion(speed, self._command.acceleration), curvature, cycle.turn_gain, now)
        pace = self._speed.pace(leg, driven, cycle.world, cycle.dt)
        if pace.speed == 0.0 and pace.cause.kind == STOPPED:
            where = blocked_where(cycle.world, leg.poses([leg.along, leg.along + 0.1]))
            return LocalCommand(0.0, 0.0, BLOCKED, f'the way is blocked: the {where} would touch something')
        v, touching = self._able_to_stop(cycle, pace.speed, curvature)
        if touching is not None:
            where = blocked_where(cycle.world, touching)
            return LocalCommand(0.0, 0.0, BLOCKED, f'the {where} would touch something')
        self._command.acceleration = pace.acceleration if v == pace.speed else 0.0
        wanted = max(min(v * curvature / cycle.turn_gain, c.max_vel_theta), -c.max_vel_theta)
        w = self._command.turn_rate(wanted, cycle.dt)
        text = self._words.say(cycle.t, *following(leg, pace, self._then()))
        return LocalCommand(-v if leg.backward else v, w, DRIVING, text)

    def _able_to_stop(self, cycle, speed, curvature):
        """Return (v, None): the speed (m/s), or the share of it, from which the robot can stop and touch nothing more;
        (0.0, poses (n, 3) of a stop that touches) where there is none.
        """
        for share in (1.0, 0.5, 0.2):
            v = share * speed
            poses = stopping_path(self._p.leg, self._law, cycle.now, v, curvature, self.config)
            if not cycle.world.worsens(poses):
                return v, None
        return 0.0, poses

    def _curvature(self, cycle, speed, error):
        """Return the curvature (1/m) to drive next, by the tracking law; error: of the heading (rad)."""
        leg = self._p.leg
        off, bend = Deviation(leg.offset, error), leg.bend(leg.along)
        if speed < SETTING_OUT:
            return self._law.curvature(off, bend, cycle.driven)
        curvature = cycle.turn_gain * cycle.last[1] / speed
        return self._law.next_curvature(curvature, cycle.driven * cycle.dt, off, bend, cycle.driven)

    def _then(self):
        following_stages = self._p.stages[1:]
        if not following_stages:
            return 'the goal'
        return (
            'a turn'
            if isinstance(following_stages[0], Turn) or following_stages[0].backward == self._p.leg.backward
            else 'a change of direction'
        )

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
