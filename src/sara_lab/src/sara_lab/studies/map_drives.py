"""Drives of the simulated chair, with its laser scanner, through the named places of a map and back to where it began,
recorded as a map builder hears them. move_base drives by the true pose and the true map.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sara_bringup.lockstep.localization import Estimate, Filter, Truth
from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import Pose2D, compose, inverse
from sara_lab.journeys.crowd import crowd
from sara_lab.journeys.travel_cases import grid_of, map_file, random_of, roomy_pose, shortest_way
from sara_lab.studies.kept_arrays import kept_arrays
from sara_nav.goals.move_base_config import SUCCEEDED
from sara_nav.maps import places
from sara_sim.world.world import World

if TYPE_CHECKING:
    from sara_control.wheels.odometry import OdometryState

LEG_S = 600.0  # from place to place
PEOPLE = 2

Pose = tuple[float, float, float]


class Drive(NamedTuple):
    """What was heard and true. poses (n, 7): stamp (s), the fused pose x, y, yaw (m, rad) from 0, 0, 0 on, and the true
    one in the map. stamps (m,): s, of the sweeps' first rays. ranges (m, rays), float32: m, REP 117. way: m driven.
    missed: places that were not come to. contacts: how often the body touched something.
    """

    poses: np.ndarray
    stamps: np.ndarray
    ranges: np.ndarray
    way: float
    missed: int
    contacts: int


class Guided(Estimate):
    """Localization that gives move_base the true pose, while another one, `reckoned`, hears the chair."""

    def __init__(self, truth: Truth, reckoned: Estimate) -> None:
        super().__init__()
        self._truth, self._reckoned = truth, reckoned
        self.on_imu, self.on_range = reckoned.on_imu, reckoned.on_range

    def on_odometry(self, state: OdometryState) -> None:
        """The controller's newest odometry."""
        self._reckoned.on_odometry(state)
        self._truth.on_odometry(state)
        for name in ('pose', 'velocity', 'stamp', 'map_from_odom'):
            setattr(self, name, getattr(self._truth, name))

    def step(self, now: float) -> bool:
        """See Filter."""
        self._reckoned.step(now)
        return self._truth.step(now)


class _Log:
    """Keeps of a Lockstep what a Drive needs."""

    def __init__(self, lockstep: Lockstep, start: Pose, reckoned: Filter) -> None:
        self._lockstep, self._into, self._reckoned = lockstep, inverse(start), reckoned
        self.poses, self.stamps, self.ranges, self.way = [], [], [], 0.0

    def step(self) -> None:
        """Step, and keep."""
        chair, before = self._lockstep.chair, self._lockstep.chair.pose
        self._lockstep.step()
        self.way += math.dist(before[:2], chair.pose[:2])
        known = self._reckoned
        if known.pose is not None and (not self.poses or known.stamp > self.poses[-1][0]):
            self.poses.append((known.stamp, *compose(self._into, known.pose), *chair.pose))
        if chair.scanner.scan is not None:
            self.stamps.append(chair.scanner.scan.stamp)
            self.ranges.append(chair.scanner.scan.ranges.astype(np.float32))


def tour(name: str, start: Pose) -> list[Pose]:
    """The named places of a map, from each the nearest one that is left, and the start at the end."""
    left = [(place.x, place.y, place.yaw) for place in places.load(places.beside(map_file(name))).values()]
    found, here = [], start
    while left:
        ways = [shortest_way(name, here, stop)[1] for stop in left]
        here = left.pop(int(np.nanargmin(ways)))
        found.append(here)
    return [*found, start]


def record(name: str, number: int, people: bool = False) -> Drive:
    """Drive `number` on a map: the seed of chair and start. people: PEOPLE pedestrians walk about."""
    world = World.from_yaml(map_file(name))
    start = roomy_pose(grid_of(name), world, random_of(name, 'map', number))
    lockstep = Lockstep(map_file(name), start, number, localization='fake', scan=True)
    for pedestrian in crowd(name, number, start, PEOPLE) if people else ():
        lockstep.chair.world.obstacles.add(pedestrian)
    reckoned = Filter(start, 'ekf', 'default', lockstep.reader.config.variances)
    lockstep.localization = Guided(lockstep.localization, reckoned)
    log, missed = _Log(lockstep, start, reckoned), 0
    lockstep.start_up()
    for stop in tour(name, start):
        lockstep.result, end = None, lockstep.time + LEG_S
        lockstep.move_base.set_goal(Pose2D(*stop), lockstep.time)
        while lockstep.result is None:
            if lockstep.time > end:
                lockstep.move_base.cancel(lockstep.time, f'not there after {LEG_S:.0f} s')
            log.step()
        missed += lockstep.result.status != SUCCEEDED
    return Drive(
        np.array(log.poses), np.array(log.stamps), np.array(log.ranges), log.way, missed, lockstep.chair.contacts
    )


def kept(name: str, number: int, people: bool, folder: Path) -> Drive:
    """As `record`; made once and kept in a folder."""
    path = folder / f'map_drive_{name}_{"people_" * people}{number}.npz'
    found = kept_arrays(path, lambda: record(name, number, people)._asdict())
    arrays = (found[name] for name in ('poses', 'stamps', 'ranges'))
    return Drive(*arrays, float(found['way']), int(found['missed']), int(found['contacts']))
