"""Worlds made by a seed: PER_KIND each of obstacles at four densities, of mazes with three widths of corridor, and of
offices with three widths of door; with a start and a goal that the ideal motion reaches.

Obstacles: pillars and boxes at random in a room. (BARN, D. Perille et al., "Benchmarking metric ground navigation",
SSRR 2020, has such worlds of cylinders.) Mazes: a spanning tree of a lattice of cells by depth-first search, some of
whose dead ends are opened. Offices: rooms with desks on both sides of a corridor.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from sara_bringup.lockstep.lockstep import world_of
from sara_lab.journeys.travel_cases import roomy_pose
from sara_lab.journeys.worlds.task import Task, task_of
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps import map_io
from sara_nav.maps.map_io import GridMap
from sara_sim.world.drawn import draw
from sara_sim.world.obstacles import Obstacle

CELL, WALL = 0.05, 0.10  # m: of a map; thickness of walls
DENSITIES = {'obstacles_15': 0.15, 'obstacles_25': 0.25, 'obstacles_35': 0.35, 'obstacles_45': 0.45}  # 1/m2
CORRIDORS = {'maze_110': 1.10, 'maze_125': 1.25, 'maze_140': 1.40}  # m
DOORS = {'office_80': 0.80, 'office_85': 0.85, 'office_95': 0.95}  # m
KINDS = (*DENSITIES, *CORRIDORS, *DOORS)
PER_KIND = 10
ROOM = (10.0, 8.0)  # m, of obstacles
PILLARS, SIDES = (0.15, 0.40), (0.20, 0.80)  # m: diameters of pillars, sides of boxes
MAZE = (6, 5)  # cells
OPENED = 0.3  # share of a maze's dead ends that are opened
OFFICE = (3, 3.5, 1.6)  # rooms on a side; m: depth of a room, width of the corridor
ROOM_WIDTHS = (3.0, 4.0)  # m
DESK, CABINET = (1.4, 0.7), (0.8, 0.4)  # m
FAR = 0.5  # share of the map's diagonal from start to goal at least
ENDS, TRIES = 40, 100  # pairs of poses that are drawn in a world; worlds that are drawn


@lru_cache(maxsize=4)
def made(kind: str, number: int) -> Task:
    """World `number` of one of the KINDS; the same every time. Raises ValueError for another kind."""
    if kind not in KINDS:
        raise ValueError(f'there is no kind {kind!r}; there are {", ".join(KINDS)}')
    random = np.random.default_rng([KINDS.index(kind), number, 2027])
    for _ in range(TRIES):
        shapes, size = _shapes(kind, random)
        grid = _grid(shapes, size)
        world = world_of(grid)
        ends = _ends(kind, grid, world, random)
        found = ends and task_of(kind, f'{kind}_{number}', number, grid, ends)
        if found:
            return found
    raise RuntimeError(f'{kind} {number}: none of {TRIES} worlds has a way')


def _ends(kind, grid, world, random):
    """Two roomy poses that are FAR apart, those of an office in its rooms; None where none were drawn."""
    geometry = grid.geometry
    far = FAR * geometry.resolution * math.hypot(geometry.width, geometry.height)
    corridor = 0.5 * OFFICE[2] + WALL if kind in DOORS else 0.0  # m on both sides of the middle
    middle = geometry.origin_y + 0.5 * geometry.height * geometry.resolution
    for _ in range(ENDS):
        ends = roomy_pose(grid, world, random), roomy_pose(grid, world, random)
        if math.dist(ends[0][:2], ends[1][:2]) >= far and all(abs(y - middle) >= corridor for _, y, _ in ends):
            return ends
    return None


def _shapes(kind, random):
    """(shapes, (m, m) of the room without its outer walls)."""
    if kind in DENSITIES:
        return _obstacles(DENSITIES[kind], random), ROOM
    if kind in CORRIDORS:
        return _maze(CORRIDORS[kind], random)
    return _office(DOORS[kind], random)


def _grid(shapes, size):
    """A map of the room with walls about it."""
    edge = round(WALL / CELL)
    columns, rows = (round(side / CELL) + 2 * edge for side in size)
    occupied = np.ones((rows, columns), bool)
    occupied[edge:-edge, edge:-edge] = False
    geometry = GridGeometry(columns, rows, CELL, -WALL, -WALL)
    draw(occupied, CELL, (-WALL, -WALL), shapes)
    return GridMap(np.where(occupied, map_io.OCCUPIED, map_io.FREE).astype(np.int8), geometry)


def _box(low, high, name='wall'):
    """A box between two corners (x, y), m."""
    (x0, y0), (x1, y1) = low, high
    return Obstacle(name, size=(x1 - x0, y1 - y0), at=(0.5 * (x0 + x1), 0.5 * (y0 + y1)))


def _obstacles(density, random):
    """As many pillars and boxes as the density says, half of each."""
    found = []
    for number in range(round(density * ROOM[0] * ROOM[1])):
        at = tuple(random.uniform((0.0, 0.0), ROOM).tolist())
        if number % 2:
            found.append(Obstacle('pillar', radius=0.5 * random.uniform(*PILLARS), at=at))
        else:
            sides = tuple(random.uniform(*SIDES, 2).tolist())
            found.append(Obstacle('box', size=sides, at=at, yaw=float(random.uniform(-math.pi, math.pi))))
    return found


def _maze(corridor, random):
    """(walls, size) of a maze."""
    pitch = corridor + WALL
    ways = _passages(random)
    size = MAZE[0] * pitch - WALL, MAZE[1] * pitch - WALL
    walls = []
    for i in range(MAZE[0]):
        for j in range(MAZE[1]):
            x, y = i * pitch, j * pitch
            if i + 1 < MAZE[0] and ((i, j), (i + 1, j)) not in ways:
                walls.append(_box((x + corridor, y - WALL), (x + pitch, y + pitch)))
            if j + 1 < MAZE[1] and ((i, j), (i, j + 1)) not in ways:
                walls.append(_box((x - WALL, y + corridor), (x + pitch, y + pitch)))
    return walls, size


def _passages(random):
    """The pairs of neighbouring cells of a maze that are joined."""
    ways, seen, stack = set(), {(0, 0)}, [(0, 0)]
    while stack:
        fresh = [cell for cell in _neighbours(stack[-1]) if cell not in seen]
        if not fresh:
            stack.pop()
            continue
        cell = fresh[random.integers(len(fresh))]
        ways.add(tuple(sorted((stack[-1], cell))))
        seen.add(cell)
        stack.append(cell)
    for cell in sorted(seen):
        closed = [other for other in _neighbours(cell) if tuple(sorted((cell, other))) not in ways]
        if len(_neighbours(cell)) - len(closed) == 1 and random.random() < OPENED:
            ways.add(tuple(sorted((cell, closed[random.integers(len(closed))]))))
    return ways


def _neighbours(cell):
    i, j = cell
    around = ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1))
    return [(a, b) for a, b in around if 0 <= a < MAZE[0] and 0 <= b < MAZE[1]]


def _office(door, random):
    """(walls and furniture, size) of an office."""
    count, depth, corridor = OFFICE
    widths = CELL * np.round(random.uniform(*ROOM_WIDTHS, count) / CELL)
    size = float(widths.sum()) + (count - 1) * WALL, 2 * (depth + WALL) + corridor
    shapes = []
    for low in (0.0, depth + 2 * WALL + corridor):
        x = 0.0
        inner = low - WALL if low else depth  # where the wall to the corridor begins
        for width in widths.tolist():
            shapes += _room(x, low, width, depth, random)
            jamb = x + CELL * round(random.uniform(0.2, width - door - 0.2) / CELL)
            shapes += [_box((x, inner), (jamb, inner + WALL)), _box((jamb + door, inner), (x + width, inner + WALL))]
            if x + width < size[0] - CELL:
                shapes.append(_box((x + width, low - WALL), (x + width + WALL, low + depth + WALL)))
            x += width + WALL
    return shapes, size


def _room(x, y, width, depth, random):
    """A desk and a cabinet somewhere in a room, along its walls."""
    found = []
    for length, deep in (DESK, DESK, CABINET):
        long, high = (length, deep) if random.random() < 0.5 else (deep, length)
        left, low = x + random.uniform(0.0, width - long), y + random.uniform(0.0, depth - high)
        side = random.integers(4)  # against one of the walls
        left = (x, x + width - long, left, left)[side]
        low = (low, low, y, y + depth - high)[side]
        found.append(_box((left, low), (left + long, low + high), 'furniture'))
    return found
