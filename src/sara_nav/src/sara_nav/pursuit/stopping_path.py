"""The path a robot still drives when it brakes now and keeps to its leg, and where about it something would be
touched.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import advanced
from sara_common.planar import Pose2D
from sara_nav.grids.clearance import place_of, room
from sara_nav.grids.collision import LocalWorld
from sara_nav.pursuit import path_tracker
from sara_nav.pursuit.curvature_law import Bend, Deviation, TrackingLaw, next_curvature
from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_turn import turn_poses

REACTION = 0.2
"""Seconds until it brakes."""
MARGIN = 0.02
"""Distance (m) and angle (rad) more that is looked at."""
STEP = 0.04
"""Distance (m) from one pose to the next."""


def stopping_path(
    leg: Leg, law: TrackingLaw, now: Pose2D, speed: float, curvature: float, config: RotateThenPursueConfig
) -> np.ndarray:
    """Return the poses (n, 3) from ``now`` on, by the tracking law along the leg, from ``speed`` (m/s) and a curvature
    (1/m) braking by dec_lim_x to rest, and a margin.
    """
    distance = speed * REACTION + speed * speed / (2.0 * config.dec_lim_x) + MARGIN
    pose = float(now.x), float(now.y), float(now.yaw)
    return follow(leg.samples, leg.place, pose, float(distance), float(curvature), law.at(speed))


@kernel
def follow(
    samples: path_tracker.Samples,
    place: path_tracker.Place,
    pose: tuple[float, float, float],
    distance: float,
    curvature: float,
    law: tuple[float, float],
) -> np.ndarray:
    """Return the poses (n, 3) from a pose (x, y, yaw) on over a distance (m), a STEP apart, by the tracking law.

    samples, place: of a Leg. curvature: driven at the start (1/m). law: (length, sharpest) of ``next_curvature``.
    """
    s, xy, direction, heading, curvatures, changes, _ = samples
    x, y, yaw = pose
    poses = np.empty((int(distance / STEP) + 3, 3))
    poses[0, 0], poses[0, 1], poses[0, 2] = x, y, yaw
    n, sense, along = 1, -1.0 if place.backward else 1.0, place.along
    while distance > 1e-6:
        step = min(distance, STEP)
        along, offset, _ = path_tracker.nearest(s, xy, direction, x, y, along)
        error = path_tracker.heading_error(s, heading, place.backward, yaw, along)
        bend = Bend(path_tracker.on_leg(along, s, curvatures), path_tracker.on_leg(along, s, changes))
        curvature = next_curvature(curvature, step, Deviation(offset, error), bend, law)
        x, y, yaw = advanced(x, y, yaw, sense * step, step * curvature, 1.0)
        poses[n, 0], poses[n, 1], poses[n, 2] = x, y, yaw
        n += 1
        distance -= step
    return poses[:n].copy()


def stopping_turn(now: Pose2D, rate: float, config: RotateThenPursueConfig) -> np.ndarray:
    """Return the poses (n, 3) of a turn in place from ``now`` at ``rate`` (rad/s, as driven), braking by acc_lim_theta
    to rest, and a margin.
    """
    angle = abs(rate) * REACTION + rate * rate / (2.0 * config.acc_lim_theta) + MARGIN
    return turn_poses(now, math.copysign(angle, rate))


def blocked_where(world: LocalWorld, poses: np.ndarray) -> str:
    """Return where about the robot ('front left', ...) it first touches more than at the first of the poses (n, 3)."""
    touched = world.touched(poses)
    worse = np.flatnonzero(touched > touched[0])
    at = int(worse[0]) if len(worse) else int(touched.argmax())
    seen = room(world, np.asarray(poses, float)[at : at + 1], False, 0.5, 0.5)
    return place_of(float(seen.x[0]), float(seen.y[0]), world.footprint)


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    s, points = np.array([0.0, 1.0]), np.array([[0.0, 0.0], [1.0, 0.0]])
    samples = path_tracker.Samples(s, points, points[1:], s, s, s, s)
    follow(samples, path_tracker.Place(0.0, 1.0, False), (0.0, 0.0, 0.0), 0.1, 0.0, (0.5, 4.0))
