"""CBOR (RFC 8949) as rosbridge sends it: numpy arrays are typed arrays (RFC 8746) in little-endian order, bytes are
bytes. Writing only.
"""

from __future__ import annotations

from typing import Any

import cbor2
import numpy as np

TAGS = {'<u2': 69, '<u4': 70, '<u8': 71, '|i1': 72, '<i2': 77, '<i4': 78, '<i8': 79, '<f4': 85, '<f8': 86}


def dumps(value: Any) -> bytes:
    """The CBOR of plain data and one-dimensional numpy arrays. Raises TypeError for what has none."""
    try:
        return cbor2.dumps(value, default=_numpy)
    except cbor2.CBOREncodeTypeError as error:
        raise TypeError(str(error)) from error


def _numpy(encoder, value):
    """Write what cbor2 does not know."""
    if isinstance(value, np.ndarray):
        encoder.encode(_array(value))
    elif isinstance(value, np.generic):
        encoder.encode(value.item())
    else:
        raise cbor2.CBOREncodeTypeError(f'{type(value).__name__} has no CBOR')


def _array(value):
    data = value.astype(value.dtype.newbyteorder('<'), copy=False)
    if data.dtype.str == '|u1':
        return data.tobytes()
    if data.dtype.str in TAGS:
        return cbor2.CBORTag(TAGS[data.dtype.str], data.tobytes())
    return data.tolist()
