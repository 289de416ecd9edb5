"""The way a robot still drives when it brakes now, keeping to its path; and where about it something would be
touched.
"""

import math

import numpy as np

from sara_nav.grids.clearance import place_of, room
from sara_nav.pursuit import stopping_steps

REACTION = 0.2
"""Seconds until it brakes."""
MARGIN = 0.02
"""Way (m) and angle (rad) more that is looked at."""


def stopping_way(leg, law, now, speed, curvature, config):
    """Return the poses (n, 3) from a Pose2D on, by the tracking law along the leg, from ``speed`` (m/s) and a curvature
    (1/m) braking by dec_lim_x to rest, and a margin.
    """
    way = speed * REACTION + speed * speed / (2.0 * config.dec_lim_x) + MARGIN
    return stopping_steps.follow(
        leg.s,
        leg.xy,
        leg.direction,
        leg.heading,
        leg.curvature,
        leg.change,
        leg.along,
        leg.backward,
        now.x,
        now.y,
        now.yaw,
        float(way),
        float(curvature),
        float(law.reach(speed)),
        float(law.sharpest),
    )


def stopping_turn(now, rate, config):
    """Return the poses (n, 3) of a turn in place from a Pose2D at ``rate`` (rad/s, as driven), braking by acc_lim_theta
    to rest, and a margin.
    """
    angle = abs(rate) * REACTION + rate * rate / (2.0 * config.acc_lim_theta) + MARGIN
    return stopping_steps.turn(float(now.x), float(now.y), float(now.yaw), math.copysign(angle, rate))


def blocked_where(world, poses):
    """Return where about the robot ('front left', ...) it first touches more than at the first of the poses (n, 3)."""
    touched = world.touched(poses)
    worse = np.flatnonzero(touched > touched[0])
    at = int(worse[0]) if len(worse) else int(touched.argmax())
    seen = room(world, np.asarray(poses, float)[at : at + 1], False, 0.5, 0.5)
    return place_of(float(seen.x[0]), float(seen.y[0]), world.footprint)
