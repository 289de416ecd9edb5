"""Reading maps: a YAML file that names an image, as the ROS map format has it (map_server on the ROS wiki).

Modes: ``trinary`` (free, occupied, unknown), ``scale`` (shades between the thresholds kept as 1..98) and
``raw`` (pixel values as they are, wrapped into int8).
"""
import math
import os
import re
from dataclasses import dataclass

import numpy as np
import yaml

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

    PGM is read here; anything else by OpenCV, which is loaded only then, as it is slow to start.
    """
    try:
        with open(path, 'rb') as stream:
            content = stream.read()
    except OSError as error:
        raise MapError('map image %s cannot be read: %s' % (path, error.strerror)) from None
    if content[:2] in (b'P5', b'P2'):
        try:
            return parse_pgm(content)
        except ValueError as error:
            raise MapError('map image %s cannot be read: %s' % (path, error)) from None
    import cv2
    pixels = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if content else None
    if pixels is None:
        raise MapError('map image %s is not an image that can be read (pgm or png)' % path)
    if pixels.dtype == np.uint16:
        pixels = (pixels // 257).astype(np.uint8)
    if pixels.dtype != np.uint8:
        raise MapError('map image %s has pixels of type %s but must have 8 or 16 bit ones' % (path, pixels.dtype))
    return pixels


def parse_pgm(content):
    """Return the pixels (rows, columns) uint8 of a portable grey map, binary or plain; raises ValueError.

    Values are scaled to 0..255 by the greatest value that the header allows.
    """
    header = re.match(rb'P[25]' + 3 * rb'(?:\s+|#[^\n]*\n)+(\d+)' + rb'\s', content)
    if not header:
        raise ValueError('its PGM header is damaged')
    columns, rows, greatest = (int(v) for v in header.groups())
    if columns < 1 or rows < 1 or not 0 < greatest < 65536:
        raise ValueError('its PGM header says %d x %d pixels up to %d' % (columns, rows, greatest))
    body = content[header.end():]
    if content[:2] == b'P2':
        values = np.array(re.sub(rb'#[^\n]*', b'', body).split(), dtype=np.int64)
    else:
        values = np.frombuffer(body, np.uint8 if greatest < 256 else '>u2', len(body) // (1 if greatest < 256 else 2))
    if len(values) < rows * columns:
        raise ValueError('it holds %d of %d x %d pixels' % (len(values), columns, rows))
    pixels = values[:rows * columns].reshape(rows, columns)
    if greatest != 255:
        pixels = (pixels.astype(np.int64) * 255 // greatest).clip(0, 255)
    return pixels.astype(np.uint8)


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
