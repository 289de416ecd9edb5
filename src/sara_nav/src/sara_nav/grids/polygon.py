"""The cells under a footprint: its outline, drawn by the lines of outline.py, and its inside."""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.grids.grid import GridGeometry
from sara_nav.grids.outline import line_cells


def footprint_cells(pose: Pose2D, footprint: np.ndarray, geometry: GridGeometry, fill: bool = False) -> np.ndarray:
    """Return the cells int64 (n, 2) of a footprint's outline, edge after edge, and of its inside when ``fill``.

    pose: Pose2D in the costmap's frame; footprint (k, 2) m. Corners between two edges are there twice; cells of the
    inside come last, column by column. Empty when a corner lies off the map.
    """
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    corners = [geometry.to_cell(pose.x + c * x - s * y, pose.y + s * x + c * y) for x, y in footprint.tolist()]
    if None in corners:
        return np.empty((0, 2), np.int64)
    return _polygon_cells(np.array(corners), fill)


@kernel
def _polygon_cells(corners, fill):
    """Return the cells of a polygon as ``footprint_cells`` does; corners int64 (k, 2)."""
    k = len(corners)
    (left, low), (right, high) = corners[0], corners[0]
    n = k
    for i in range(k):
        left, right = min(left, corners[i, 0]), max(right, corners[i, 0])
        low, high = min(low, corners[i, 1]), max(high, corners[i, 1])
        n += max(abs(corners[i, 0] - corners[i - 1, 0]), abs(corners[i, 1] - corners[i - 1, 1]))
    cells = np.empty((n + (right - left + 1) * (high - low + 1), 2), np.int64)
    at = 0
    for i in range(k):
        a, b = corners[i], corners[(i + 1) % k]
        line = line_cells(a[0], a[1], b[0], b[1])
        cells[at : at + len(line)] = line
        at += len(line)
    if fill:
        lowest, highest = np.full(right - left + 1, high), np.full(right - left + 1, low)
        for i in range(at):
            column = cells[i, 0] - left
            lowest[column], highest[column] = min(lowest[column], cells[i, 1]), max(highest[column], cells[i, 1])
        for column in range(right - left + 1):
            for row in range(lowest[column] + 1, highest[column]):
                cells[at, 0], cells[at, 1] = left + column, row
                at += 1
    return cells[:at].copy()


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    _polygon_cells(np.zeros((3, 2), np.int64), True)
