"""Map images as grey values: binary PGM of 8 bits, as most maps are, at once; any other format that Pillow knows by way of that."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

_BINARY_PGM = re.compile(rb'P5\s+(?:#[^\n]*\n\s*)*([1-9]\d{0,5})\s+([1-9]\d{0,5})\s+255\s')


def read_grey(path: Path) -> np.ndarray | None:
    """(rows, columns) uint8, the top row first; None where it cannot be read as an image."""
    try:
        content = Path(path).read_bytes()
    except OSError:
        return None
    header = _BINARY_PGM.match(content)
    if header:
        columns, rows = int(header[1]), int(header[2])
        if len(content) - header.end() >= rows * columns:
            return np.frombuffer(content, np.uint8, rows * columns, header.end()).reshape(rows, columns)
    return _by_pillow(path)


def _by_pillow(path: Path) -> np.ndarray | None:
    from PIL import Image
    try:
        with Image.open(path) as image:
            # 16 bits are not cut off by `convert` but clipped: scale them.
            return np.asarray(image) // 257 if image.mode.startswith('I') else np.asarray(image.convert('L'))
    except (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError):
        return None
