"""Writing maps in the ROS map format: an image and the YAML file that names it, which ``map_io`` reads back.

Grey values and thresholds are those of the C++ map_saver: 254 free, 0 occupied, 205 unknown, to be read with
occupied_thresh 0.65 and free_thresh 0.196. Both files lie in one folder and the YAML names the image without it, so
that the pair can be moved; numbers are written in full, so that nothing is lost on the way.
"""

from __future__ import annotations

import math
import os
import tempfile
from dataclasses import dataclass

import numpy as np
from PIL import Image

from sara_nav.maps.map_io import GridMap

FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY = 254, 0, 205
FORMATS = ('pgm', 'png')
SAVED_MODES = ('trinary', 'raw')


class SaveError(OSError):
    """A map cannot be written; the message says which file and why."""


@dataclass(frozen=True)
class SaverConfig:
    """How a map is written. name: path without the ending. From ``occupied`` on a cell is black, up to ``free`` it is
    white, between and below 0 it is unknown. mode ``raw`` writes the values as they are; image_format: pgm or png.
    """

    name: str = 'map'
    occupied: int = 65
    free: int = 25
    image_format: str = 'pgm'
    mode: str = 'trinary'

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = []
        if not 1 <= self.occupied <= 100:
            result.append(f'--occ is {self.occupied!r}, allowed are numbers from 1 to 100')
        if not 0 <= self.free <= 100:
            result.append(f'--free is {self.free!r}, allowed are numbers from 0 to 100')
        if not result and self.free >= self.occupied:
            result.append(f'--free is {self.free!r}, allowed is smaller than --occ ({self.occupied!r})')
        if not os.path.basename(self.name):
            result.append(f'-f is {self.name!r}, allowed is a file name without its ending')
        for option, value, allowed in (('--fmt', self.image_format, FORMATS), ('--mode', self.mode, SAVED_MODES)):
            if value not in allowed:
                result.append('{} is {!r}, allowed are {}'.format(option, value, ', '.join(allowed)))
        return result


def grey_values(data: np.ndarray, config: SaverConfig = SaverConfig()) -> np.ndarray:
    """Return the image, uint8 (rows, columns) with row 0 at the top, of occupancy values int8 with row 0 at the
    bottom.
    """
    values = np.asarray(data, np.int8)[::-1]
    if config.mode == 'raw':
        return np.ascontiguousarray(values).view(np.uint8)
    pixels = np.full(values.shape, UNKNOWN_GREY, np.uint8)
    pixels[values >= config.occupied] = OCCUPIED_GREY
    pixels[(values >= 0) & (values <= config.free)] = FREE_GREY
    return pixels


def description_text(image: str, grid_map: GridMap, mode: str = 'trinary') -> str:
    """Return the text of the YAML file for an image (file name) of a GridMap."""
    g = grid_map.geometry
    numbers = [float(v) for v in (g.resolution, g.origin_x, g.origin_y, grid_map.origin_yaw)]
    if not all(math.isfinite(v) for v in numbers):
        raise SaveError(f'the map cannot be written: its resolution or origin is not finite ({numbers!r})')
    text = "image: '{}'\nresolution: {}\norigin: [{}, {}, {}]\n".format(
        image.replace("'", "''"),
        *map(_yaml_number, numbers),
    )
    text += 'negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n'
    return text if mode == 'trinary' else text + f'mode: {mode}\n'


def _yaml_number(value):
    """The shortest digits that give the same double, with a point, without which YAML takes 1e-05 for a word."""
    text = repr(value)
    return text.replace('e', '.0e', 1) if 'e' in text and '.' not in text else text


def save_map(grid_map: GridMap, config: SaverConfig = SaverConfig()) -> tuple[str, str]:
    """Write NAME.pgm (or .png) and NAME.yaml and return both paths.

    Each file appears whole or not at all, the image first. Raises SaveError, and ValueError for a bad config.
    """
    faults = config.faults()
    if faults:
        raise ValueError('; '.join(faults))
    image, description = config.name + '.' + config.image_format, config.name + '.yaml'
    text = description_text(os.path.basename(image), grid_map, config.mode)
    pixels = Image.fromarray(grey_values(grid_map.data, config))
    _write(image, lambda stream: pixels.save(stream, 'PPM' if config.image_format == 'pgm' else 'PNG'))
    _write(description, lambda stream: stream.write(text.encode()))
    return image, description


def _write(path, put):
    folder = os.path.dirname(path) or '.'
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(dir=folder, prefix='.map_saver', delete=False) as stream:
            temporary = stream.name
            put(stream)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)
        raise SaveError(f'map file {path} cannot be written: {error.strerror or error}') from None


def _umask():
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
