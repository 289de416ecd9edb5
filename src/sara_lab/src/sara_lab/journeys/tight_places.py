"""Tight places, each entered and left again: T-junctions and bends of corridors, a lift, a dead end, and the place at a
table between two neighbours. Sensors and safety gate are as on the chair; the pose is the true one, or fused.

The body fits with FITS on every side, which body_space.py tells without any planner. The lift's cabin is the smallest
that takes a wheelchair and a companion (EN 81-70, type 2: 1.1 m wide, 1.4 m deep).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import Pose2D, wrap
from sara_common.platforms import chosen
from sara_lab.journeys.judged import Judged
from sara_lab.journeys.travel import POSITION_M, YAW_DEG, Recorder, localization_of, reach
from sara_lab.judge.body_space import BodySpace
from sara_lab.judge.judge import judge
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps import map_io

CELL = 0.05  # m
FITS = 0.05  # m about the body, on its way in and out
CORRIDORS = (0.95, 1.00, 1.10, 1.20)  # m wide
BENDS = CORRIDORS[1:]  # round one of 0.95 m the body does not fit
CHAIRS = 10
SIDEWAYS_M, OFF_RAD = 0.04, 0.08  # a start in a corridor is off its middle by so much at most
PATIENCE_S = 180.0  # for either goal

Rectangle = tuple[float, float, float, float]
"""x0, y0, x1, y1, m."""


class Place(NamedTuple):
    """grid: the map. start, goal: poses (x, y, yaw), m, rad; the second goal is the start. roomy: whether there is room
    at the start for any heading.
    """

    grid: map_io.GridMap
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    roomy: bool

    def mirrored(self) -> Place:
        """The same with left and right exchanged."""
        geometry = self.grid.geometry
        across = 2.0 * geometry.origin_y + geometry.height * geometry.resolution
        grid = map_io.GridMap(self.grid.data[::-1].copy(), geometry)
        start, goal = ((x, across - y, -yaw) for x, y, yaw in (self.start, self.goal))
        return Place(grid, start, goal, self.roomy)

    def fits(self) -> bool:
        """Whether the body gets in and out with FITS about it."""
        geometry = self.grid.geometry
        origin = geometry.origin_x, geometry.origin_y
        space = BodySpace(self.grid.data != map_io.FREE, geometry.resolution, origin, chosen().size, FITS)
        return space.connected(self.start, self.goal)


@dataclass(frozen=True)
class Visit(Judged):
    """What came of a place: whether the chair went in and came out again, move_base's words, contacts, Judgement."""

    place: str
    mode: str
    number: int
    went_in: bool
    came_out: bool
    texts: tuple[str, ...]
    recoveries: int
    contacts: tuple
    judgement: object

    @property
    def faults(self) -> list[str]:
        """What does not hold, one sentence each."""
        found = self.contact_faults
        if not self.came_out:
            found.append(f'{"came not out" if self.went_in else "went not in"}: {self.texts[-1]}')
        return found


def block(size: tuple[float, float], hollows: Iterable[Rectangle], things: Iterable[Rectangle] = ()) -> map_io.GridMap:
    """A block (m) with hollows cut out of it, and things put into them; 0.5 m of wall about it."""
    data = np.full([round(side / CELL) + 20 for side in reversed(size)], map_io.OCCUPIED, np.int8)
    for value, rectangles in ((map_io.FREE, hollows), (map_io.OCCUPIED, things)):
        for rectangle in rectangles:
            x0, y0, x1, y1 = (round(side / CELL) + 10 for side in rectangle)
            data[y0:y1, x0:x1] = value
    rows, columns = data.shape
    return map_io.GridMap(data, GridGeometry(columns, rows, CELL, -10 * CELL, -10 * CELL))


