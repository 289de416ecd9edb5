"""A map as a PNG, 8-bit grey as map_server has it: free 254, occupied 0, unknown 205, shades between; north is up."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from PIL import Image

UNKNOWN_GREY, FREE_GREY = 205, 254


def _table():
    """Grey of each int8, as its byte."""
    table = np.full(256, UNKNOWN_GREY, np.uint8)
    shades = np.arange(101)
    table[shades] = np.round(FREE_GREY * (100 - shades) / 100.0)
    return table


_GREY = _table()


def png(data: np.ndarray, width: int, height: int) -> bytes:
    """The PNG of an OccupancyGrid's int8 cells, row 0 at the bottom. Raises ValueError where they are not width x
    height.
    """
    cells = np.asarray(data, np.int8)
    if width < 1 or height < 1 or cells.size != width * height:
        raise ValueError(f'a map of {width} x {height} cells has {cells.size}')
    grey = _GREY[cells.reshape(height, width)[::-1].view(np.uint8)]
    held = io.BytesIO()
    Image.fromarray(grey, 'L').save(held, 'PNG', compress_level=3)
    return held.getvalue()


def map_frame(image: bytes, size: tuple[int, int], resolution: float, origin: Sequence[float]) -> dict[str, Any]:
    """The frame that comes before the PNG. id: changes when the map does."""
    return {
        'op': 'map',
        'width': size[0],
        'height': size[1],
        'resolution': resolution,
        'origin': [float(value) for value in origin],
        'id': hashlib.sha256(image + repr((size, resolution, tuple(origin))).encode()).hexdigest()[:16],
    }
