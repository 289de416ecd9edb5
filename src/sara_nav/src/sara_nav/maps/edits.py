"""What people draw over a map, kept beside it: MAP.edits.yaml. The map's image stays as it is, so that each edit can be
taken back.

    edits:
    - free: [[1.0, 2.0], [1.5, 2.5]]          # a rectangle by two opposite corners: nothing stands there
    - wall: [[3.0, 0.0], [3.0, 0.9]]          # a line by its two ends: closed, such as a door
    - keep_out: [[4.0, 1.0], [5.0, 2.0]]      # a rectangle where the robot is not to drive
    - slow: [[2.0, 3.8], [2.9, 4.0]]          # a rectangle where it drives slower, such as a threshold

Points are x, y (m) in the map frame; rectangles lie along its axes. Later edits cover earlier ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from sara_common.config import is_number
from sara_common.files import write_whole
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, GridMap, MapError

CLEARED, WALL, KEEP_OUT, SLOW = KINDS = 'free', 'wall', 'keep_out', 'slow'
SLOW_PERCENT = 40
"""Of the greatest speed, in slow places."""
MOST = 200
"""Edits that a map may have."""
FARTHEST = 1e4
"""m from the origin of the map frame."""
SMALLEST = 0.05
"""m that a wall is long and a rectangle's sides are, at least."""
REACH = 0.75
"""Cells whose middle is this near (in cells) to a wall's line belong to it: no gap, not even across a corner."""
Point = tuple[float, float]
Part = tuple[slice, slice]


class EditsError(MapError):
    """Edits that cannot be read, used or written; the message says which and why."""


@dataclass(frozen=True)
class Edit:
    """kind: one of KINDS. a, b: two opposite corners of a rectangle, or the ends of a wall; x, y (m), map frame."""

    kind: str
    a: Point
    b: Point

    @classmethod
    def of(cls, kind: str, points: Sequence[Sequence[float]]) -> Edit:
        """From the two points, as the file and the screen have them."""
        return cls(kind, *(tuple(map(float, point)) for point in points))

    def fault(self) -> str:
        """Return the sentence that says what is wrong with it, '' when nothing is."""
        if self.kind not in KINDS:
            return f'{self.kind!r} is no kind of edit, allowed are {", ".join(KINDS)}'
        if not all(math.isfinite(v) and abs(v) <= FARTHEST for v in (*self.a, *self.b)):
            return f'{self} must have finite numbers within {FARTHEST:g} m'
        width, height = (abs(p - q) for p, q in zip(self.a, self.b))
        size = math.hypot(width, height) if self.kind == WALL else min(width, height)
        if size < SMALLEST - 1e-9:
            what = 'length' if self.kind == WALL else 'sides'
            return f'{self} is too small: its {what} must be at least {SMALLEST} m'
        return ''

    def __str__(self):
        return f'{self.kind} [[{self.a[0]:g}, {self.a[1]:g}], [{self.b[0]:g}, {self.b[1]:g}]]'


def beside(map_yaml: Path | str) -> Path:
    """The edits file of a map's YAML file."""
    return Path(map_yaml).with_suffix('.edits.yaml')


def load(path: Path | str) -> tuple[Edit, ...]:
    """The Edits of a file in their order; none where there is no file. Raises EditsError with every fault at once."""
    path = Path(path)
    try:
        text = path.read_text(encoding='utf-8')
        content = yaml.load(text, Loader=getattr(yaml, 'CSafeLoader', yaml.SafeLoader))
    except FileNotFoundError:
        return ()
    except OSError as error:
        raise EditsError(f'{path}: {error.strerror}') from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # ValueError: of a text, a date or an endless number
        raise EditsError(f'{path} is no YAML: {" ".join(str(error).split())}') from None
    entries = content.get('edits', 0) if isinstance(content, dict) else 0
    if not isinstance(entries, list | None):
        raise EditsError(f'{path}: `edits` is missing; it holds a list of KIND: [[x, y], [x, y]], m')
    edits, faults = [], []
    for entry in entries or ():
        edit = _read(entry)
        fault = edit.fault() if edit else f'{entry!r} is no edit, allowed is KIND: [[x m, y m], [x m, y m]]'
        edits.append(edit)
        faults += [fault] if fault else []
    _check(path, edits, faults)
    return tuple(edits)


def _read(entry):
    """The Edit that an entry of the file stands for, None where it has another form."""
    if not isinstance(entry, dict) or len(entry) != 1:
        return None
    ((kind, points),) = entry.items()
    if not (isinstance(points, list) and len(points) == 2 and all(map(_is_point, points))):
        return None
    return Edit.of(str(kind), points)


