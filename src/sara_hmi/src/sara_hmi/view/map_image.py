"""A map as a PNG, 8-bit grey as map_server has it: free 254, occupied 0, unknown 205, shades between; north is up.

It is packed a few rows at a time: of a large map nothing but the PNG is ever held twice.
"""

from __future__ import annotations

import ctypes
import hashlib
import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

UNKNOWN_GREY, FREE_GREY = 205, 254
SIGNATURE = b'\x89PNG\r\n\x1a\n'
GREY_8_BIT = bytes([8, 0, 0, 0, 0])  # bits, kind, and the one way there is to pack, filter and order
NO_FILTER = b'\0'  # the first byte of each row
ROWS = 64  # that are packed at a time
LEVEL = 3


def _table():
    """Grey of each int8, as its byte."""
    table = np.full(256, UNKNOWN_GREY, np.uint8)
    shades = np.arange(101)
    table[shades] = np.round(FREE_GREY * (100 - shades) / 100.0)
    return table.tobytes()


_GREY = _table()


def png(data: np.ndarray, width: int, height: int) -> bytes:
    """The PNG of an OccupancyGrid's int8 cells, row 0 at the bottom. Raises ValueError where they are not width x
    height.
    """
    cells = np.asarray(data, np.int8)
    if width < 1 or height < 1 or cells.size != width * height:
        raise ValueError(f'a map of {width} x {height} cells has {cells.size}')
    packed = b''.join(_packed(cells.reshape(height, width)))
    head = struct.pack('>II', width, height) + GREY_8_BIT
    return b''.join([SIGNATURE, *_chunk(b'IHDR', head), *_chunk(b'IDAT', packed), *_chunk(b'IEND', b'')])


def _packed(cells: np.ndarray) -> Iterator[bytes]:
    packer = zlib.compressobj(LEVEL)
    for top in range(len(cells), 0, -ROWS):
        rows = cells[max(0, top - ROWS) : top][::-1]
        grey = (row.tobytes().translate(_GREY) for row in rows)
        yield packer.compress(b''.join(NO_FILTER + row for row in grey))
    yield packer.flush()


def _chunk(kind: bytes, data: bytes) -> tuple[bytes, ...]:
    """length, kind, data, checksum."""
    return struct.pack('>I', len(data)), kind, data, struct.pack('>I', zlib.crc32(data, zlib.crc32(kind)))


def give_back_memory() -> None:
    """Give the system what was freed: glibc keeps the megabytes that a large map took, for the next one."""
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)  # another C library has none, and needs none
    if trim is not None:
        trim(0)


def map_frame(image: bytes, size: tuple[int, int], resolution: float, origin: Sequence[float]) -> dict[str, Any]:
    """The frame that comes before the PNG. id: changes when the map does."""
    digest = hashlib.sha256(image)
    digest.update(repr((size, resolution, tuple(origin))).encode())
    return {
        'op': 'map',
        'width': size[0],
        'height': size[1],
        'resolution': resolution,
        'origin': [float(value) for value in origin],
        'id': digest.hexdigest()[:16],
    }
