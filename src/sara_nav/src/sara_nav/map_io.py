"""Reading maps: a YAML file that names an image, as the ROS map format has it (map_server on the ROS wiki).

Modes: ``trinary`` (free, occupied, unknown), ``scale`` (shades between the thresholds kept as 1..98) and
``raw`` (pixel values as they are, wrapped into int8).
"""
import math
import os
from dataclasses import dataclass

import numpy as np
import yaml
from PIL import Image

from sara_nav.grid import GridError, GridGeometry

UNKNOWN, FREE, OCCUPIED = -1, 0, 100
MODES = ('trinary', 'scale', 'raw')


class MapError(ValueError):
    """A map cannot be read; the message says which file and why."""


@dataclass(frozen=True)
class GridMap:
    """A map: int8 data (height, width) with row 0 at the bottom, its geometry, and the yaw of its origin (rad)."""

    data: np.ndarray
    geometry: GridGeometry
    origin_yaw: float = 0.0


@dataclass(frozen=True)
class MapDescription:
    """What the YAML file says; ``image`` is an absolute path."""

    image: str
    resolution: float
    origin: tuple
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str = 'trinary'


def occupancy(pixels, mode, negate, occupied_thresh, free_thresh):
    """Turn an image into occupancy values.

    pixels: uint8 (rows, columns) or (rows, columns, channels), row 0 at the top.
    Returns int8 (rows, columns) with row 0 at the bottom. With p the mean over the channels (after ``negate``)
    occ = (255 - p)/255; occ > occupied_thresh -> 100, occ < free_thresh -> 0, else unknown (-1), or in
    ``scale`` mode 1 + 98 (occ - free)/(occupied - free) cut to an integer. Of an image with several channels
    ``trinary`` averages all, the other modes all but the last one; a last channel of 0 is unknown in ``scale``.
    """
    pixels = np.asarray(pixels)
    last = None
    if pixels.ndim == 3:
        last = pixels[:, :, -1]
        used = pixels if mode == 'trinary' else pixels[:, :, :-1]
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
        if last is not None:
            values[last < 1] = UNKNOWN
    else:
        values = np.full(occ.shape, UNKNOWN, np.int8)
    values[occ < free_thresh] = FREE
    values[occ > occupied_thresh] = OCCUPIED
    return values[::-1].copy()


def load_description(path):
    """Read a map's YAML file; raises MapError with every fault in one sentence each."""
    try:
        with open(path, encoding='utf-8') as stream:
            entries = yaml.safe_load(stream)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MapError('map file %s cannot be read: %s' % (path, error)) from None
    if not isinstance(entries, dict):
        raise MapError('map file %s must hold "name: value" lines' % path)
    faults = []

    def number(name, allowed, check):
        value = entries.get(name)
        if name not in entries:
            faults.append('%s is missing' % name)
        elif isinstance(value, bool) or not isinstance(value, (int, float)) or not check(float(value)):
            faults.append('%s is %r but must be %s' % (name, value, allowed))
        else:
            return float(value)
        return math.nan

    resolution = number('resolution', 'a number > 0', lambda v: math.isfinite(v) and v > 0.0)
    occupied = number('occupied_thresh', 'a number in 0..1', lambda v: 0.0 <= v <= 1.0)
    free = number('free_thresh', 'a number in 0..1', lambda v: 0.0 <= v <= 1.0)
    origin = entries.get('origin')
    if (not isinstance(origin, (list, tuple)) or len(origin) != 3
            or not all(isinstance(v, (int, float)) and math.isfinite(v) for v in origin)):
        faults.append('origin is %r but must be [x, y, yaw]' % (origin,))
    negate = entries.get('negate')
    if negate not in (0, 1, True, False):
        faults.append('negate is %r but must be 0 or 1' % (negate,))
    mode = entries.get('mode', 'trinary')
    if mode not in MODES:
        faults.append('mode is %r but must be one of %s' % (mode, ', '.join(MODES)))
    image = entries.get('image')
    if not isinstance(image, str) or not image:
        faults.append('image is %r but must be a file name' % (image,))
    if faults:
        raise MapError('map file %s: %s' % (path, '; '.join(faults)))
    image = os.path.join(os.path.dirname(os.path.abspath(path)), image)
    return MapDescription(image, resolution, tuple(float(v) for v in origin), bool(negate), occupied, free, mode)


def read_image(path):
    """Return the pixels of an image as uint8, grey (rows, columns) or (rows, columns, channels); raises MapError.

    Any format that Pillow knows: pgm (plain or binary, 8 or 16 bit) and png above all.
    """
    try:
        with Image.open(path) as image:
            if image.mode not in ('L', 'LA', 'RGB', 'RGBA') and not image.mode.startswith('I'):
                image = image.convert('RGBA' if 'transparency' in image.info else 'RGB' if image.mode == 'P' else 'L')
            pixels = np.asarray(image)
    except FileNotFoundError as error:
        raise MapError('map image %s cannot be read: %s' % (path, error.strerror)) from None
    except (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError) as error:
        raise MapError('map image %s cannot be read: %s' % (path, error)) from None
    if pixels.dtype != np.uint8:  # 16 bits
        pixels = (pixels // 257).clip(0, 255).astype(np.uint8)
    return pixels


def load_map(path):
    """Read a map from its YAML file and return a GridMap; raises MapError."""
    description = load_description(path)
    data = occupancy(read_image(description.image), description.mode, description.negate,
                     description.occupied_thresh, description.free_thresh)
    x, y, yaw = description.origin
    try:
        geometry = GridGeometry(data.shape[1], data.shape[0], description.resolution, x, y)
    except GridError as error:
        raise MapError('map file %s: %s' % (path, error)) from None
    return GridMap(data, geometry, yaw)
