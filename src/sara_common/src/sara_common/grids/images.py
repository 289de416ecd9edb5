"""Images as pixels: of maps, in any format that Pillow knows."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

PGM_HEADER = re.compile(3 * rb'\s+(?:#[^\n]*\n\s*)*(\d{1,9})' + rb'\s')
"""What follows P5 (netpbm's pgm(5)): columns, rows, the greatest value, with comments before each; then one blank and
the pixels.
"""


class ImageError(ValueError):
    """The image cannot be read; the message says which file and why."""


def read_image(path: str | Path) -> np.ndarray:
    """Return the pixels of an image as uint8: grey (rows, columns), RGB or RGBA (rows, columns, channels).

    Any format that Pillow knows: pgm (plain or binary, 8 or 16 bit), png and bmp above all. Colours of a palette are
    looked up, grey with alpha counts as RGBA. Raises ImageError.
    """
    plain = _binary_pgm(path)
    if plain is not None:
        return plain
    from PIL import Image  # slower than all else that reading a map does, and 4 MB

    try:
        with Image.open(path) as image:
            pixels = np.asarray(image) if image.mode.startswith('I') else np.asarray(image.convert(_plain_mode(image)))
    except FileNotFoundError:
        raise ImageError(f'image {path} does not exist') from None
    except (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError) as error:
        raise ImageError(f'image {path} cannot be read: {error}') from None
    if pixels.dtype != np.uint8:  # 16 bits
        pixels = (pixels // 257).clip(0, 255).astype(np.uint8)
    return pixels


def _binary_pgm(path):
    """Return the pixels of a binary pgm of 8 bits, as maps are as a rule, uint8 (rows, columns); None for all else,
    and for what is not as it should be.
    """
    try:
        with open(path, 'rb') as stream:
            content = stream.read() if stream.read(2) == b'P5' else b''
    except OSError:
        return None
    header = PGM_HEADER.match(content)
    if not header:
        return None
    columns, rows, most = map(int, header.groups())
    pixels = content[header.end() : header.end() + columns * rows]
    return (
        np.frombuffer(pixels, np.uint8).reshape(rows, columns)
        if most == 255 and 0 < len(pixels) == columns * rows
        else None
    )


def _plain_mode(image):
    if image.mode in ('LA', 'PA', 'RGBA', 'La', 'RGBa') or 'transparency' in image.info:
        return 'RGBA'
    return 'L' if image.mode in ('1', 'L') else 'RGB'
