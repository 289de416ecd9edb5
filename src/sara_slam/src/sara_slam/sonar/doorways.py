"""Doorways: gaps in a wall that a sensor looked through. A wall is heard a little beyond its end, and drawn on beyond
that, so that a doorway would be drawn too narrow to drive through; no door for wheelchairs is narrower than WIDE.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_slam.sonar.forward_model import Heard, glances, looked_through
from sara_slam.sonar.sonar_config import SonarConfig

WIDE = 0.80
"""m of the middle of a doorway that stay open."""
NARROWEST, WIDEST = 0.60, 1.30
"""m between the ends of two pieces of a wall that are heard of what is taken for a doorway."""
DEEP = 0.12
"""m about the wall's line in which a doorway's ends are heard."""
POST = 0.5
"""Share of the middle of WIDE in which something that is heard stands, for it is no end of the wall."""
GLIMPSES = 1
"""Readings that may have looked through what nobody heard."""


class Doorways(NamedTuple):
    """middles (n, 2) m; tangents (n, 2) of their walls."""

    middles: np.ndarray
    tangents: np.ndarray

    def ends(self, places: np.ndarray) -> np.ndarray:
        """(k,) whether places (k, 2), m, narrow a doorway."""
        off = places[:, None] - self.middles
        tx, ty = self.tangents.T
        along, across = np.abs(off[..., 0] * tx + off[..., 1] * ty), np.abs(off[..., 1] * tx - off[..., 0] * ty)
        return ((along < 0.5 * WIDE) & (along > 0.5 * POST * WIDE) & (across < DEEP)).any(1)


def doorways(config: SonarConfig, heard: Heard, walls: Sequence[np.ndarray], spacing: float) -> Doorways:
    """Of walls, each given by its pieces (n, 4), x, y and normal, `spacing` m apart, which hide what is behind them."""
    gaps = [gap for pieces in walls for gap in _gaps(pieces, spacing)]
    if not gaps:
        return Doorways(np.empty((0, 2)), np.empty((0, 2)))
    inside = np.concatenate(gaps)
    through = looked_through(config, heard, inside, glances(config, heard, inside), np.concatenate(walls)) > GLIMPSES
    lengths = [len(gap) for gap in gaps]
    seen = [bool(of.any()) for of in np.split(through, np.cumsum(lengths)[:-1])]
    middle = np.array([gap.mean(0) for gap, is_open in zip(gaps, seen) if is_open]).reshape(-1, 4)
    return Doorways(middle[:, :2], np.column_stack((-middle[:, 3], middle[:, 2])))


def _gaps(pieces, spacing):
    """(k, 4) each: the pieces that are missing between two of a wall where a doorway may be."""
    if len(pieces) < 2:
        return []
    along = pieces[:, 1] * pieces[0, 2] - pieces[:, 0] * pieces[0, 3]
    order = np.argsort(along, kind='stable')
    ends = pieces[order]
    missing = np.round(np.diff(along[order]) / spacing).astype(int) - 1
    few, many = math.floor(NARROWEST / spacing), math.ceil(WIDEST / spacing)
    between = np.flatnonzero((missing >= few) & (missing <= many))
    return [np.linspace(ends[at], ends[at + 1], missing[at] + 2)[1:-1] for at in between.tolist()]
