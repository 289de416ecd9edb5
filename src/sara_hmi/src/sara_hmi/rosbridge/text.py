"""JSON as rosbridge sends it: bytes in base64, and null for numbers that are not finite. Long arrays are written piece
by piece, so that other threads go on meanwhile.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

PIECE = 4096


def dumps(value: Any) -> str:
    """The JSON of None, truth values, numbers, texts, bytes, sequences, mappings and one-dimensional numpy arrays."""
    parts: list[str] = []
    _write(value, parts)
    return ''.join(parts)


def _write(value, parts):
    if isinstance(value, Mapping):
        parts.append('{')
        for k, (key, held) in enumerate(value.items()):
            parts.append(f'{"," if k else ""}{json.dumps(str(key))}:')
            _write(held, parts)
        parts.append('}')
    elif isinstance(value, (bytes, bytearray)) or (isinstance(value, np.ndarray) and value.dtype == np.uint8):
        parts.append(json.dumps(base64.b64encode(bytes(value)).decode()))
    elif isinstance(value, np.ndarray):
        _write_array(value, parts)
    elif isinstance(value, (list, tuple)):
        parts.append('[')
        for k, held in enumerate(value):
            if k:
                parts.append(',')
            _write(held, parts)
        parts.append(']')
    elif isinstance(value, (float, np.floating)):
        parts.append(repr(float(value)) if math.isfinite(value) else 'null')
    else:
        parts.append(json.dumps(value.item() if isinstance(value, np.generic) else value))


def _write_array(value, parts):
    parts.append('[')
    for first in range(0, len(value), PIECE):
        piece = value[first : first + PIECE].tolist()
        finite = value.dtype.kind != 'f' or bool(np.isfinite(value[first : first + PIECE]).all())
        if not finite:
            piece = [held if math.isfinite(held) else None for held in piece]
        parts.append((',' if first else '') + json.dumps(piece, separators=(',', ':'))[1:-1])
    parts.append(']')
