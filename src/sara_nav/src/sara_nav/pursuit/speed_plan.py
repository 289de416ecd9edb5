"""How fast to drive on a leg: what lies on the way ahead caps the speed there, and braking for it begins in time.

Caps come from the bends of the path (turn rate, its change, lateral acceleration), from the gap between body and
obstacles, from what lies ahead (as a safety function behind would slow for it) and from the end of the leg. Regulating
pursuit by curvature and clearance is Macenski et al. (2023, Regulated pure pursuit); braking for caps ahead is the time
scaling of a path (Bobrow et al. 1985) within jerk.
"""

import math
from typing import NamedTuple

from sara_nav.grids.clearance import lead, place_of
from sara_nav.pursuit import speed_ahead

FREE, BEND, NARROW, AHEAD, END, BLOCKED = KINDS = ('free', 'bend', 'narrow', 'ahead', 'end', 'blocked')
"""Why it is slow, in the order of speed_ahead's numbers."""


class Cause(NamedTuple):
    """What slows: ``kind`` of the above, ``size`` (m: gap, way that is free, way left) and ``where`` about the
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


def gap_speed(gap, c):
    """Return the speed (m/s) beside an obstacle at a gap (m): narrow_vel at 0, max_vel_x from wide_gap on, evenly
    between. c: RotateThenPursueConfig.
    """
    return speed_ahead.gap_cap(float(gap), float(c.narrow_vel), float(c.max_vel_x), float(c.wide_gap))


class SpeedPlan:
    """Plans the speed along a leg, cycle by cycle; remembers speed and acceleration of the last command. config:
    RotateThenPursueConfig.
    """

    def __init__(self, config):
        self.config = c = config
        self.acceleration = 0.0
        turns = (float(c.max_vel_theta), float(c.acc_lim_theta), float(c.max_lateral_acc))
        brakes = (float(c.acc_lim_x), float(c.comfort_dec_x), float(c.dec_lim_x), float(c.jerk_lim_x))
        self._limits = {
            backward: (float(-c.min_vel_x if backward else c.max_vel_x), float(c.max_vel_x), *brakes, *turns)
            for backward in (False, True)
        }
        self._sight = (
            float(c.wide_gap),
            float(c.narrow_vel),
            math.tan(c.ahead_angle),
            float(c.ahead_stop_distance),
            float(c.ahead_reaction_time),
            float(c.ahead_dec),
        )

    def pace(self, leg, speed, curvature, world, turn_gain, dt):
        """Return the Pace after ``speed`` (m/s, of the last command) where the robot is on the leg.

        curvature: that is driven now (1/m). world: LocalWorld. turn_gain: turn rate driven over commanded.
        """
        g, backward = world.geometry, leg.backward
        after, acceleration, cap, why, size, x, y = speed_ahead.pace(
            leg.s,
            leg.xy,
            leg.heading,
            leg.curvature,
            leg.size_of_change,
            leg.along,
            leg.left,
            backward,
            float(speed),
            float(self.acceleration),
            float(curvature),
            float(turn_gain),
            float(dt),
            self._limits[backward],
            self._sight,
            world.costmap.costs,
            float(g.origin_x),
            float(g.origin_y),
            float(g.resolution),
            world.footprint,
            world.points,
            world.box,
            *lead(world.footprint, backward),
            world.shift,
            world.unknown_blocks,
        )
        where = place_of(x, y, world.footprint) if KINDS[why] == NARROW else ''
        return Pace(after, acceleration, cap, Cause(KINDS[why], size, where))
