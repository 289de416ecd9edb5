"""Arrays that take long to make, kept in files."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sara_common.files import write_whole
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap


def kept_arrays(path: Path, make: Callable[[], Mapping[str, ArrayLike]]) -> dict[str, np.ndarray]:
    """What a file (.npz) holds, by name; made first, and kept there, where there is none. Processes may ask at once."""
    if not path.exists():
        held = io.BytesIO()
        np.savez_compressed(held, **make())
        write_whole(path, held.getvalue())
    with np.load(path) as found:
        return dict(found)


def arrays_of(grid: GridMap) -> dict[str, ArrayLike]:
    """A map as arrays by name."""
    g = grid.geometry
    return {'data': grid.data, 'resolution': g.resolution, 'origin': (g.origin_x, g.origin_y)}


def map_of(arrays: Mapping[str, np.ndarray]) -> GridMap:
    """The map of such arrays."""
    data, origin = arrays['data'], arrays['origin'].tolist()
    return GridMap(data, GridGeometry(data.shape[1], data.shape[0], float(arrays['resolution']), *origin))
