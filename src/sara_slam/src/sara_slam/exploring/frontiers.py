"""Frontiers: where known free space borders on the unknown (Yamauchi 1997)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import INSCRIBED, UNKNOWN, GridGeometry

BESIDE = np.ones((3, 3), bool)
"""Cells of a frontier touch each other by an edge or a corner."""
CLOSE = 0.12
"""m from a frontier's cell within which it is still the same one when the map has changed."""


class Frontier(NamedTuple):
    """A frontier. points: (n, 2) m, the middles of its cells; middle: (x, y) m, that of them which is nearest to their
    mean; size: m, cells times resolution.
    """

    points: np.ndarray
    middle: tuple[float, float]
    size: float


def frontier_at(points: np.ndarray, size: float) -> Frontier:
    """The Frontier of points (n, 2) m, of a size, m."""
    middle = points[np.argmin(np.hypot(*(points - points.mean(0)).T))]
    return Frontier(points, (float(middle[0]), float(middle[1])), size)


def frontiers(costmap: Costmap, least: float) -> list[Frontier]:
    """The frontiers of a Costmap that are `least` (m) long or longer, the longest first.

    A cell belongs to one if it is known and free and one of its four neighbours is unknown. Unknown patches that are
    smaller than a square of `least` are none: rays that diverge leave them, and the robot fills them as it drives.
    """
    g, costs = costmap.geometry, costmap.costs
    labels, _ = ndimage.label(costs == UNKNOWN)
    cells = np.bincount(labels.ravel())
    large = cells >= (least / g.resolution) ** 2
    large[0] = False  # the known cells
    border = (costs < INSCRIBED) & ndimage.binary_dilation(large[labels])
    labels, count = ndimage.label(border, BESIDE)
    rows, columns = np.nonzero(border)
    of = labels[rows, columns]
    x, y = g.to_world(columns, rows)
    points = np.column_stack((x, y))
    found = []
    for number in np.flatnonzero(np.bincount(of, minlength=count + 1) * g.resolution >= least - 1e-9):
        own = points[of == number]
        found.append(frontier_at(own, len(own) * g.resolution))
    return sorted(found, key=lambda frontier: (-frontier.size, frontier.middle))


def share_near(frontier: Frontier, others: Sequence[Frontier]) -> float:
    """Which share of a frontier's cells (0 to 1) is within CLOSE of a cell of other ones, of another map perhaps."""
    if not others:
        return 0.0
    tree = cKDTree(np.concatenate([other.points for other in others]))
    off = tree.query(frontier.points, distance_upper_bound=CLOSE)[0]
    return float(np.count_nonzero(np.isfinite(off))) / len(off)


def cells_of(points: np.ndarray, geometry: GridGeometry) -> tuple[np.ndarray, np.ndarray]:
    """(columns, rows), int (n,), of points (n, 2) m; they may lie off the grid."""
    corner = geometry.origin_x, geometry.origin_y
    columns, rows = np.floor((points - corner) / geometry.resolution).astype(int).T
    return columns, rows
