"""CBOR (RFC 8949), as rosbridge sends it: numpy arrays are typed arrays (RFC 8746) in little-endian order, bytes are
bytes. Writing only.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

TAGS = {'<u2': 69, '<u4': 70, '<u8': 71, '|i1': 72, '<i2': 77, '<i4': 78, '<i8': 79, '<f4': 85, '<f8': 86}


def dumps(value: Any) -> bytes:
    """The CBOR of None, truth values, numbers, texts, bytes, sequences, mappings and one-dimensional numpy arrays.
    Raises TypeError for anything else.
    """
    parts: list[bytes] = []
    _write(value, parts)
    return b''.join(parts)


def _head(major, count):
    """The first bytes of an item: its kind, and a number."""
    if count < 24:
        return bytes([major << 5 | count])
    for code, form, most in ((24, '>B', 2**8), (25, '>H', 2**16), (26, '>I', 2**32), (27, '>Q', 2**64)):
        if count < most:
            return bytes([major << 5 | code]) + struct.pack(form, count)
    raise TypeError(f'{count} is too large')


def _write(value, parts):
    if value is None or isinstance(value, (bool, np.bool_)):
        parts.append(b'\xf6' if value is None else b'\xf5' if value else b'\xf4')
    elif isinstance(value, (int, np.integer)):
        parts.append(_head(0, int(value)) if value >= 0 else _head(1, -1 - int(value)))
    elif isinstance(value, (float, np.floating)):
        parts.append(b'\xfb' + struct.pack('>d', value))
    elif isinstance(value, (bytes, bytearray)):
        parts += [_head(2, len(value)), bytes(value)]
    elif isinstance(value, str):
        text = value.encode('utf-8', 'replace')
        parts += [_head(3, len(text)), text]
    elif isinstance(value, np.ndarray):
        _write_array(value, parts)
    elif isinstance(value, Mapping):
        parts.append(_head(5, len(value)))
        for key, held in value.items():
            _write(key, parts)
            _write(held, parts)
    elif isinstance(value, (list, tuple)):
        parts.append(_head(4, len(value)))
        for held in value:
            _write(held, parts)
    else:
        raise TypeError(f'{type(value).__name__} has no CBOR')


def _write_array(value, parts):
    data = value.astype(value.dtype.newbyteorder('<'), copy=False)
    if data.dtype.str == '|u1':
        _write(data.tobytes(), parts)
    elif data.dtype.str in TAGS:
        parts.append(_head(6, TAGS[data.dtype.str]))
        _write(data.tobytes(), parts)
    else:
        _write(data.tolist(), parts)
