"""Where something holds for a while."""

from __future__ import annotations

import numpy as np


def runs(holds: np.ndarray) -> list[tuple[int, int]]:
    """[(first index, index after the last)] of each run of true values of an array (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], holds, [False])).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))
