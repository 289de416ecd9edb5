"""What journeys are drawn from: start and goal poses on a map, boxes that the map does not know, people who walk about;
each from a seed.

A pair is hard but fair: any pose about whose body PAIR_GAP is free, at start and goal, and a way between for the body
itself (body_space.py). No planner has a say in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from sara_bringup.paths import share
from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_lab.judge import gaps
from sara_lab.judge.body_space import BodySpace
from sara_lab.judge.contact_watch import PERSON
from sara_nav.costmaps.costmap import Costmap, InflationConfig, build
from sara_nav.maps import map_io
from sara_nav.planners.grid_planner import GridPlanner
from sara_nav.planners.planning import PlanError, path_length
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import World

MAPS = ('school', 'flat', 'hall')
PAIRS = 50
PAIR_GAP = 0.20  # m about the body at start and goal
NEAREST = 1.0  # m from start to goal at least
WAY_MARGIN = 0.03  # m that a way leaves about the body
BOXES, BOX_SIZE = 5, (0.3, 0.6)  # how many; m, shortest and longest side
BOX_MARGIN = 0.15  # m that a way leaves between body and box
PEOPLE, PERSON_RADIUS = 2, 0.25  # m
PERSON_SPEED = (0.4, 1.0)  # m/s, each walks at one of these
STROLL = 5  # places that somebody walks to, and back
PERSON_AWAY = 1.5  # m from the chair's start, where nobody begins


@dataclass(frozen=True)
class Pair:
    """Poses (x, y, yaw), m, rad; `way`: m, the shortest for a disc as wide as the body."""

    start: tuple
    goal: tuple
    way: float


def map_file(name: str) -> Path:
    """Path of a map's YAML file."""
    return share() / 'maps' / f'{name}.yaml'


@cache
def grid_of(name: str) -> map_io.GridMap:
    """A map."""
    return map_io.load_map(str(map_file(name)))


def random_of(name: str, purpose: str, *numbers: int) -> np.random.Generator:
    """The stream of luck of a purpose on a map."""
    return np.random.default_rng([sum(name.encode()), sum(purpose.encode()), *numbers])


def shortest_way(
    name: str, start: tuple[float, float, float], goal: tuple[float, float, float], radius: float | None = None
) -> tuple[np.ndarray | None, float]:
    """(n, 2) points and m of the shortest way for a disc of that radius (m; as wide as the body if None) between two
    places; (None, NaN) where there is none.
    """
    return way_on(_costmap_of(name, 0.5 * chosen().body.width if radius is None else radius), start, goal)


def way_on(costmap: Costmap, start: Sequence[float], goal: Sequence[float]) -> tuple[np.ndarray | None, float]:
    """(n, 2) points and m of the shortest way between two places on a Costmap; (None, NaN) where there is none."""
    try:
        plan = GridPlanner().plan(costmap, Pose2D(*start[:2], 0.0), Pose2D(*goal[:2], 0.0))
    except PlanError:
        return None, math.nan
    return plan[:, :2], path_length(plan)


def disc_costmap(grid: map_io.GridMap, radius: float) -> Costmap:
    """The Costmap of a map for a disc (m)."""
    return build(grid, radius, inflation=InflationConfig(radius, 10.0))


@cache
def _costmap_of(name, radius):
    return disc_costmap(grid_of(name), radius)


def _space(name, boxes=()):
    grid = grid_of(name)
    size, origin = grid.geometry.resolution, (grid.geometry.origin_x, grid.geometry.origin_y)
    apart = (_covered(grid, boxes), BOX_MARGIN) if boxes else None
    return BodySpace(grid.data != map_io.FREE, size, origin, chosen().size, WAY_MARGIN, apart)


def _covered(grid, boxes):
    """Cells whose middle a box reaches, give or take half a cell."""
    rows, columns = grid.data.shape
    size = grid.geometry.resolution
    x, y = np.meshgrid(
        grid.geometry.origin_x + size * (np.arange(columns) + 0.5),
        grid.geometry.origin_y + size * (np.arange(rows) + 0.5),
    )
    covered = np.zeros((rows, columns), bool)
    for box in boxes:
        c, s = math.cos(box.yaw), math.sin(box.yaw)
        dx, dy = x - box.at[0], y - box.at[1]
        covered |= (np.abs(c * dx + s * dy) < 0.5 * (box.size[0] + size)) & (
            np.abs(c * dy - s * dx) < 0.5 * (box.size[1] + size)
        )
    return covered


