"""Drives of the simulated chair as of somebody who draws a map, recorded as a map builder with the nine ultrasonic
sensors alone hears them: dead reckoning of an uncalibrated chair, and ranges.

move_base drives by the true pose and the true map, as somebody would who knows where they are: from one place near
walls to the next, with half a turn on the spot at each, and back to the start when all walls have been
near.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from sara_bringup.lockstep.localization import Filter
from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import Pose2D, wrap
from sara_lab.journeys.travel_cases import grid_of, map_file, random_of, roomy_pose
from sara_lab.judge.passed_walls import SeenWalls
from sara_lab.judge.walls import SPACING
from sara_lab.studies.map_drives import Guided
from sara_lab.studies.wandering import Ear, Recording, kept_recording
from sara_nav.maps.map_io import FREE
from sara_sim.world.world import World

MAPS = ('room', 'doorway', 'flat', 'school')
LIMIT_S, LEG_S, STOP_S = 1195.0, 45.0, 2.0
"""Of a drive, of the way to a place, and until the chair stands when it is given up."""
PASSED, TURNS, CLOSE = 0.36, 0.85, 1.2
"""m: from walls where the chair's middle may be; where it turns; at most where it turns."""
NEAR, NEARLY = 1.0, 0.1
"""m up to which a wall is near, or so much farther than from the nearest place."""
FARTHEST = 2.0
"""m from which a wall is looked at."""
APART = 3
"""Cells between such places."""
LEAST = 0.2
"""m of wall for which a place is driven to."""
SPEED, TURN_S = 0.12, 10.0
"""m/s, s by which the way to a place, and the half turn there, are weighed."""

Pose = tuple[float, float, float]


def stops(name: str, number: int, start: Pose) -> Iterator[Pose]:
    """Where drive `number` on a map goes: each time to the place that has most walls near that have not been near yet,
    for the time that it takes; at the end to the start.
    """
    grid, here = grid_of(name), start
    g = grid.geometry
    clear = distance_transform_edt(grid.data == FREE) * g.resolution
    graph = _neighbours(clear >= PASSED)
    cells, near = _views(grid, clear)
    left = np.ones(near.shape[1])
    while True:
        column, row = g.to_cell(*here[:2])
        way = dijkstra(graph, indices=row * g.width + column)[cells] * g.resolution
        gain = near @ left * SPACING
        worth = np.where(gain >= LEAST, gain / (way / SPEED + TURN_S), 0.0)
        best = int(np.argmax(worth))
        if worth[best] == 0.0:
            break
        left[near.indices[near.indptr[best] : near.indptr[best + 1]]] = 0.0
        x, y = g.to_world(int(cells[best] % g.width), int(cells[best] // g.width))
        here = float(x), float(y), math.atan2(y - here[1], x - here[0])
        yield here
        yield *here[:2], wrap(here[2] + math.pi)
    yield start


def _views(grid, clear):
    """Cells (n,) to turn at, and sparse (n, points on walls): 1 where that is near."""
    walls, g = SeenWalls(grid), grid.geometry
    rows, columns = np.nonzero((clear >= TURNS) & (clear <= CLOSE))
    some = (rows % APART == 0) & (columns % APART == 0)
    rows, columns = rows[some], columns[some]
    places = np.stack((g.origin_x + g.resolution * (columns + 0.5), g.origin_y + g.resolution * (rows + 0.5)), 1)
    seen = [walls.seen_from(place, FARTHEST) for place in places]
    place, point = np.repeat(np.arange(len(seen)), [len(of) for of in seen]), np.concatenate(seen)
    off = np.hypot(*(walls.points[point] - places[place]).T)
    least = np.full(len(walls.points), math.inf)
    np.minimum.at(least, point, off)
    near = off <= np.maximum(least[point] + NEARLY, NEAR)
    ones = np.ones(int(near.sum()))
    return rows * g.width + columns, csr_matrix((ones, (place[near], point[near])), (len(seen), len(walls.points)))


def _neighbours(passable):
    """Sparse (cells, cells): 1 between neighbours that can be passed."""
    cells = np.arange(passable.size).reshape(passable.shape)
    pairs = [
        np.stack((cells[:, :-1], cells[:, 1:]), -1)[passable[:, :-1] & passable[:, 1:]],
        np.stack((cells[:-1], cells[1:]), -1)[passable[:-1] & passable[1:]],
    ]
    first, second = np.concatenate(pairs).T
    ones = np.ones(2 * len(first))
    return csr_matrix((ones, (np.r_[first, second], np.r_[second, first])), (passable.size, passable.size))


def record(name: str, number: int) -> Recording:
    """Drive `number` on a map: the seed of chair, start and way."""
    world = World.from_yaml(map_file(name))
    start = roomy_pose(grid_of(name), world, random_of(name, 'map', number))
    lockstep = Lockstep(map_file(name), start, number, localization='fake')
    reckoned = Filter(start, 'ekf', 'default', lockstep.reader.config.variances)
    ear = Ear(reckoned, lockstep.chair)
    lockstep.localization = Guided(lockstep.localization, ear)
    lockstep.start_up()
    way = 0.0
    for stop in stops(name, number, start):
        if lockstep.time > LIMIT_S:
            break
        lockstep.result, end = None, min(lockstep.time + LEG_S, LIMIT_S)
        lockstep.move_base.set_goal(Pose2D(*stop), lockstep.time)
        while lockstep.result is None and lockstep.time < end + STOP_S:
            if lockstep.time > end:
                lockstep.move_base.cancel(lockstep.time, f'not there after {LEG_S:.0f} s')
            before = lockstep.chair.pose
            lockstep.step()
            way += math.dist(before[:2], lockstep.chair.pose[:2])
    return Recording(np.array(ear.poses), np.array(ear.ranges), tuple(ear.sensors), way)


def kept(name: str, number: int, folder: Path) -> Recording:
    """As `record`; made once and kept in a folder."""
    return kept_recording(folder / f'sonar_{name}_{number}.npz', lambda: record(name, number))
