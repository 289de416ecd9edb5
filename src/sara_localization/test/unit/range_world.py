"""A room with range sensors in it, whose echoes are reckoned ray by ray in a grid that is finer than the map."""

import math

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_localization.ranges import map_echo
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_data import RangeData, RangeMap

CELL, CONE, LIMIT = 0.05, math.radians(60.0), 2.4
CONFIG = RangeConfig(range_topics=('/a',))
MOUNTS = {
    'front': (0.5, 0.1, 0.1),
    'left': (0.3, 0.3, math.pi / 2),
    'left_rear': (-0.3, 0.3, math.pi / 2),
    'right': (0.3, -0.3, -math.pi / 2),
    'rear': (-0.5, 0.0, math.pi),
}
SIZE = 6.0, 4.0  # m, of a room that begins at (0, 0)
CUPBOARD = 0.0, 2.8, 1.5, 4.0  # m, in its upper left corner


def room(things=(), cell=CELL, origin=(0.0, 0.0, 0.0)):
    """Walls of three cells about a free room with rectangles (x0, y0, x1, y1; m) in it."""
    nx, ny = round(SIZE[0] / cell), round(SIZE[1] / cell)
    data = np.full((ny + 6, nx + 6), 100, np.int8)
    data[3:-3, 3:-3] = 0
    for x0, y0, x1, y1 in things:
        a, b, c, d = (round(v / cell) + 3 for v in (x0, y0, x1, y1))
        data[b:d, a:c] = 100
    corner = compose(origin, (-3 * cell, -3 * cell, 0.0))
    return RangeMap.from_occupancy(data, cell, corner, 65)


def heard(fine, pose, mount):
    """m to the nearest surface in the cone that is not too steep, +Inf without one: walls are along x or y."""
    x, y, axis = compose(pose, mount)
    best = math.inf
    for k in range(61):
        angle = axis + math.radians(k - 30.0)
        u, v = (x - fine.origin[0]) / fine.resolution, (y - fine.origin[1]) / fine.resolution
        distance, what = map_echo.cast(fine.cells, u, v, angle, LIMIT / fine.resolution)
        if what != map_echo.OCCUPIED:
            continue
        before = [place + (distance - 0.01) * step for place, step in ((u, math.cos(angle)), (v, math.sin(angle)))]
        inside = [math.floor(b) != math.floor(b + 0.02 * s) for b, s in zip(before, (math.cos(angle), math.sin(angle)))]
        normal = (0.0 if math.cos(angle) > 0 else math.pi) if inside[0] else math.copysign(math.pi / 2, math.sin(angle))
        if abs(float(wrap(normal - axis))) <= math.radians(60.0):
            best = min(best, distance * fine.resolution)
    return best if best <= LIMIT else math.inf


def way(laps=1):
    """Poses every 0.1 m or 0.1 rad of laps round the room's lower half, from its lower left."""
    pose, poses = (1.2, 1.0, 0.0), [(1.2, 1.0, 0.0)]
    for metres in (3.0, 0.8, 3.0, 0.8) * laps:
        for steps, step in ((round(metres / 0.1), (0.1, 0.0, 0.0)), (16, (0.0, 0.0, math.pi / 32))):
            for _ in range(steps):
                pose = compose(pose, step)
                poses.append(pose)
    return poses


def drive(localizer, things, poses, seed=0, reckoned=(5.0, 5.0, 1.0)):
    """Let a localizer hear a drive, dead-reckoned from a pose with a drift; what became of the readings."""
    fine, random, said = room(things, 0.01), np.random.default_rng(seed), []
    before, stamp = poses[0], 10.0
    for pose in poses:
        dx, dy, turn = compose(inverse(before), pose)
        reckoned, before = compose(reckoned, (1.01 * dx, 1.01 * dy, 1.01 * turn)), pose
        for _ in range(2):
            stamp += 0.1
            localizer.on_pose(stamp, reckoned)
            for name, mount in MOUNTS.items():
                distance = heard(fine, pose, mount) + random.normal(0.0, 0.01)
                distance = math.inf if random.random() < 0.02 else distance
                said.append(localizer.on_range(RangeData(name, stamp, mount, distance, 0.16, 2.5, CONE)))
    return said
