"""Arrays that take long to make, kept in files."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sara_common.files import write_whole


def kept_arrays(path: Path, make: Callable[[], Mapping[str, ArrayLike]]) -> dict[str, np.ndarray]:
    """What a file (.npz) holds, by name; made first, and kept there, where there is none. Processes may ask at once."""
    if not path.exists():
        held = io.BytesIO()
        np.savez_compressed(held, **make())
        write_whole(path, held.getvalue())
    with np.load(path) as found:
        return dict(found)
