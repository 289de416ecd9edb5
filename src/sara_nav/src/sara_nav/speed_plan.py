"""How fast to drive on a leg: what lies on the way ahead caps the speed there, and braking for it begins in time.

Caps come from the bends of the path (turn rate, its change, lateral acceleration), from the gap between body and obstacles, from
what lies ahead (as a safety function behind would slow for it) and from the end of the leg. Regulating pursuit by curvature and clearance is
Macenski et al. (2023, Regulated pure pursuit); braking for caps ahead is the time scaling of a path (Bobrow et al. 1985) within jerk.
"""
import math
from dataclasses import dataclass

import numpy as np

from sara_nav.clearance import place_of, room
from sara_nav.smooth_speed import SpeedLimits, next_speed, way_to_slow

STEP = 0.1
"""Way (m) between two places ahead that are looked at."""
BEYOND = 0.3
"""Way (m) that is looked at beyond what braking takes."""
BLOCKED_BEFORE = 0.03
"""Way (m) before a place where the footprint would touch something at which it rests."""
CREEP = 0.02
"""The slowest speed (m/s) of the end of a leg, which would else be neared for ever."""
FREE, BEND, NARROW, AHEAD, END, BLOCKED = 'free', 'bend', 'narrow', 'ahead', 'end', 'blocked'
"""Why it is slow."""


@dataclass(frozen=True)
class Cause:
    """What slows: ``kind`` of the above, ``size`` (m: gap, way that is free, way left) and ``where`` about the robot."""

    kind: str
    size: float = 0.0
    where: str = ''


@dataclass(frozen=True)
class Pace:
    """speed (m/s) along the leg and its acceleration (m/s2) for the next command; cap (m/s): what it is on its way to; cause."""

    speed: float
    acceleration: float
    cap: float
    cause: Cause


def ahead_speed(free, c):
    """Return the speeds (m/s) at which a robot with ``free`` m before it (array) can still react and come to rest: v t + v^2 / 2 a = free - stop."""
    way = np.maximum(np.asarray(free, float) - c.ahead_stop_distance, 0.0)
    with np.errstate(invalid='ignore'):
        return c.ahead_dec * (np.sqrt(c.ahead_reaction_time ** 2 + 2.0 * way / c.ahead_dec) - c.ahead_reaction_time)


def gap_speed(gap, c):
    """Return the speeds (m/s) beside obstacles: narrow_vel at a gap (m, array) of 0, max_vel_x from wide_gap on, evenly between."""
    return c.narrow_vel + (c.max_vel_x - c.narrow_vel) * np.minimum(np.asarray(gap, float) / c.wide_gap, 1.0)


def bend_speed(leg, s, turn_gain, c):
    """Return the speeds (m/s) at s (n,) m along that the path's bends allow: w = v k, its change v^2 k', lateral v^2 k."""
    k = np.abs(leg.at(s)[3]) + 1e-9
    change = np.where(s > leg.length, 0.0, np.interp(s, leg.s, np.abs(leg.change))) + 1e-9
    return np.minimum.reduce([0.9 * turn_gain * c.max_vel_theta / k, np.sqrt(0.8 * turn_gain * c.acc_lim_theta / change),
                              np.sqrt(c.max_lateral_acc / k)])


class SpeedPlan:
    """Plans the speed along a leg, cycle by cycle; remembers speed and acceleration of the last command. config: RotateThenPursueConfig."""

    def __init__(self, config):
        self.config = config
        self.acceleration = 0.0

    def pace(self, leg, speed, curvature, world, turn_gain, dt):
        """Return the Pace after ``speed`` (m/s, of the last command) where the robot is on the leg.

        curvature: that is driven now (1/m). world: LocalWorld. turn_gain: turn rate driven over commanded.
        """
        c = self.config
        highest = c.max_vel_x if not leg.backward else -c.min_vel_x
        look = speed * 0.5 + way_to_slow(speed, max(self.acceleration, 0.0), 0.0, c.comfort_dec_x, c.jerk_lim_x) + BEYOND
        ways = np.arange(0.0, min(look, max(leg.left, 0.0)) + STEP, STEP)
        s = leg.along + ways
        seen = room(world, leg.poses(s), leg.backward, c.ahead_angle, 1.2)
        options = np.vstack([bend_speed(leg, s, turn_gain, c), gap_speed(seen.gap, c), np.maximum(ahead_speed(seen.ahead, c), c.narrow_vel)])
        bends = 0.9 * turn_gain * c.max_vel_theta / max(abs(curvature), 1e-6)
        options[0, 0] = min(options[0, 0], max(bends, CREEP))
        caps = options.min(axis=0)
        free = self._free(leg, world, look)
        ways = np.append(ways, [leg.left, free])
        caps = np.append(caps, [0.0, 0.0])
        useful = caps < highest
        useful[-2:] = True
        picked = np.flatnonzero(useful & np.isfinite(ways))
        limits = SpeedLimits(c.acc_lim_x, c.comfort_dec_x, c.jerk_lim_x)
        after, acceleration, at = next_speed(speed, self.acceleration, highest, ways[picked], caps[picked], limits, dt)
        index = int(picked[at]) if at >= 0 else -1
        if index >= 0 and ways[index] - way_to_slow(after, acceleration, caps[index], c.comfort_dec_x, c.jerk_lim_x) < -0.05:
            # It came suddenly: braked for harder.
            limits = SpeedLimits(c.acc_lim_x, c.dec_lim_x, c.jerk_lim_x)
            after, acceleration, _ = next_speed(speed, self.acceleration, highest, ways[picked], caps[picked], limits, dt)
        if acceleration <= 0.0 and after < CREEP and leg.left > 0.0 and free > 0.0:
            after, acceleration = CREEP if speed >= CREEP else min(speed + c.acc_lim_x * dt, CREEP), 0.0
        cause = self._cause(index, options, seen, leg, free, world) if index >= 0 else Cause(FREE)
        return Pace(after, acceleration, float(caps[index]) if index >= 0 else highest, cause)

    def _cause(self, index, options, seen, leg, free, world):
        n = options.shape[1]
        if index == n:
            return Cause(END, max(leg.left, 0.0))
        if index == n + 1:
            return Cause(BLOCKED, max(free, 0.0))
        kind = (BEND, NARROW, AHEAD)[int(options[:, index].argmin())]
        if kind == NARROW:
            return Cause(NARROW, float(seen.gap[index]), place_of(seen.x[index], seen.y[index], world.footprint))
        return Cause(kind, float(seen.ahead[index]) if kind == AHEAD else 0.0)

    def _free(self, leg, world, look):
        """Return the way (m) along the leg until its footprint would touch more than it does now, +Inf where it does not within ``look``."""
        ways = np.arange(0.0, min(look, max(leg.left, 0.0)) + 0.04, 0.04)
        touched = world.touched(leg.poses(leg.along + ways))
        worse = np.flatnonzero(touched > touched[0])
        return float(ways[worse[0]]) - BLOCKED_BEFORE - 0.04 if len(worse) else math.inf
