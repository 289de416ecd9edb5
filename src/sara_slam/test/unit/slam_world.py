"""A small known world for tests of slam_gmapping: a corridor round a block, the robot's scans in it, its odometry."""

import math

import numpy as np

from sara_common.planar import compose, inverse
from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_localization.ranges import map_echo
from sara_localization.ranges.range_data import RangeMap

CELL, MOST, RAYS = 0.05, 10.0, 120
WIDTH, DEPTH, WIDE = 14.0, 10.0, 2.0
"""m: of the building, and of the corridor round its block."""
LAP = 2.0 * (WIDTH + DEPTH - 2.0 * WIDE)
"""m of a way round along the corridor's middle."""


def plan():
    """int8 (rows, columns) as nav_msgs/OccupancyGrid has it: the corridor, with cupboards that tell its sides apart."""
    cells = np.zeros((round(DEPTH / CELL), round(WIDTH / CELL)), np.int8)

    def wall(x0, y0, x1, y1):
        cells[round(y0 / CELL) : round(y1 / CELL), round(x0 / CELL) : round(x1 / CELL)] = 100

    for sides in (
        (0, 0, WIDTH, 0.1),
        (0, DEPTH - 0.1, WIDTH, DEPTH),
        (0, 0, 0.1, DEPTH),
        (WIDTH - 0.1, 0, WIDTH, DEPTH),
    ):
        wall(*sides)
    wall(WIDE, WIDE, WIDTH - WIDE, DEPTH - WIDE)
    for cupboard in (
        (3.0, 0.1, 4.1, 0.4),
        (8.4, 0.1, 8.8, 0.5),
        (13.5, 3.0, 13.9, 3.7),
        (13.6, 6.0, 13.9, 6.3),
        (9.0, 9.5, 10.5, 9.9),
        (5.0, 9.6, 5.3, 9.9),
        (0.1, 7.0, 0.6, 7.4),
        (0.1, 3.6, 0.4, 4.8),
    ):
        wall(*cupboard)
    return cells


def world():
    """The RangeMap, its lower left corner at the origin."""
    return RangeMap.from_occupancy(plan(), CELL, (0.0, 0.0, 0.0), 65)


def ranges(map_, pose, rng=None, rays=RAYS):
    """(n,) what a scanner on the robot measures from a pose (x, y, yaw), m; with a generator each is off by 0.01 m."""
    x, y, yaw = pose
    angles = yaw + angles_of(rays)
    found = np.array([map_echo.cast(map_.cells, x / CELL, y / CELL, float(a), MOST / CELL)[0] * CELL for a in angles])
    found[found >= MOST] = np.inf
    return found if rng is None else found + 0.01 * rng.standard_normal(rays)


def angles_of(rays=RAYS):
    return -0.75 * math.pi + 1.5 * math.pi / (rays - 1) * np.arange(rays)


def points(map_, pose, rng=None, rays=RAYS):
    """(m, 2) the echoes in the robot's frame, m."""
    measured, angles = ranges(map_, pose, rng, rays), angles_of(rays)
    echo = np.isfinite(measured)
    return np.stack((measured * np.cos(angles), measured * np.sin(angles)), 1)[echo]


def sweep(measured, stamp=1.0):
    """A Sweep of ranges."""
    angles = angles_of(len(measured))
    step = float(angles[1] - angles[0])
    return Sweep(stamp, float(angles[0]), float(angles[-1]), step, 0.0, 0.05, MOST, measured)


def scan(measured, odometry, stamp=1.0):
    """A ScanInput of ranges at a pose (x, y, yaw) of the odometry."""
    return ScanInput('laser', sweep(measured, stamp), Transform(), planar(odometry))


def planar(pose):
    """A Transform of (x, y, yaw)."""
    return Transform.from_xyz_rpy(pose[0], pose[1], 0.0, yaw=pose[2])


def round_trip(way, step=0.3):
    """[(x, y, yaw)] along the corridor's middle, counter-clockwise from its lower left corner, for so many metres; it
    turns within half a metre of each corner.
    """
    x1, y1 = WIDTH - 0.5 * WIDE, DEPTH - 0.5 * WIDE
    corners = np.array([(1.0, 1.0), (x1, 1.0), (x1, y1), (1.0, y1), (1.0, 1.0)])
    sides = np.hypot(*np.diff(corners, axis=0).T)
    ends = np.concatenate(([0.0], np.cumsum(sides)))
    poses = []
    for s in np.arange(0.0, way, step):
        at = s % ends[-1]
        x, y = (float(np.interp(at, ends, corners[:, k])) for k in (0, 1))
        heading = np.interp(
            at,
            [0.0, *(v for e in ends[1:4] for v in (e - 0.5, e + 0.5)), ends[-1] - 0.5, ends[-1]],
            np.array([0, 0, 1, 1, 2, 2, 3, 3, 3.5]) * 0.5 * math.pi,
        )
        poses.append((x, y, float(heading)))
    return poses


def drifting(path, turn=0.01, way=1.02):
    """The odometry of a path: each step `way` times as long as it was, and turned by `turn` rad per m more."""
    found = [path[0]]
    for before, after in zip(path, path[1:]):
        x, y, yaw = compose(inverse(before), after)
        found.append(compose(found[-1], (way * x, way * y, yaw + turn * math.hypot(x, y))))
    return found
