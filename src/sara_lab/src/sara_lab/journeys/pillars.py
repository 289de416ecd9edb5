"""Worlds of pillars: PILLARS of them stand at random in a room, with gaps that the body passes, and the chair drives
from one random pose to the next. The map shows them; sensors and safety gate are as on the chair.

Worlds like these show what takes pillars for pedestrians, for cones sweep over edges all the time. (BARN, D. Perille et
al., Benchmarking metric ground navigation, SSRR 2020, compares planners in worlds of cylinders.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.platforms import chosen
from sara_lab.journeys.judged import Judged
from sara_lab.journeys.travel import PATIENCE_S, Recorder, localization_of, reach
from sara_lab.judge.body_space import BodySpace
from sara_lab.judge.judge import judge
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps import map_io

WORLDS, GOALS = 10, 4
PILLARS, DIAMETER = 60, 0.15  # how many; m
TRIES = 20000  # places that are drawn until the room is taken for too full
GAP = 0.3  # m more than the body is wide, between two pillars at least
ROOM, EDGE, CELL, WALL = (12.0, 9.0), 0.5, 0.025, 10  # m; m without pillars at the walls; m; cells of wall
MARGIN = 0.10  # m about the body at start and goal, and on a way between
OFF_WALL, FAR = 0.8, 4.0  # m from a wall, and from the goal before, at least


@dataclass(frozen=True)
class Drive(Judged):
    """What came of a world: how many goals were reached, move_base's words, contacts, Judgement."""

    world: int
    mode: str
    reached: int
    texts: tuple[str, ...]
    recoveries: int
    contacts: tuple
    judgement: object

    @property
    def faults(self) -> list[str]:
        """What must not be, one sentence each."""
        return self.contact_faults


@cache
def world(number: int) -> tuple[map_io.GridMap, tuple[tuple[float, float, float], ...]]:
    """(the map; the start and GOALS goals as poses (x, y, yaw), m, rad) of a world."""
    random = np.random.default_rng([number, 7])
    grid = _grid(_places(random))
    geometry = grid.geometry
    origin = geometry.origin_x, geometry.origin_y
    space = BodySpace(grid.data != map_io.FREE, geometry.resolution, origin, chosen().size, MARGIN)
    poses = [_pose(space, random)]
    while len(poses) <= GOALS:
        pose = _pose(space, random)
        if math.dist(pose[:2], poses[-1][:2]) > FAR and space.connected(poses[-1], pose):
            poses.append(pose)
    return grid, tuple(poses)


def _places(random):
    """(PILLARS, 2) m: where the pillars stand; begun anew where a room fills up too badly for all of them."""
    low, high = (EDGE, EDGE), (ROOM[0] - EDGE, ROOM[1] - EDGE)
    while True:
        before = random.bit_generator.state
        drawn = random.uniform(low, high, (TRIES + 1, 2))[:TRIES]
        kept = _spread(drawn, chosen().body.width + GAP + DIAMETER)
        if len(kept) == PILLARS:  # what was drawn in vain is drawn again by whoever comes next
            random.bit_generator.state = before
            random.bit_generator.advance(2 * (kept[-1] + 1))
            return drawn[kept]


def _spread(places, apart):
    """Indices of those places, one after the other, PILLARS at most, that are so far from each that came before."""
    kept, left = [], np.arange(len(places))
    while len(left) and len(kept) < PILLARS:
        kept.append(left[0])
        left = left[np.hypot(*(places[left] - places[kept[-1]]).T) >= apart]
    return kept


def _grid(places):
    """The room with its pillars."""
    rows, columns = (round(side / CELL) + 2 * WALL for side in reversed(ROOM))
    data = np.full((rows, columns), map_io.OCCUPIED, np.int8)
    data[WALL:-WALL, WALL:-WALL] = map_io.FREE
    geometry = GridGeometry(columns, rows, CELL, -WALL * CELL, -WALL * CELL)
    x, y = np.meshgrid(
        geometry.origin_x + CELL * (np.arange(columns) + 0.5), geometry.origin_y + CELL * (np.arange(rows) + 0.5)
    )
    for place in places:
        data[np.hypot(x - place[0], y - place[1]) <= 0.5 * DIAMETER] = map_io.OCCUPIED
    return map_io.GridMap(data, geometry)


def _pose(space, random):
    """A pose about whose body MARGIN is free."""
    low, high = (OFF_WALL, OFF_WALL, -math.pi), (ROOM[0] - OFF_WALL, ROOM[1] - OFF_WALL, math.pi)
    while True:
        pose = tuple(random.uniform(low, high).tolist())
        if space.connected(pose, pose):
            return pose


def drive(number: int, mode: str, gain: float | None = None, navigation: dict | None = None) -> Drive:
    """Drive to the goals of a world one after the other, on the chair of that number. Returns the Drive.

    `mode` of travel.POSES. `gain`: of that chair's gyro (fused). `navigation`: a tree laid over sara_nav.yaml.
    """
    grid, poses = world(number)
    localization = localization_of(mode)
    lockstep = Lockstep(grid, poses[0], number, gain=gain, localization=localization, navigation=navigation)
    recorder = Recorder(lockstep)
    lockstep.start_up()
    goals = [reach(recorder, pose, 2.0 * PATIENCE_S)[0] for pose in poses[1:]]
    found = judge(recorder.track(goals), lockstep.chair.drive.world)
    return Drive(
        number,
        mode,
        sum(goal.reached for goal in goals),
        tuple(goal.text for goal in goals),
        recorder.recoveries,
        tuple(recorder.touched.contacts),
        found,
    )
