"""Others' worlds as tasks: ROS maps and Gazebo's worlds in a folder, with starts and goals from its list, LIST:

    worlds:
      - {world: house.yaml, start: [1.0, 2.0, 90], goal: [6.0, 2.0, 0]}                # a map of map_server
      - {world: 'barn/world_*.world', start: [-2.25, 3, 90], goal: [-2.25, 13, 90]}    # one task for each file
      - {world: arena.world, models: [models], scale: 2.0, start: [0, 0, 0], goal: [4, 0, 0]}

Poses are x, y (m) and yaw (deg), in the world's own frame and size. `scale`: by which it is made larger; without it,
the least, in steps of 5 %, with which the ideal motion finds a way, for many worlds were made for smaller robots.
`models`: folders, beside the list, in which models are looked for.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import yaml
from scipy.ndimage import distance_transform_edt, label

from sara_common.config import is_number
from sara_common.planar import wrap
from sara_common.platforms import chosen
from sara_lab.journeys.travel_cases import WAY_MARGIN
from sara_lab.journeys.worlds.task import Task, task_of
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps import map_io
from sara_nav.maps.map_io import GridMap, MapError
from sara_sim.world.drawn import draw
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.sdf import Scene, read_sdf
from sara_sim.world.world import WorldError

LIST = 'worlds.yaml'
KIND = 'foreign'
CELL = 0.05  # m per cell of a map that is drawn of a Gazebo world
EDGE = 1.5  # m of floor about what stands in it
LARGER, LARGEST = 1.05, 8.0  # from one scale to the next; the last one
MOST_CELLS = 4_000_000  # of a map that is looked for a way
GAZEBO = ('.world', '.sdf')
KEYS = ('world', 'start', 'goal', 'scale', 'models')


class ForeignError(ValueError):
    """A list, or a world in it, that cannot be used; the text is a sentence for the terminal."""


@dataclass(frozen=True)
class Entry:
    """A world of a list: its `file`, `start` and `goal` (x m, y m, yaw rad), `scale` (None: the least that fits), and
    the folders of its `models`.
    """

    file: Path
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    scale: float | None = None
    models: tuple[Path, ...] = ()

    @property
    def name(self) -> str:
        """Of its file."""
        return self.file.stem


def entries(folder: Path) -> list[Entry]:
    """What the folder's list holds, in its order. Raises ForeignError with every fault at once."""
    path = Path(folder) / LIST
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ForeignError(f'{path} cannot be read: {" ".join(str(error).split())}') from error
    rows = content.get('worlds') if isinstance(content, dict) else None
    if not isinstance(rows, list) or not rows:
        raise ForeignError(f'{path} must hold a list `worlds`')
    faults = [fault for number, row in enumerate(rows, 1) for fault in _faults(row, f'world {number}')]
    found = [] if faults else [entry for row in rows for entry in _entries_of(row, path.parent)]
    names = [entry.name for entry in found]
    faults += [f'two worlds are called {name}' for name in sorted({name for name in names if names.count(name) > 1})]
    faults += [f'{row["world"]}: there is no such file' for row in rows if not faults and not _files(row, path.parent)]
    if faults:
        raise ForeignError(f'{path}: {"; ".join(faults)}')
    return found


def _faults(row, which):
    if not isinstance(row, dict):
        return [f'{which} is {row!r}, allowed are {", ".join(KEYS)}']
    found = [f'{which}: there is no {key!r}, but {", ".join(KEYS)}' for key in row if key not in KEYS]
    if not (isinstance(row.get('world'), str) and row['world']):
        found.append(f'{which}: world is {row.get("world")!r}, allowed is the name of a file, or a pattern')
    elif Path(row['world']).is_absolute():
        found.append(f'{which}: world is {row["world"]!r}, allowed are files in the folder of the list')
    for key in ('start', 'goal'):
        pose = row.get(key)
        if not (isinstance(pose, list) and len(pose) == 3 and all(map(is_number, pose))):
            found.append(f'{which}: {key} is {pose!r}, allowed is [x m, y m, yaw deg]')
    if 'scale' in row and not (is_number(row['scale']) and 0.0 < row['scale'] <= LARGEST):
        found.append(f'{which}: scale is {row["scale"]!r}, allowed are numbers above 0, up to {LARGEST:g}')
    models = row.get('models', [])
    if not (isinstance(models, list) and all(isinstance(name, str) for name in models)):
        found.append(f'{which}: models is {models!r}, allowed is a list of folders')
    return found


def _files(row, folder):
    return sorted(folder.glob(row['world']))


def _entries_of(row, folder):
    start, goal = ((float(x), float(y), wrap(math.radians(yaw))) for x, y, yaw in (row['start'], row['goal']))
    models = tuple(folder / name for name in row.get('models', ()))
    return [Entry(file, start, goal, row.get('scale'), models) for file in _files(row, folder)]


def digest(folder: Path) -> str:
    """Eight characters that are others once a file in the folder is another."""
    found = hashlib.sha1()
    for path in sorted(path for path in Path(folder).rglob('*') if path.is_file()):
        found.update(str(path.relative_to(folder)).encode() + b'\0' + path.read_bytes())
    return found.hexdigest()[:8]