@cache
def pairs(name: str) -> list[Pair]:
    """The PAIRS of a map."""
    grid, world, space, random = grid_of(name), World.from_yaml(map_file(name)), _space(name), random_of(name, 'pairs')
    found = []
    while len(found) < PAIRS:
        start, goal = roomy_pose(grid, world, random), roomy_pose(grid, world, random)
        if math.dist(start[:2], goal[:2]) >= NEAREST and space.connected(start, goal):
            found.append(Pair(start, goal, shortest_way(name, start, goal)[1]))
    return tuple(found)


def random_poses(grid: map_io.GridMap, random: np.random.Generator) -> Iterator[tuple[float, float, float]]:
    """Poses (x, y, yaw) on free cells, without end."""
    free = np.argwhere(grid.data == map_io.FREE)
    while True:
        row, column = free[random.integers(len(free))]
        x, y = grid.geometry.to_world(int(column), int(row))
        off = grid.geometry.resolution * random.uniform(-0.5, 0.5, 2)
        yield float(x + off[0]), float(y + off[1]), float(random.uniform(-math.pi, math.pi))


def roomy_pose(grid: map_io.GridMap, world: World, random: np.random.Generator) -> tuple[float, float, float]:
    """A random pose about whose body PAIR_GAP is free."""
    return next(pose for pose in random_poses(grid, random) if gaps.at(world, pose, chosen().size) >= PAIR_GAP)


@cache
def boxes(name: str) -> list[Obstacle]:
    """The BOXES of a map, as Obstacles: placed at random, but so that every pair keeps PAIR_GAP at start and goal, and
    a way with BOX_MARGIN to the boxes.
    """
    grid, world, random, found = grid_of(name), World.from_yaml(map_file(name)), random_of(name, 'boxes'), []
    free = np.argwhere(grid.data == map_io.FREE)
    while len(found) < BOXES:
        row, column = free[random.integers(len(free))]
        box = Obstacle(
            f'box {len(found) + 1}',
            size=tuple(random.uniform(*BOX_SIZE, 2).tolist()),
            at=tuple(map(float, grid.geometry.to_world(int(column), int(row)))),
            yaw=float(random.uniform(-math.pi, math.pi)),
        )
        if world.overlaps(*box.at, box.yaw, *box.size):
            continue
        world.obstacles.add(box)
        roomy = all(
            gaps.at(world, pose, chosen().size) >= PAIR_GAP for pair in pairs(name) for pose in (pair.start, pair.goal)
        )
        if roomy and _all_connected(name, (*found, box)):
            found.append(box)
        else:
            world.obstacles.remove(box.name)
    return tuple(found)


def _all_connected(name, there):
    space = _space(name, there)
    return all(space.connected(pair.start, pair.goal) for pair in pairs(name))


def people(name: str, number: int) -> list[Obstacle]:
    """The PEOPLE who walk about on journey `number`, as Obstacles: to STROLL random places and back, never through a
    wall, whatever the chair does.
    """
    random, found, grid = random_of(name, 'people', number), [], grid_of(name)
    start = pairs(name)[number].start
    while len(found) < PEOPLE:
        places, path = [], []
        while len(places) < STROLL:
            row, column = np.argwhere(grid.data == map_io.FREE)[
                random.integers(np.count_nonzero(grid.data == map_io.FREE))
            ]
            place = tuple(map(float, grid.geometry.to_world(int(column), int(row))))
            if places:
                leg, _ = shortest_way(name, places[-1], place, PERSON_RADIUS + 0.05)
                if leg is None or len(leg) < 2:
                    continue
                path += [tuple(point) for point in leg.tolist()]
            elif math.dist(place, start[:2]) < PERSON_AWAY or _costmap_of(name, PERSON_RADIUS + 0.05).cost_at(*place):
                continue
            places.append(place)
        found.append(
            Obstacle(
                f'{PERSON} {len(found) + 1}',
                radius=PERSON_RADIUS,
                path=tuple(path),
                speed=float(random.uniform(*PERSON_SPEED)),
                loop='back',
            )
        )
    return tuple(found)
