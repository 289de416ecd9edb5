"""Reading maps: a YAML file that names an image, as the ROS map format has it (map_server on the ROS wiki).

Modes: ``trinary`` (free, occupied, unknown), ``scale`` (shades between the thresholds kept as 1..98) and
``raw`` (pixel values as they are, wrapped into int8). ``map_saver`` writes what is read here.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass

import numpy as np
import yaml

from sara_common.grids import images
from sara_nav.grids.grid import GridError, GridGeometry

UNKNOWN, FREE, OCCUPIED = -1, 0, 100
MODES = ('trinary', 'scale', 'raw')
KEYS = ('image', 'resolution', 'origin', 'negate', 'occupied_thresh', 'free_thresh', 'mode')


class MapError(ValueError):
    """A map cannot be read; the message says which file and why."""


class MissingFile(MapError):
    """The YAML file is not there."""


class ImageError(MapError):
    """The image cannot be read."""


@dataclass(frozen=True)
class GridMap:
    """A map: int8 data (height, width) with row 0 at the bottom, its geometry, and the yaw of its origin (rad)."""

    data: np.ndarray
    geometry: GridGeometry
    origin_yaw: float = 0.0


@dataclass(frozen=True)
class MapDescription:
    """What the YAML file says: image, an absolute path; resolution, m per cell; origin (x m, y m, yaw rad) of the
    lower left corner; the thresholds, shares of black. unknown_keys: what else the file holds, which has no effect.
    """

    image: str
    resolution: float
    origin: tuple = (0.0, 0.0, 0.0)
    negate: bool = False
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196
    mode: str = 'trinary'
    unknown_keys: tuple = ()

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = []
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            result.append(f'resolution is {self.resolution!r}, allowed are numbers above 0 (m per cell)')
        if not all(math.isfinite(value) for value in self.origin):
            result.append(f'origin is {list(self.origin)!r}, allowed are finite numbers')
        for name in ('occupied_thresh', 'free_thresh'):
            if not 0.0 <= getattr(self, name) <= 1.0:
                result.append(f'{name} is {getattr(self, name)!r}, allowed are numbers from 0 to 1')
        if not result and self.mode != 'raw' and self.free_thresh > self.occupied_thresh:
            result.append(
                f'free_thresh is {self.free_thresh!r}, allowed is occupied_thresh ({self.occupied_thresh!r}) and less'
            )
        if self.mode not in MODES:
            result.append('mode is {!r}, allowed are {}'.format(self.mode, ', '.join(MODES)))
        return result


def occupancy(pixels: np.ndarray, mode: str, negate: bool, occupied_thresh: float, free_thresh: float) -> np.ndarray:
    """Turn an image into occupancy values.

    pixels: uint8 (rows, columns) grey, (rows, columns, 3) RGB or (rows, columns, 4) RGBA, row 0 at the top.
    Returns int8 (rows, columns) with row 0 at the bottom. With p the mean over the channels (after ``negate``)
    occ = (255 - p)/255; occ > occupied_thresh -> 100, occ < free_thresh -> 0, else unknown (-1), or in
    ``scale`` mode 1 + 98 (occ - free)/(occupied - free) cut to an integer. ``trinary`` counts the alpha of RGBA as
    a fourth channel, the other modes leave it out; where it is 0, ``scale`` says unknown.
    """
    pixels = np.asarray(pixels)
    alpha = pixels[:, :, 3] if pixels.ndim == 3 and pixels.shape[2] == 4 else None
    if pixels.ndim == 3:
        used = pixels if alpha is None or mode == 'trinary' else pixels[:, :, :3]
        shade = used.astype(np.float64).mean(axis=2)
    else:
        shade = pixels.astype(np.float64)
    if negate:
        shade = 255.0 - shade
    if mode == 'raw':
        return shade.astype(np.uint8).astype(np.int8)[::-1].copy()
    occ = (255.0 - shade) / 255.0
    if mode == 'scale':
        with np.errstate(divide='ignore', invalid='ignore'):
            ratio = (occ - free_thresh) / (occupied_thresh - free_thresh)
        ratio = np.nan_to_num(ratio, nan=0.0, posinf=0.0, neginf=0.0).clip(0.0, 1.0)
        values = (1.0 + 98.0 * ratio).astype(np.int8)
        if alpha is not None:
            values[alpha == 0] = UNKNOWN
    else:
        values = np.full(occ.shape, UNKNOWN, np.int8)
    values[occ < free_thresh] = FREE
    values[occ > occupied_thresh] = OCCUPIED
    return values[::-1].copy()


def occupied(data: np.ndarray) -> np.ndarray:
    """Return which cells of a map's data (int8) are occupied, as costmaps take them: 100 and more, in raw maps also
    what is below -1.
    """
    return (data >= OCCUPIED) | (data < UNKNOWN)


def load_description(path: str) -> MapDescription:
    """Read a map's YAML file; raises MapError with every fault in one sentence each."""
    entries = _read_entries(path)
    values, faults = _values(entries)
    description = MapDescription(
        image=os.path.join(os.path.dirname(os.path.abspath(path)), str(entries.get('image'))),
        mode=entries.get('mode', 'trinary'),
        unknown_keys=tuple(sorted(str(k) for k in set(entries) - set(KEYS))),
        **{'resolution': 1.0, **values, 'negate': bool(values.get('negate'))},
    )
    faults += description.faults()
    if faults:
        raise MapError('map file {}: {}'.format(path, '; '.join(faults)))
    return description