def _junction(width: float, beyond: float) -> Place:
    """A corridor with an arm to the left, which goes on for so far (m) beyond it."""
    corridor, arm = (0.0, 0.0, 4.0 + width + beyond, width), (4.0, 0.0, 4.0 + width, width + 4.0)
    middle, half = 4.0 + 0.5 * width, 0.5 * width
    grid = block((corridor[2], arm[3]), (corridor, arm))
    return Place(grid, (1.5, half, 0.0), (middle, width + 2.0, 0.5 * math.pi), False)


def _lift() -> Place:
    """A cabin of 1.1 x 1.4 m behind a door of 0.90 m."""
    grid = block((5.6, 4.0), ((0.0, 0.0, 4.0, 4.0), (4.0, 1.55, 4.2, 2.45), (4.2, 1.45, 5.6, 2.55)))
    return Place(grid, (1.5, 2.0, 0.0), (4.9, 2.0, 0.0), True)


def _dead_end() -> Place:
    """A corridor of 0.95 m that ends after 4 m."""
    grid = block((7.0, 4.0), ((0.0, 0.0, 3.0, 4.0), (3.0, 1.5, 7.0, 2.45)))
    return Place(grid, (1.5, 2.0, 0.0), (6.1, 1.975, 0.0), True)


def _table(yaw: float) -> Place:
    """A table with 0.75 m between the neighbours who sit at it, 0.8 m deep."""
    things = (3.6, 1.0, 4.6, 4.0), (2.8, 1.3, 3.6, 2.1), (2.8, 2.85, 3.6, 3.65)
    grid = block((5.0, 5.0), ((0.0, 0.0, 5.0, 5.0),), things)
    return Place(grid, (1.2, 2.5, 0.0), (2.85, 2.475, yaw), True)


@cache
def places() -> dict[str, Place]:
    """All by name."""
    return {
        **{f't_junction_{width:.2f}': _junction(width, 3.0) for width in CORRIDORS},
        **{f'bend_{width:.2f}': _junction(width, 0.0) for width in BENDS},
        'lift': _lift(),
        'dead_end': _dead_end(),
        'table_nose_first': _table(0.0),
        'table_rear_first': _table(math.pi),
    }


def visit(name: str, mode: str, number: int, gain: float | None = None, navigation: dict | None = None) -> Visit:
    """Go into a place and out again on chair `number`, which draws the heading at the start, mirrored for odd numbers.
    Returns the Visit.

    `mode` of travel.POSES. `gain`: of that chair's gyro (fused). `navigation`: a tree laid over sara_nav.yaml.
    """
    place = places()[name].mirrored() if number % 2 else places()[name]
    random = np.random.default_rng([number, sum(name.encode())])
    off = random.uniform(-1.0, 1.0, 2)
    x, y, yaw = place.start
    begin = x, y + SIDEWAYS_M * float(off[0]), wrap(yaw + float(off[1]) * (math.pi if place.roomy else OFF_RAD))
    localization = localization_of(mode)
    lockstep = Lockstep(place.grid, begin, number, gain=gain, localization=localization, navigation=navigation)
    recorder, goals = Recorder(lockstep), []
    lockstep.start_up()
    for pose in (place.goal, place.start):
        ended, _ = reach(recorder, pose, PATIENCE_S)
        goals.append((ended, ended.reached and _is_at(lockstep.chair.pose, pose, mode)))
        if not goals[-1][1]:
            break
    found = judge(recorder.track([ended for ended, _ in goals]), lockstep.chair.drive.world)
    there = [at for _, at in goals]
    texts = tuple(ended.text for ended, _ in goals)
    contacts = tuple(recorder.touched.contacts)
    return Visit(name, mode, number, there[0], len(there) > 1 and there[1], texts, recorder.recoveries, contacts, found)


def _is_at(pose, goal, mode):
    """Whether a pose is that of a goal, as travel.py asks."""
    pose, goal = Pose2D(*pose), Pose2D(*goal)
    turned = abs(math.degrees(wrap(pose.yaw - goal.yaw)))
    return pose.distance(goal) <= POSITION_M[mode] and turned <= YAW_DEG[mode]
