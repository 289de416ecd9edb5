"""The steps of a robot that brakes while it keeps to its path, compiled: a cycle looks at a dozen of them, each of
which asks where it is and how to steer.

The plain form of a step is in geometry and path_tracker; the tests hold this against them.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_nav.pursuit import path_tracker
from sara_nav.pursuit.curvature_law import next_curvature

STEP = 0.04
"""Way (m) of a step."""


@kernel
def advanced(x, y, yaw, way, turn):
    """Return the pose after a way (m, negative astern) on an arc that turns by so much (rad)."""
    if abs(turn) < 1e-9:
        chord, heading = way, yaw
    else:
        chord, heading = 2.0 * way / turn * math.sin(0.5 * turn), yaw + 0.5 * turn
    return x + chord * math.cos(heading), y + chord * math.sin(heading), wrap(yaw + turn)


@kernel
def follow(s, xy, direction, heading, bends, changes, along, backward, x, y, yaw, way, curvature, length, sharpest):
    """Return the poses (n, 3) from (x, y, yaw) on over a way (m), a STEP apart, from a curvature (1/m) on by the
    tracking law.

    s, xy, direction, heading, bends, changes, along: of the Leg. length, sharpest: see ``next_curvature``.
    """
    poses = np.empty((int(way / STEP) + 3, 3))
    poses[0, 0], poses[0, 1], poses[0, 2] = x, y, yaw
    n, sense = 1, -1.0 if backward else 1.0
    while way > 1e-6:
        step = min(way, STEP)
        along, offset, _ = path_tracker.nearest(s, xy, direction, x, y, along)
        error = wrap((yaw + math.pi if backward else yaw) - path_tracker.between(along, s, heading))
        over = along > s[-1]
        bend, change = (
            0.0 if over else path_tracker.between(along, s, bends),
            0.0 if over else path_tracker.between(along, s, changes),
        )
        curvature = next_curvature(curvature, step, offset, error, bend, change, length, sharpest)
        x, y, yaw = advanced(x, y, yaw, sense * step, step * curvature)
        poses[n, 0], poses[n, 1], poses[n, 2] = x, y, yaw
        n += 1
        way -= step
    return poses[:n].copy()


@kernel
def turn(x, y, yaw, angle):
    """Return the poses (n, 3) of a turn in place by an angle (rad, with its sense), with steps of 0.05 rad at most."""
    n = max(2, int(math.ceil(abs(angle) / 0.05)))
    poses = np.empty((n + 1, 3))
    for i in range(n + 1):
        poses[i, 0], poses[i, 1], poses[i, 2] = x, y, yaw + angle * i / n
    return poses


def warm():
    """Compile, or load from the cache, the kernel for the types it is called with."""
    s, points = np.array([0.0, 1.0]), np.array([[0.0, 0.0], [1.0, 0.0]])
    follow(s, points, points[1:], s, s, s, 0.0, False, 0.0, 0.0, 0.0, 0.1, 0.0, 0.5, 4.0)
    turn(0.0, 0.0, 0.0, 1.0)
