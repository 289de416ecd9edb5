"""How fast to drive on a leg: what lies on the way ahead caps the speed there, and braking for it begins in time.

Caps come from the bends of the path (turn rate, its change, lateral acceleration), from the gap between body and
obstacles, from what lies ahead (as a safety function behind would slow for it), from slow places and from the end of
the leg. Regulating pursuit by curvature and clearance is Macenski et al. (2023, Regulated pure pursuit); braking for
caps ahead is the time scaling of a path (Bobrow et al. 1985) within jerk.
"""

import math
from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.grids.clearance import lead, place_of
from sara_nav.grids.collision import LocalWorld
from sara_nav.pursuit import speed_ahead
from sara_nav.pursuit.path_tracker import Leg, poses_at
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_speed import NO_CAPS, Caps, Motion, SpeedLimits

FREE, BEND, NARROW, AHEAD, END, BLOCKED, SLOW = KINDS = 'free', 'bend', 'narrow', 'ahead', 'end', 'blocked', 'slow'
"""Why it is slow, in the order of speed_ahead's numbers."""


class Cause(NamedTuple):
    """What slows: ``kind`` of the above, ``size`` (m: gap, free distance, distance left) and ``where`` about the
    robot.
    """

    kind: str
    size: float = 0.0
    where: str = ''


class Pace(NamedTuple):
    """speed (m/s) along the leg and its acceleration (m/s2) for the next command; cap (m/s): what it is on its way to;
    cause.
    """

    speed: float
    acceleration: float
    cap: float
    cause: Cause


def gap_speed(gap: float, c: RotateThenPursueConfig) -> float:
    """Return the speed (m/s) beside an obstacle at a gap (m): narrow_vel at 0, max_vel_x from wide_gap on, evenly
    between. c: RotateThenPursueConfig.
    """
    return speed_ahead.gap_cap(float(gap), float(c.narrow_vel), float(c.max_vel_x), float(c.wide_gap))


class SpeedPlan:
    """Plans the speed along a leg, cycle by cycle."""

    def __init__(self, config: RotateThenPursueConfig):
        self.config = c = config
        self.regulation = speed_ahead.Regulation(
            float(c.wide_gap),
            float(c.narrow_vel),
            math.tan(c.ahead_angle),
            float(c.ahead_stop_distance),
            float(c.ahead_reaction_time),
            float(c.ahead_dec),
        )
        self._rules = {backward: (limits_of(c, backward), self.regulation) for backward in (False, True)}

    def pace(self, leg: Leg, driven: speed_ahead.Driven, world: LocalWorld, dt: float) -> Pace:
        """Return the Pace of the next command, dt (s) after the last, where the robot is on the leg."""
        front, span = lead(world.footprint, leg.backward)
        body = speed_ahead.Body(world.footprint, world.cover, world.shift, front, span)
        rules, slow = self._rules[leg.backward], self._slow(leg, driven, world)
        after, acceleration, cap, why, size, x, y = speed_ahead.pace(
            leg.samples, leg.place, driven, rules, (world.ground, body), slow, float(dt)
        )
        where = place_of(x, y, world.footprint) if KINDS[why] == NARROW else ''
        return Pace(after, acceleration, cap, Cause(KINDS[why], size, where))

    def _slow(self, leg, driven, world):
        """The smooth_speed.Caps of the slow places on the leg, as far as is looked ahead."""
        if not world.slow:
            return NO_CAPS
        limits, _ = self._rules[leg.backward]
        end = speed_ahead.horizon(driven.motion, leg.place.left, limits.comfort)
        ahead = speed_ahead.evenly(end + speed_ahead.STEP, speed_ahead.STEP)
        share = world.speed_share(poses_at(leg.samples, leg.place.along + ahead, leg.backward))
        on = share < 1.0
        return Caps(ahead[on], np.maximum(share[on] * limits.max_vel_x, speed_ahead.CREEP))


def driven_now(motion: Motion, curvature: float, turn_gain: float, pose: Pose2D) -> speed_ahead.Driven:
    """The Driven of a Motion last commanded, for kernels; see there."""
    now = float(pose.x), float(pose.y), float(pose.yaw)
    return speed_ahead.Driven(Motion(*map(float, motion)), float(curvature), float(turn_gain), now)


def limits_of(c: RotateThenPursueConfig, backward: bool) -> speed_ahead.Limits:
    """The Limits of a RotateThenPursueConfig in a sense of driving."""
    acceleration, jerk = float(c.acc_lim_x), float(c.jerk_lim_x)
    return speed_ahead.Limits(
        highest=float(-c.min_vel_x if backward else c.max_vel_x),
        max_vel_x=float(c.max_vel_x),
        comfort=SpeedLimits(acceleration, float(c.comfort_dec_x), jerk),
        hard=SpeedLimits(acceleration, float(c.dec_lim_x), jerk),
        max_vel_theta=float(c.max_vel_theta),
        acc_lim_theta=float(c.acc_lim_theta),
        max_lateral_acc=float(c.max_lateral_acc),
    )
