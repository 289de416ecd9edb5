"""Drives of the simulated chair along the walls of a map and on to random places, recorded as a map builder with
the nine ultrasonic sensors alone hears them: dead reckoning of an uncalibrated chair, and ranges.

move_base drives by the true pose and the true map, as somebody would who knows where they are.
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
from sara_common.planar import Pose2D
from sara_lab.journeys.travel_cases import grid_of, map_file, random_of, roomy_pose
from sara_lab.studies.map_drives import Guided
from sara_lab.studies.wandering import Ear, Recording, kept_recording
from sara_nav.maps.map_io import FREE
from sara_sim.world.world import World

WAYS = {'room': 60.0, 'doorway': 80.0, 'flat': 150.0, 'school': 250.0}
"""m that are driven on each map."""
LIMIT_S, LEG_S = 1200.0, 120.0
"""Of a drive, and of the way to a place."""

PASSED, ALONG, APART = 0.40, (0.65, 0.90), 1.5
"""m: from walls where the chair's middle may be; where a stop is; between stops."""

Pose = tuple[float, float, float]


def stops(name: str, number: int, start: Pose) -> Iterator[Pose]:
    """Where drive `number` on a map goes: along the walls, each time to the nearest place that it has not been near,
    then to random places, without end.
    """
    grid, here = grid_of(name), start
    g = grid.geometry
    clear = distance_transform_edt(grid.data == FREE) * g.resolution
    passable = clear >= PASSED
    left = passable & (clear >= ALONG[0]) & (clear <= ALONG[1])
    graph = _neighbours(passable)
    while True:
        column, row = g.to_cell(*here[:2])
        near = passable[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3]
        if not near.any():
            break
        dr, dc = np.argwhere(near)[0]
        here_cell = (max(row - 2, 0) + dr) * g.width + max(column - 2, 0) + dc
        way = dijkstra(graph, indices=int(here_cell)).reshape(passable.shape) * g.resolution
        left &= way > APART
        there = np.where(left, way, math.inf)
        if not np.isfinite(there).any():
            break
        row, column = np.unravel_index(int(np.argmin(there)), there.shape)
        x, y = g.to_world(int(column), int(row))
        here = float(x), float(y), math.atan2(y - here[1], x - here[0])
        yield here
    random, world = random_of(name, 'sonar', number), World.from_yaml(map_file(name))
    while True:
        yield roomy_pose(grid, world, random)


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
    way, there = 0.0, stops(name, number, start)
    while way < WAYS[name] and lockstep.time < LIMIT_S:
        lockstep.result, end = None, min(lockstep.time + LEG_S, LIMIT_S)
        lockstep.move_base.set_goal(Pose2D(*next(there)), lockstep.time)
        while lockstep.result is None and way < WAYS[name]:
            if lockstep.time > end:
                lockstep.move_base.cancel(lockstep.time, f'not there after {LEG_S:.0f} s')
            before = lockstep.chair.pose
            lockstep.step()
            way += math.dist(before[:2], lockstep.chair.pose[:2])
    return Recording(np.array(ear.poses), np.array(ear.ranges), tuple(ear.sensors), way)


def kept(name: str, number: int, folder: Path) -> Recording:
    """As `record`; made once and kept in a folder."""
    return kept_recording(folder / f'sonar_{name}_{number}.npz', lambda: record(name, number))
