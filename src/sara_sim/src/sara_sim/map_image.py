"""Map images as grey values. The usual one, a binary PGM of 8 bits, is read here; every other kind by OpenCV, which takes long to load."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

# "P5", width, height, greatest value, with comments between them (pgm(5)), one white space, and the pixels.
_GAP = rb'(?:\s|#[^\n]*\n)+'
_PGM = re.compile(rb'P5' + _GAP + rb'(\d+)' + _GAP + rb'(\d+)' + _GAP + rb'255\s')


def read_grey(path: Path) -> np.ndarray | None:
    """(rows, columns) uint8, the top row first; None where it cannot be read as an image."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    head = _PGM.match(data)
    if head:
        width, height = int(head[1]), int(head[2])
        if width and height and len(data) - head.end() >= width * height:
            return np.frombuffer(data, np.uint8, width * height, head.end()).reshape(height, width)
    import cv2  # here, since few maps need it
    return cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
