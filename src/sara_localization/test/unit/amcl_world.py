"""A small known world for tests of amcl: a map without symmetry, a robot's scans in it by rays, its odometry."""

import math

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_localization.ranges import map_echo
from sara_localization.ranges.range_data import RangeMap

CELL, MOST = 0.05, 8.0
MOUNT = (0.2, 0.0, 0.0)


def plan(width=10.0, depth=7.0):
    """int8 (rows, columns) as nav_msgs/OccupancyGrid has it: a room with inner walls, cupboards and a pillar."""
    cells = np.zeros((round(depth / CELL), round(width / CELL)), np.int8)

    def wall(x0, y0, x1, y1):
        cells[round(y0 / CELL) : round(y1 / CELL), round(x0 / CELL) : round(x1 / CELL)] = 100

    for sides in (
        (0, 0, width, 0.1),
        (0, depth - 0.1, width, depth),
        (0, 0, 0.1, depth),
        (width - 0.1, 0, width, depth),
    ):
        wall(*sides)
    wall(4.0, 0.0, 4.1, 2.5)
    wall(6.5, 3.5, 6.6, 7.0)
    wall(6.5, 3.5, 8.0, 3.6)
    wall(1.0, 5.5, 2.2, 6.0)
    wall(2.6, 3.6, 2.9, 3.9)
    wall(8.8, 0.1, 9.9, 0.6)
    wall(5.2, 0.1, 6.0, 0.4)
    return cells


def world(origin=(0.0, 0.0, 0.0)):
    """The map, its lower left corner at (x, y, yaw)."""
    return RangeMap.from_occupancy(plan(), CELL, origin, 65)


def ranges(map_, pose, angles, mount=MOUNT):
    """(n,) what a scanner measures from a pose (x, y, yaw) of the robot in the map, m; inf for no echo."""
    x, y, yaw = compose(inverse(map_.origin), compose(pose, mount))
    cast = lambda angle: map_echo.cast(map_.cells, x / CELL, y / CELL, yaw + angle, MOST / CELL)[0] * CELL
    return np.array([cast(float(angle)) for angle in angles])


def scan(map_, pose, odometry, rng=None, count=90, frame='laser', stamp=1.0):
    """A ScanInput from a pose; with a generator each range is off by 0.02 m."""
    increment = 2.0 * math.pi / count
    angles = -math.pi + increment * np.arange(count)
    measured = ranges(map_, pose, angles)
    if rng is not None:
        measured = measured + 0.02 * rng.standard_normal(count)
    sweep = Sweep(stamp, -math.pi, -math.pi + increment * (count - 1), increment, 0.0, 0.1, MOST, measured)
    return ScanInput(frame, sweep, Transform.from_xyz_rpy(MOUNT[0], MOUNT[1], 0.3, yaw=MOUNT[2]), planar(odometry))


def planar(pose):
    """A Transform of (x, y, yaw)."""
    return Transform.from_xyz_rpy(pose[0], pose[1], 0.0, yaw=pose[2])


def loop(steps, speed=0.1):
    """Poses (x, y, yaw) of a drive, `speed` m a step, round an ellipse in the larger part of the room."""
    fine = np.linspace(0.0, 2.0 * math.pi * math.ceil(speed * steps / 11.0), 4000)
    x, y = 7.0 + 2.3 * np.cos(fine), 1.9 + 1.2 * np.sin(fine)
    way = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    at = np.interp(speed * np.arange(steps + 1), way, fine)
    heading = np.arctan2(1.2 * np.cos(at), -2.3 * np.sin(at))
    return list(zip((7.0 + 2.3 * np.cos(at)).tolist(), (1.9 + 1.2 * np.sin(at)).tolist(), heading.tolist()))


def drifting(path, rng, share=0.05):
    """The odometry of a path: starts anywhere, and each step is off by a share of it."""
    pose = (-3.0, 2.0, 1.0)
    for a, b in zip([path[0], *path], path):
        x, y, yaw = compose(inverse(a), b)
        noise = 1.0 + share * rng.standard_normal(2)
        pose = compose(pose, (x * noise[0], y * noise[0], yaw * noise[1]))
        yield pose


def error(pose, truth):
    """(m, rad) between two poses."""
    return math.dist(pose[:2], truth[:2]), abs(float(wrap(pose[2] - truth[2])))
