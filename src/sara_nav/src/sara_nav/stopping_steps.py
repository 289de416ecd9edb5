"""The steps of a robot that brakes while it keeps to its path, compiled: a cycle looks at a dozen of them, each of which asks where it is and how to steer.

The plain form of the law is in tracking_law, that of a step in geometry and path_tracker; the tests hold this against them.
"""
import math

import numpy as np
from ahead_of_time import kernel

from sara_nav import path_tracker

STEP = 0.04
"""Way (m) of a step."""


@kernel
def wrap(angle):
    """Return the angle (rad) brought into [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@kernel
def next_curvature(curvature, way, offset, heading_error, bend, change, length, steepest, sharpest):
    """Return what TrackingLaw.next_curvature does. length: of its reach (m); bend (1/m), change (1/m2): of the path."""
    beside = 1.0 - min(max(bend * offset, -0.5), 0.5)
    wanted = bend * math.cos(heading_error) / beside
    towards = -max(-steepest, min(steepest, math.atan(offset / (3.0 * length))))
    faster = change - 3.0 / length * (curvature - wanted) - 3.0 / (length * length) * (heading_error - towards)
    return max(-sharpest, min(sharpest, curvature + faster * way))


@kernel
def advanced(x, y, yaw, way, turn):
    """Return the pose after a way (m, negative astern) on an arc that turns by so much (rad)."""
    if abs(turn) < 1e-9:
        chord, heading = way, yaw
    else:
        chord, heading = 2.0 * way / turn * math.sin(0.5 * turn), yaw + 0.5 * turn
    return x + chord * math.cos(heading), y + chord * math.sin(heading), wrap(yaw + turn)


@kernel
def follow(s, xy, direction, heading, bends, changes, along, backward, x, y, yaw, way, curvature, length, steepest, sharpest):
    """Return the poses (n, 3) from (x, y, yaw) on over a way (m), a STEP apart, from a curvature (1/m) on by the tracking law.

    s, xy, direction, heading, bends, changes, along: of the Leg. length, steepest, sharpest: see ``next_curvature``.
    """
    poses = np.empty((int(way / STEP) + 3, 3))
    poses[0, 0], poses[0, 1], poses[0, 2] = x, y, yaw
    n, sense = 1, -1.0 if backward else 1.0
    while way > 1e-6:
        step = min(way, STEP)
        along, offset, _ = path_tracker.nearest(s, xy, direction, x, y, along)
        error = wrap((yaw + math.pi if backward else yaw) - path_tracker.between(along, s, heading))
        over = along > s[-1]
        bend, change = 0.0 if over else path_tracker.between(along, s, bends), 0.0 if over else path_tracker.between(along, s, changes)
        curvature = next_curvature(curvature, step, offset, error, bend, change, length, steepest, sharpest)
        x, y, yaw = advanced(x, y, yaw, sense * step, step * curvature)
        poses[n, 0], poses[n, 1], poses[n, 2] = x, y, yaw
        n += 1
        way -= step
    return poses[:n].copy()


def warm():
    """Compile, or load from the cache, the kernel for the types it is called with."""
    s, points = np.array([0.0, 1.0]), np.array([[0.0, 0.0], [1.0, 0.0]])
    follow(s, points, points[1:], s, s, s, 0.0, False, 0.0, 0.0, 0.0, 0.1, 0.0, 0.5, 0.6, 4.0)
