"""How far the walls of a map that was made are off the true ones.

The true walls are the faces between occupied and other cells of the true map. A map that was made has a frame of its
own: it is laid on the true one rigidly, so that its occupied cells are nearest to the true walls. Walls count as mapped
where an occupied cell is near them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from sara_common.planar import compose, inverse
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import OCCUPIED, GridMap

SPACING = 0.01  # m between points of a wall
ROBUST = 0.05  # m from which on a cell's distance counts less for the alignment
MAPPED = 0.10  # m from an occupied cell: that piece of wall is mapped
STRAY = 0.15  # m off every wall: such a cell shows something that is no wall

Pose = tuple[float, float, float]


def placed(points: np.ndarray, pose: Pose) -> np.ndarray:
    """(n, 2) points in the frame in which their own has the pose (x, y, yaw)."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return points @ np.array([[c, s], [-s, c]]) + np.array(pose[:2])


def faces(occupied: np.ndarray, geometry: GridGeometry) -> np.ndarray:
    """(n, 2) m: points SPACING apart on the faces between occupied cells (rows, columns) and others, the border's
    among them.
    """
    padded = np.pad(occupied, 1)
    count = max(round(geometry.resolution / SPACING), 1)
    along = (np.arange(count) + 0.5) / count
    found = []
    for axis in (0, 1):
        before, after = np.nonzero(np.diff(padded.astype(np.int8), axis=axis))
        for share in along:
            column, row = (after - 1 + share, before) if axis == 0 else (after, before - 1 + share)
            found.append(np.stack((column, row), 1))
    cells = np.concatenate(found).astype(float)
    return geometry.resolution * cells + (geometry.origin_x, geometry.origin_y)


def occupied_points(grid: GridMap) -> np.ndarray:
    """(n, 2) m: the middles of a map's occupied cells."""
    rows, columns = np.nonzero(grid.data == OCCUPIED)
    g = grid.geometry
    return np.stack((g.origin_x + g.resolution * (columns + 0.5), g.origin_y + g.resolution * (rows + 0.5)), 1)


def aligned(points: np.ndarray, walls: cKDTree, first: Pose) -> Pose:
    """The pose (x, y, yaw) of the frame of points (n, 2) in that of the walls by which the points are nearest to them;
    robust least squares, from a first guess on.
    """
    middle = points.mean(0)

    def residuals(move):
        pose = compose(first, (move[0], move[1], 0.0))
        there = placed(placed(points - middle, (*middle, move[2])), pose)
        return walls.query(there)[0]

    found = least_squares(
        residuals, np.zeros(3), loss='soft_l1', f_scale=ROBUST, diff_step=1e-4, x_scale=(0.1, 0.1, 0.01)
    )
    x, y, turn = found.x
    about = compose((*middle, turn), (-middle[0], -middle[1], 0.0))
    return compose(compose(first, (x, y, 0.0)), about)


class WallErrors(NamedTuple):
    """pose: (x, y, yaw) of the map's frame in the true one. median, p95: m from an occupied cell's middle to the true
    wall next to it. mapped: share of the walls seen that are mapped. strays: share of the occupied cells that show
    something that is no wall.
    """

    pose: Pose
    median: float
    p95: float
    mapped: float
    strays: float


def judged(made: GridMap, true: GridMap, first: Pose, seen: np.ndarray) -> WallErrors:
    """The WallErrors of a map that was made. first: about where its frame is in the true one. seen: (n, 2) m, true
    places on walls that ought to be mapped.
    """
    points = occupied_points(made)
    if not len(points):
        return WallErrors(first, math.inf, math.inf, 0.0, 0.0)
    walls = cKDTree(faces(true.data == OCCUPIED, true.geometry))
    pose = aligned(points, walls, first)
    off = walls.query(placed(points, pose))[0]
    near = cKDTree(points).query(placed(seen, inverse(pose)))[0]
    return WallErrors(
        pose,
        float(np.median(off)),
        float(np.percentile(off, 95)),
        float(np.mean(near <= MAPPED)) if len(seen) else math.nan,
        float(np.mean(off > STRAY)),
    )