@lru_cache(maxsize=2)
def foreign(entry: Entry, number: int) -> Task:
    """The Task of a world; its number draws the chair. Raises ForeignError where the world cannot be read, or no scale
    has a way from start to goal.
    """
    drawn, found = _drawing(entry), None
    given = entry.scale is not None
    scale = entry.scale if given else _least_scale(drawn(1.0), entry)
    while not found:
        grid = drawn(scale)
        if scale > LARGEST or grid.data.size > MOST_CELLS:
            break
        ends = [(scale * x, scale * y, yaw) for x, y, yaw in (entry.start, entry.goal)]
        found = task_of(KIND, entry.name, number, grid, ends, scale)
        if given:
            break
        scale *= LARGER
    if not found:
        which = f'scale {scale:g}' if given else f'a scale of 1 to {scale:.2g}'
        raise ForeignError(f'{entry.file}: no way for the body leads from start to goal at {which}')
    return found


def _drawing(entry):
    """A function of the scale that gives the world's GridMap."""
    try:
        if entry.file.suffix in GAZEBO:
            scene = read_sdf(entry.file, entry.models)
            if not scene.shapes:
                raise ForeignError(f'{entry.file}: nothing stands in it; left out: {"; ".join(scene.left_out)}')
            return lambda scale: drawn_map(scene, scale, (entry.start, entry.goal))
        grid = map_io.load_map(str(entry.file))
    except (WorldError, MapError) as error:
        raise ForeignError(str(error)) from error
    if grid.origin_yaw:
        raise ForeignError(f'{entry.file}: its origin is turned by {grid.origin_yaw:g} rad; turned maps are not driven')
    return lambda scale: scaled(grid, scale)


def drawn_map(scene: Scene, scale: float, places: Sequence[Sequence[float]] = ()) -> GridMap:
    """A Scene as a map, made larger by `scale`: EDGE of floor about what stands in it and about `places` (x, y; m)."""
    shapes = [_larger(shape, scale) for shape in scene.shapes]
    points = [(scale * x, scale * y) for x, y, *_ in places]
    for shape in shapes:
        reach = shape.radius or 0.5 * math.hypot(*shape.size)
        points += [(shape.at[0] - reach, shape.at[1] - reach), (shape.at[0] + reach, shape.at[1] + reach)]
    low, high = np.min(points, axis=0) - EDGE, np.max(points, axis=0) + EDGE
    x, y = (CELL * math.floor(value / CELL) for value in low)
    columns, rows = math.ceil((high[0] - x) / CELL), math.ceil((high[1] - y) / CELL)
    occupied = np.zeros((rows, columns), bool)
    draw(occupied, CELL, (x, y), shapes)
    data = np.where(occupied, map_io.OCCUPIED, map_io.FREE).astype(np.int8)
    return GridMap(data, GridGeometry(columns, rows, CELL, x, y))


def _larger(shape: Obstacle, scale: float) -> Obstacle:
    at = scale * shape.at[0], scale * shape.at[1]
    if shape.radius is not None:
        return replace(shape, radius=scale * shape.radius, at=at)
    return replace(shape, size=(scale * shape.size[0], scale * shape.size[1]), at=at)


def scaled(grid: GridMap, scale: float) -> GridMap:
    """A map made larger about its frame's origin, its cells as wide as before: each takes the nearest's value."""
    geometry = grid.geometry
    rows, columns = (max(1, round(scale * count)) for count in grid.data.shape)
    of_rows, of_columns = (
        np.minimum(((np.arange(count) + 0.5) / scale).astype(int), whole - 1)
        for count, whole in zip((rows, columns), grid.data.shape)
    )
    data = np.ascontiguousarray(grid.data[np.ix_(of_rows, of_columns)])
    place = scale * geometry.origin_x, scale * geometry.origin_y
    return GridMap(data, GridGeometry(columns, rows, geometry.resolution, *place), grid.origin_yaw)


def _least_scale(grid: GridMap, entry: Entry) -> float:
    """A scale, 1 or more, below which not even a disc as wide as the body gets from start to goal."""
    room = grid.geometry.resolution * distance_transform_edt(grid.data == map_io.FREE)
    ends = [grid.geometry.to_cell(*pose[:2]) for pose in (entry.start, entry.goal)]
    if None in ends:
        raise ForeignError(f'{entry.file}: start or goal is off the map')
    (start, goal), low, high = [(row, column) for column, row in ends], 0.0, float(room.max())
    while high - low > 0.5 * grid.geometry.resolution:
        middle = 0.5 * (low + high)
        labels, _ = label(room > middle)
        low, high = (middle, high) if labels[start] and labels[start] == labels[goal] else (low, middle)
    if low == 0.0:
        raise ForeignError(f'{entry.file}: start and goal are not joined by free cells')
    return max(1.0, (0.5 * chosen().body.width + WAY_MARGIN) / (high + grid.geometry.resolution))
