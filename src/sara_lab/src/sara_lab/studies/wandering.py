"""Drives of the simulated chair between random places of a map, recorded as a localization without a scanner hears
them: dead reckoning and the ranges of the nine ultrasonic sensors.

The rider sees the surroundings and steers by the joystick, as it has to be while nobody knows where the chair is: ways
are those of sara_nav's planner, driven by the rider `expert`. The chair starts anywhere where its body has room.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sara_bringup.lockstep.localization import Estimate
from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import Pose2D, compose, inverse, wrap
from sara_common.platforms import parameters
from sara_control.mux.joystick import Joystick, JoystickConfig
from sara_lab.journeys.crowd import crowd
from sara_lab.journeys.travel_cases import boxes, grid_of, map_file, random_of, random_poses, roomy_pose
from sara_lab.studies.kept_arrays import kept_arrays
from sara_nav.costmaps.costmap import INSCRIBED, InflationConfig, build
from sara_nav.planners.grid_planner import GridPlanner
from sara_nav.planners.planning import PlanError, path_length
from sara_sim.riders.driving import WayDriver
from sara_sim.riders.stick import CENTRED, Stick
from sara_sim.riders.way import rounded
from sara_sim.world.world import World

if TYPE_CHECKING:
    from canserial.reader.readings import RangeReading

ABOUT = '', 'boxes', 'pedestrians'
WAY = 25.0  # m that are driven
ROOM = 0.36  # m that ways keep from walls at least; they prefer SPACE
SPACE = InflationConfig(1.0, 3.0)
SHORTEST = 1.5  # m of a way
OPEN = 0.5  # m about the chair within which a way may be nearer to walls than ROOM
CORNER = 0.5  # m by which corners are cut
STICK_STEPS = 5  # 20 Hz: the stick is read
GETS_ON = (8.0, 0.4, 0.8)  # s in which the rider gets on by so many m or rad, or backs out
OUT = (3.5, 0.6)  # s, and share of full deflection
STUCK_S = 60.0  # without getting on by that much, and the drive ends
LIMIT_S = 300.0  # of driving


class Recording(NamedTuple):
    """What was heard and true. poses (n, 8): when it came (s), stamp, dead-reckoned x, y, yaw, which begins at 0, 0, 0,
    and true x, y, yaw in the map. ranges (m, 4): when it came, stamp, number of the sensor in `sensors`, range (m,
    REP-117). way: m driven.
    """

    poses: np.ndarray
    ranges: np.ndarray
    sensors: tuple[str, ...]
    way: float


class Ear(Estimate):
    """Localization that passes dead reckoning on, and keeps what it hears. chair: gives the true pose."""

    def __init__(self, inner, chair):
        super().__init__()
        self._inner, self._chair, self._first = inner, chair, None
        self.on_imu, self.on_odometry = inner.on_imu, inner.on_odometry
        self.poses, self.ranges, self.sensors = [], [], []

    def on_range(self, reading: RangeReading) -> None:
        """A canserial RangeReading."""
        if reading.name not in self.sensors:
            self.sensors.append(reading.name)
        self.ranges.append((self._chair.time, reading.stamp, self.sensors.index(reading.name), reading.range))

    def step(self, now: float) -> bool:
        """See Filter."""
        inner = self._inner
        if not inner.step(now):
            return False
        self.pose, self.velocity, self.stamp = inner.pose, inner.velocity, inner.stamp
        self.map_from_odom = inner.map_from_odom
        self._first = self._first or inverse(inner.pose)
        self.poses.append((now, inner.stamp, *compose(self._first, inner.pose), *self._chair.pose))
        return True


def record(name: str, number: int, about: str = '') -> Recording:
    """Drive `number` on a map: the seed of chair, start and way. about: what the map does not show, one of ABOUT."""
    random = random_of(name, 'wander', number)
    world = World.from_yaml(map_file(name))
    start = roomy_pose(grid_of(name), world, random)
    lockstep = Lockstep(map_file(name), start, number, ranges=False)
    for obstacle in boxes(name) if about == 'boxes' else crowd(name, number, start) if about == 'pedestrians' else ():
        lockstep.chair.world.obstacles.add(obstacle)
    ear = lockstep.localization = Ear(lockstep.localization, lockstep.chair)
    joystick = Joystick(JoystickConfig.from_params(parameters('sara_control', 'mux.yaml')['joystick']))
    lockstep.start_up()
    rider, way, end = _Rider(name, random), 0.0, lockstep.time + LIMIT_S
    moved = lockstep.time, lockstep.chair.pose
    while way < WAY and lockstep.time < min(end, moved[0] + STUCK_S):
        if lockstep.tick % STICK_STEPS == 0:
            command = joystick.on_axes(rider.stick(lockstep.time, lockstep.chair.pose), ())
            if command is not None:
                lockstep.wheels.on_command('joystick', *command, lockstep.time)
        before = lockstep.chair.pose
        lockstep.step()
        way += math.dist(before[:2], lockstep.chair.pose[:2])
        if math.dist(moved[1][:2], lockstep.chair.pose[:2]) > GETS_ON[1]:
            moved = lockstep.time, lockstep.chair.pose
    return Recording(np.array(ear.poses), np.array(ear.ranges), tuple(ear.sensors), way)


def kept(name: str, number: int, folder: Path, about: str = '') -> Recording:
    """As `record`; made once and kept in a folder."""
    path = folder / '_'.join(['wander', *filter(None, (about, name)), f'{number}.npz'])
    return kept_recording(path, lambda: record(name, number, about))


def kept_recording(path: Path, make: Callable[[], Recording]) -> Recording:
    """What a file holds; made first, and kept there, where there is none."""
    found = kept_arrays(path, lambda: make()._asdict())
    return Recording(found['poses'], found['ranges'], tuple(found['sensors'].tolist()), float(found['way']))


@cache
def _costmap(name):
    return build(grid_of(name), ROOM, inflation=SPACE)


class _Rider:
    """Drives from place to place. Where it does not get on it backs out or goes on straight, in turns, and chooses
    another place.
    """

    def __init__(self, name, random):
        self._name, self._places = name, random_poses(grid_of(name), random)
        self._driver = self._mark = self._until = None
        self._away = 1.0

    def stick(self, t, pose):
        """The Stick at t (s), at a pose (x, y, yaw)."""
        if self._until is not None:
            if t < self._until:
                return Stick(0.0, self._away * OUT[1])
            self._driver = self._until = None
        if self._mark is None or _apart(self._mark[1], pose):
            self._mark = t, pose
        if t - self._mark[0] > GETS_ON[0]:
            self._until, self._away, self._mark = t + OUT[0], -self._away, None
            return CENTRED
        if self._driver is None or self._driver.arrived:
            self._driver = self._next(pose)
        return self._driver.stick(t, pose)

    def _next(self, pose):
        costmap = _open_about(_costmap(self._name), pose)
        for place in self._places:
            try:
                plan = GridPlanner().plan(costmap, Pose2D(*pose), Pose2D(*place))
            except PlanError:
                continue
            points = [pose[:2], *plan[6:-6:6, :2].tolist(), place[:2]]
            if path_length(plan) >= SHORTEST:
                return WayDriver(rounded(points, CORNER))


def _apart(pose, other):
    return math.dist(pose[:2], other[:2]) > GETS_ON[1] or abs(wrap(pose[2] - other[2])) > GETS_ON[2]


def _open_about(costmap, pose):
    """The Costmap whose cells near a pose are passed as long as no wall is there: the chair got there, too."""
    costs, geometry = costmap.costs.copy(), costmap.geometry
    column, row = geometry.to_cell(*pose[:2])
    near = round(OPEN / geometry.resolution)
    about = costs[max(row - near, 0) : row + near + 1, max(column - near, 0) : column + near + 1]
    about[about == INSCRIBED] = INSCRIBED - 1
    return replace(costmap, costs=costs)
