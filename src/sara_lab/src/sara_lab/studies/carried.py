"""Drives of a robot with a laser scanner that is carried away: how soon amcl notices, and finds its place again.

The robot wanders between random places of a map, is lifted, carried to a place CARRIED (m) away and turned to a random
heading on the way, and wanders on; alone, or among the pedestrians of crowd.py. Scanner and odometry go on meanwhile.
Nobody tells the filter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from sara_bringup.lockstep.corrected import range_map
from sara_common.planar import wrap
from sara_lab.journeys.crowd import crowd
from sara_lab.journeys.travel_cases import grid_of, map_file, random_of, shortest_way
from sara_lab.studies.amcl_trial import Track
from sara_lab.studies.carrying import WALKS, Carrier, GyroOdometry, Pose
from sara_lab.studies.consistency import nees
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.amcl import Amcl
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.lost import NEAR, TURNED, Evidence
from sara_localization.particles.scan_input import ScanInput
from sara_localization.ranges.range_data import RangeMap
from sara_nav.maps import map_io
from sara_sim.robot.recording import recorded
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import RobotConfig, ScannerConfig
from sara_sim.robot.script import Along, Go, Script
from sara_sim.world.world import World

SCANNER = ScannerConfig(x=0.15, fov=math.radians(200.0), samples=201, rate=5, sweep=0.1, range_max=10.0)
ROBOT = RobotConfig(scanners=(SCANNER,))
MOUNT = Transform.from_xyz_rpy(SCANNER.x, SCANNER.y, SCANNER.z)
ROOM = 0.40  # m about the robot's middle that its ways keep free
SPEED = 0.8  # m/s
BEFORE = (5.0, 15.0)  # m driven until it is carried away
AFTER = 30.0  # m driven from then on
CARRIED = (2.0, 10.0)  # m
PAUSES = 0.3  # share of the places where it stands for PAUSE s
PAUSE = 3.0
TOLD = (0.1, 0.1, 0.1)  # m, m, rad: standard deviations of what the filter is told at the start
SLOWEST = 0.2  # m/s: a drive that gets on more slowly ends
PATIENCE = 30.0  # s that whoever carries the robot waits in all, until it is set down where it is
GROUPS = ('gyro', False), ('gyro', True), ('wheels', False)
"""What the odometry's heading is from, and whether pedestrians are about: the drives that are judged."""
KEEPS_HEADING = {'gyro': 0.95, 'wheels': 0.0}  # lost_keeps_heading by where the odometry's heading is from


class Case(NamedTuple):
    """A drive on a map: its number is the seed of everything. people: whether pedestrians are about; carried: whether
    the robot is carried away; heading: by what the odometry has it, a key of KEEPS_HEADING.
    """

    map: str
    number: int
    people: bool = False
    carried: bool = True
    heading: str = 'gyro'


class Step(NamedTuple):
    """After a scan that counted. way: m driven; after: m since the robot was lifted, 0 while carried, None before.
    off, turned: by how much the pose is wrong, m, rad. probability: of being lost. evidence: what that was judged by.
    nees: of amcl_pose with its covariance, None where none was due.
    """

    way: float
    after: float | None
    off: float
    turned: float
    probability: float
    evidence: Evidence | None = None
    nees: float | None = None

    @property
    def wrong(self) -> bool:
        """Whether the pose is wrong, as lost.py has it."""
        return self.off > NEAR or self.turned > TURNED


@cache
def world_map(name: str) -> RangeMap:
    """What the filter knows of a map."""
    return range_map(grid_of(name), AmclConfig.map_occupied_above)


class Wanderer:
    """Ways between random places of a map."""

    def __init__(self, name: str, world: World, random: np.random.Generator) -> None:
        self._name, self._world, self._random = name, world, random
        self._free = np.argwhere(grid_of(name).data == map_io.FREE)

    def pose(self) -> Pose:
        """A random pose where the robot has room."""
        while True:
            row, column = self._free[self._random.integers(len(self._free))]
            x, y = grid_of(self._name).geometry.to_world(int(column), int(row))
            pose = float(x), float(y), float(self._random.uniform(-math.pi, math.pi))
            if self._world.has_room(*pose, 2.0 * ROOM, 2.0 * ROOM):
                return pose

    def away_from(self, place: Pose) -> Pose:
        """A random pose CARRIED (m) away that it can drive to as well."""
        while True:
            pose = self.pose()
            if CARRIED[0] <= math.dist(pose[:2], place[:2]) <= CARRIED[1] and self.way(place, pose) is not None:
                return pose

    def script(self, start: Pose, metres: float) -> Script:
        """Motions of at least so many m."""
        motions, driven, at = [], 0.0, start
        while driven < metres:
            goal = self.pose()
            way = self.way(at, goal)
            if way is None:
                continue
            points, length = way
            motions.append(Along(tuple(map(tuple, points[5:-3:5].tolist())) + (goal[:2],), SPEED))
            if self._random.random() < PAUSES:
                motions.append(Go(PAUSE))
            driven, at = driven + length, goal
        return Script(motions)

    def way(self, start: Pose, goal: Pose) -> tuple[np.ndarray, float] | None:
        """(n, 2) points and m of the shortest way between two poses; None where there is none of a metre or more."""
        points, length = shortest_way(self._name, start, goal, ROOM)
        return None if points is None or length < 1.0 else (points, length)