def _read_entries(path):
    """Return what a map's YAML file holds, a dict; raises MapError."""
    try:
        with open(path, encoding='utf-8') as stream:
            entries = yaml.load(stream, Loader=getattr(yaml, 'CSafeLoader', yaml.SafeLoader))
    except FileNotFoundError:
        raise MissingFile(f'map file {path} does not exist') from None
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise MapError(f'map file {path} cannot be read: {error}') from None
    if not isinstance(entries, dict):
        raise MapError(f'map file {path} must hold "name: value" lines')
    return entries


def _values(entries):
    """Return the numbers among a map's entries, {name: value}, and a sentence on each entry of a wrong kind."""
    faults = [f'{name} is missing' for name in KEYS if name not in entries and name != 'mode']
    values = {}
    for name in ('resolution', 'occupied_thresh', 'free_thresh'):
        if name in entries:
            number = _number(entries[name])
            if number is None:
                faults.append(f'{name} is {entries[name]!r}, allowed is a number')
            else:
                values[name] = number
    if 'origin' in entries:
        origin = entries['origin']
        numbers = [_number(v) for v in origin] if isinstance(origin, list) and len(origin) == 3 else [None]
        if None in numbers:
            faults.append(f'origin is {origin!r}, allowed is [x, y, yaw]')
        else:
            values['origin'] = tuple(numbers)
    if 'negate' in entries:
        values['negate'] = entries['negate']
        if values['negate'] not in (0, 1, True, False):
            faults.append('negate is {!r}, allowed are 0 and 1'.format(values['negate']))
    if 'image' in entries and (not isinstance(entries['image'], str) or not entries['image']):
        faults.append('image is {!r}, allowed is a file name'.format(entries['image']))
    return values, faults


def _number(value):
    """Return a float, or None for what is not a number. YAML 1.1 takes 5e-2 for a word; here it is a number."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    try:
        return float(value)
    except (ValueError, OverflowError):
        return None


def load_image(description: MapDescription) -> GridMap:
    """Return the GridMap that a MapDescription describes; raises MapError."""
    faults = description.faults()
    if faults:
        raise MapError('; '.join(faults))
    try:
        pixels = images.read_image(description.image)
    except images.ImageError as error:
        raise ImageError(f'map {error}') from None
    data = occupancy(
        pixels,
        description.mode,
        description.negate,
        description.occupied_thresh,
        description.free_thresh,
    )
    x, y, yaw = description.origin
    try:
        geometry = GridGeometry(data.shape[1], data.shape[0], description.resolution, x, y)
    except GridError as error:
        raise MapError(f'map image {description.image}: {error}') from None
    return GridMap(data, geometry, yaw)


def load_map(path: str) -> GridMap:
    """Read a map from its YAML file and return a GridMap; raises MapError."""
    return load_image(load_description(path))
