"""Map images as grey values, in any format that Pillow knows."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def read_grey(path: Path) -> np.ndarray | None:
    """(rows, columns) uint8, the top row first; None where it cannot be read as an image."""
    from PIL import Image  # takes as long as ten such images

    try:
        with Image.open(path) as image:
            # 16 bits are not cut off by `convert` but clipped: scale them.
            return np.asarray(image) // 257 if image.mode.startswith('I') else np.asarray(image.convert('L'))
    except (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError):
        return None