def drive(case: Case, parameters: dict | None = None) -> Iterator[Step]:
    """The Steps of a drive. parameters: of amcl that differ from its defaults."""
    random = random_of(case.map, 'carried', case.number)
    world = World.from_yaml(map_file(case.map))
    wanderer = Wanderer(case.map, world, random)
    start = wanderer.pose()
    if case.people:
        for person in crowd(case.map, case.number, start):
            world.obstacles.add(person)
    robot = SimulatedRobot(world, ROBOT, case.number, start)
    own = {'seed': case.number, 'lost_keeps_heading': KEEPS_HEADING[case.heading]}
    amcl = Amcl(AmclConfig.from_params({**own, **(parameters or {})}))
    amcl.set_map(world_map(case.map))
    gyro = GyroOdometry(start, random_of(case.map, 'gyro', case.number)) if case.heading == 'gyro' else None
    watch = _Watch(robot, amcl, gyro)
    amcl.set_pose(start, np.diag(np.square(TOLD)))
    before = float(random.uniform(*BEFORE))
    yield from watch.drive(wanderer.script(start, before + AFTER), before + (0.0 if case.carried else AFTER))
    if case.carried:
        place = wanderer.away_from(robot.pose)
        while not world.has_room(*place, *ROBOT.size):  # somebody stands there
            place = wanderer.away_from(robot.pose)
        yield from watch.carry(wanderer.way(robot.pose, place), place)
        yield from watch.drive(wanderer.script(robot.pose, AFTER + 5.0), before + AFTER)


class _Watch:
    """Gives the filter what the robot measures, and compares. gyro: None where wheels alone tell the heading."""

    def __init__(self, robot, amcl, gyro):
        self.robot, self.amcl, self.gyro = robot, amcl, gyro
        self.odometry, self.truth = Track(), Track(robot.pose)
        self.way, self.lifted_at, self._last = 0.0, None, robot.pose

    def drive(self, script, until):
        """Steps until so many m are driven."""
        for moment in recorded(self.robot, script, (until - self.way) / SLOWEST):
            self.way += math.dist(moment.truth[:2], self._last[:2])
            yield from self._steps(moment)
            if self.way >= until:
                return

    def carry(self, way, place):
        """Steps while the robot is carried along a way to a place."""
        points, length = way
        points = np.concatenate(((self.robot.pose[:2],), points[1:-1], (place[:2],)))
        carrier = Carrier(self.robot, points, float(wrap(place[2] - self.robot.pose[2])))
        self.lifted_at = self.way
        for moment in recorded(self.robot, carrier, length / WALKS + PATIENCE):
            yield from self._steps(moment)
            if carrier.done:
                return

    def _steps(self, moment):
        """The Steps of a moment's scans."""
        self._last = moment.truth
        self.odometry.add(moment.t, moment.odometry if self.gyro is None else self.gyro.add(moment))
        self.truth.add(moment.t, moment.truth)
        for _, sweep in moment.scans:
            step = self._step(sweep)
            if step is not None:
                yield step

    def _step(self, sweep):
        truth = self.truth.at(sweep.stamp)
        placed, ended = (
            Transform.from_xyz_rpy(*odometry[:2], 0.0, 0.0, 0.0, odometry[2])
            for odometry in map(self.odometry.at, (sweep.stamp, sweep.stamp + sweep.duration))
        )
        result = self.amcl.on_scan(ScanInput('laser', sweep, MOUNT, placed, ended))
        if result is None or not result.counted:
            return None
        pose = result.map_from_odom @ placed
        x, y, yaw = _error((*pose.translation[:2], pose.yaw), truth).tolist()
        after = None if self.lifted_at is None else self.way - self.lifted_at
        told, lost = result.pose, self.amcl.lost
        consistent = None if told is None else nees(_error(told.pose, truth), told.covariance)
        return Step(self.way, after, math.hypot(x, y), abs(yaw), lost.probability, lost.evidence, consistent)


def _error(pose, truth):
    error = np.array(pose) - truth
    error[2] = wrap(error[2])
    return error