def _is_point(value):
    return isinstance(value, list) and len(value) == 2 and all(isinstance(v, float) or is_number(v) for v in value)


def _check(path, edits, faults):
    if len(edits) > MOST:
        faults = [*faults, f'there are {len(edits)} edits, allowed are {MOST}']
    if faults:
        raise EditsError(f'{path}: {"; ".join(faults)}')


def write(path: Path | str, edits: Sequence[Edit]) -> None:
    """Write the Edits of a map, rounded to millimetres, whole or not at all. Raises EditsError."""
    path = Path(path)
    edits = [replace(edit, a=_rounded(edit.a), b=_rounded(edit.b)) for edit in edits]
    _check(path, edits, [fault for fault in (edit.fault() for edit in edits) if fault])
    name = path.name.removesuffix('.edits.yaml')
    lines = [
        f'# What is drawn over the map {name}: KIND: [[x, y], [x, y]], m in the map frame.',
        '# The touch screen writes this file anew; comments are not kept.',
        'edits:' if edits else 'edits: []',
        *(f'- {edit.kind}: {[list(edit.a), list(edit.b)]}' for edit in edits),
    ]
    try:
        write_whole(path, '\n'.join(lines) + '\n', path.stat().st_mode & 0o777 if path.exists() else 0o644)
    except OSError as error:
        raise EditsError(f'{path} cannot be written: {error.strerror}') from None


def _rounded(point):
    return tuple(round(float(v), 3) + 0.0 if math.isfinite(v) else v for v in point)


def drawn(grid_map: GridMap, edits: Sequence[Edit]) -> GridMap:
    """A GridMap with what is freed and walled; the same object where nothing is. Keep-out and slow places are not on
    it.
    """
    shown = [edit for edit in edits if edit.kind in (CLEARED, WALL)]
    if not shown:
        return grid_map
    data = np.array(grid_map.data, np.int8)
    for edit in shown:
        part, inside = _cells(grid_map.geometry, grid_map.origin_yaw, edit)
        data[part][inside] = OCCUPIED if edit.kind == WALL else FREE
    return replace(grid_map, data=data)


def keep_out_mask(grid_map: GridMap, edits: Sequence[Edit]) -> GridMap:
    """The keep-out places on a GridMap's cells: 100 where the robot is not to drive, 0 elsewhere."""
    return _mask(grid_map, edits, KEEP_OUT, OCCUPIED)


def speed_mask(grid_map: GridMap, edits: Sequence[Edit]) -> GridMap:
    """The slow places on a GridMap's cells: per cent of the greatest speed there, 0 elsewhere."""
    return _mask(grid_map, edits, SLOW, SLOW_PERCENT)


def _mask(grid_map, edits, kind, value):
    mask = np.zeros(grid_map.geometry.shape, np.int8)
    for edit in edits:
        if edit.kind == kind:
            part, inside = _cells(grid_map.geometry, grid_map.origin_yaw, edit)
            mask[part][inside] = value
    return replace(grid_map, data=mask)


def _cells(geometry: GridGeometry, yaw: float, edit: Edit) -> tuple[Part, np.ndarray]:
    """The cells of an Edit on a grid whose origin is turned by yaw (rad): a part (rows, columns) of it, and which of
    that part's cells they are.

    A rectangle's cells are those whose middle lies in it, or off it by up to half a cell; so it never misses all.
    """
    g, c, s = geometry, math.cos(yaw), math.sin(yaw)
    corners = np.array([(x, y) for x in (edit.a[0], edit.b[0]) for y in (edit.a[1], edit.b[1])])
    east, north = (corners - (g.origin_x, g.origin_y)).T / g.resolution
    columns, rows = c * east + s * north, c * north - s * east
    part = tuple(
        slice(*(int(v) for v in np.clip((np.floor(at.min()) - 1, np.ceil(at.max()) + 1), 0, size)))
        for at, size in ((rows, g.height), (columns, g.width))
    )
    v, u = np.mgrid[part] + 0.5
    x, y = g.origin_x + g.resolution * (c * u - s * v), g.origin_y + g.resolution * (s * u + c * v)
    if edit.kind == WALL:
        return part, _distance(x, y, edit.a, edit.b) <= REACH * g.resolution
    (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
    half = 0.5 * g.resolution
    return part, (abs(x - (left + right) / 2) <= (right - left) / 2 + half) & (
        abs(y - (low + high) / 2) <= (high - low) / 2 + half
    )


def _distance(x, y, a, b):
    """m from points to the line between a and b."""
    along = np.subtract(b, a)
    share = np.clip(((x - a[0]) * along[0] + (y - a[1]) * along[1]) / (along @ along), 0.0, 1.0)
    return np.hypot(x - a[0] - share * along[0], y - a[1] - share * along[1])
