"""What a skill is: a small world, where the chair starts, what it is to do there, and what it is scored by.

Points are those of the Wheelchair Skills Test, version 4.2 (R. L. Kirby et al., Dalhousie University, 2013): 2 where it
is done safely, 1 where it is done with difficulty, 0 where it is not done, or unsafe. Where its manual gives no figure,
the figure is chosen here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from sara_bringup.lockstep.lockstep import world_of
from sara_lab.journeys.tight_places import Rectangle
from sara_nav.maps.edits import Edit
from sara_nav.maps.map_io import GridMap
from sara_sim.world.obstacles import Thing
from sara_sim.world.terrain import Ramp, Threshold
from sara_sim.world.world import World

Pose = tuple[float, float, float]
"""x, y, yaw; m, rad, map frame."""
LOOSE, PATIENT = 2.0, 3.0  # 1 point: so many times as far off as 2 points allow, and so many times as long


class Move(NamedTuple):
    """What a rider does next. way: corners of a line to drive along, m, from where the chair is; empty: none. astern:
    backwards. yaw: heading to turn to in place after that, rad; None: it stays as it is.
    """

    way: tuple[tuple[float, float], ...] = ()
    astern: bool = False
    yaw: float | None = None


class Push(NamedTuple):
    """Drives towards something in the way until the chair stands. forward, left: of the stick, -1, 0 or 1. thing: what
    is in the way, which the map does not show. near: m from it, within which the chair is to come.
    """

    forward: float
    left: float
    thing: Rectangle
    near: float


class Criteria(NamedTuple):
    """What 2 points ask for. position: m, heading: deg, off a goal, at most. seconds: for all of it. box: what the body
    stays within, or None. astern: least share of the way that is driven backwards. turning: least share of the turning
    that is done while driving.
    """

    position: float = 0.30
    heading: float = 15.0
    seconds: float = 60.0
    box: Rectangle | None = None
    astern: float = 0.0
    turning: float = 0.0

    def words(self) -> str:
        """For 2 points, as briefly as a table needs."""
        said = [f'{self.position:.2f} m', f'{self.heading:.0f} deg', f'{self.seconds:.0f} s']
        if self.box is not None:
            said.append(f'in {self.box[2] - self.box[0]:.1f} x {self.box[3] - self.box[1]:.1f} m')
        if self.astern:
            said.append(f'{self.astern:.0%} of the way astern')
        if self.turning:
            said.append(f'{self.turning:.0%} of the turning while driving')
        return ', '.join(said)


def nothing(_world: World, _seed: int) -> tuple[Thing, ...]:
    """Nobody is about."""
    return ()


@dataclass(frozen=True)
class Skill:
    """item: what is asked for, and by whom. grid: the map. start: Pose. goals: Poses to come to, one after the other.
    moves: the same for a rider. criteria: Criteria. push: instead of goals and moves, a Push, or None. things: (World,
    seed) -> what is there and not on the map. ramps, thresholds: of the floor. edits: drawn over the map.
    """

    item: str
    grid: GridMap
    start: Pose
    goals: tuple[Pose, ...] = ()
    moves: tuple[Move, ...] = ()
    criteria: Criteria = Criteria()
    push: Push | None = None
    things: Callable[[World, int], tuple[Thing, ...]] = nothing
    ramps: tuple[Ramp, ...] = ()
    thresholds: tuple[Threshold, ...] = ()
    edits: tuple[Edit, ...] = ()

    def world(self, seed: int) -> World:
        """With all that stands, slopes and walks there."""
        world = world_of(self.grid)
        world.ramps.extend(self.ramps)
        world.thresholds.extend(self.thresholds)
        for thing in self.things(world, seed):
            world.obstacles.add(thing)
        return world

    def two(self) -> str:
        """What 2 points ask for, in words."""
        return f'stands, {self.push.near:.2f} m off at most' if self.push else self.criteria.words()

    def mirrored(self) -> Skill:
        """The same with left and right exchanged. For skills of a map, goals and moves alone."""
        geometry = self.grid.geometry
        across = 2.0 * geometry.origin_y + geometry.height * geometry.resolution
        box = self.criteria.box

        def pose(of):
            return of[0], across - of[1], -of[2]

        def move(of):
            way = tuple((x, across - y) for x, y in of.way)
            return Move(way, of.astern, None if of.yaw is None else -of.yaw)

        return Skill(
            self.item,
            GridMap(self.grid.data[::-1].copy(), geometry),
            pose(self.start),
            tuple(map(pose, self.goals)),
            tuple(map(move, self.moves)),
            self.criteria._replace(box=box and (box[0], across - box[3], box[2], across - box[1])),
        )


def straight(*points: tuple[float, float], astern: bool = False, yaw: float | None = None) -> Move:
    """The Move along a line through points."""
    return Move(tuple(points), astern, yaw)


LEFT, BEHIND = 0.5 * math.pi, math.pi
"""Headings, rad."""
