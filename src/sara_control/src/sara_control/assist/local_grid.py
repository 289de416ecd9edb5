"""A grid of what is blocked about the robot, and how far every place in it is from there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.grids.distances import OBSTACLE, squared_distances


class LocalGrid(NamedTuple):
    """blocked: (rows, columns) bool, row 0 lowest. resolution: m, edge of a cell. origin_x, origin_y: m, the lower left
    corner, in a frame that does not move with the robot.
    """

    blocked: np.ndarray
    resolution: float
    origin_x: float
    origin_y: float


class Field(NamedTuple):
    """distances: (rows, columns) float32, m from the middle of a cell to the edge of the nearest blocked one, at most
    `reach`; in a blocked one minus half a cell. The rest: as of a LocalGrid. Beyond the grid nothing is known and
    nothing is in the way.
    """

    distances: np.ndarray
    resolution: float
    origin_x: float
    origin_y: float
    reach: float


class GridError(ValueError):
    """A grid that makes no sense; the message says why."""


def field_of(grid: LocalGrid, reach: float) -> Field:
    """The Field of a LocalGrid; distances beyond `reach` (m) are not told apart. Raises GridError."""
    blocked = np.ascontiguousarray(grid.blocked, np.bool_)
    numbers = tuple(map(float, grid[1:]))
    if blocked.ndim != 2 or not all(map(math.isfinite, numbers)) or not numbers[0] > 0.0:
        raise GridError(f'the grid has shape {blocked.shape}, resolution and origin {numbers}')
    if min(blocked.shape) < 2:  # distances are told between cells
        blocked = np.pad(blocked, ((0, 2), (0, 2)))
    cells, resolution = np.where(blocked, np.uint8(OBSTACLE), np.uint8(0)), numbers[0]
    squares = squared_distances(cells, math.ceil(reach / resolution) + 1)
    distances = np.minimum(resolution * (np.sqrt(squares) - 0.5), reach).astype(np.float32)
    return Field(distances, *numbers, float(reach))


class Outline(NamedTuple):
    """points: (k, 2) on the outline in their order from the middle of the front, m in base_link; the first `half` are
    its left side. spacing: m between them at most. radius: m from base_link to the farthest.
    """

    points: np.ndarray
    half: int
    spacing: float
    radius: float


@kernel
def distance_at(field: Field, x: float, y: float) -> float:
    """The distance (m) that a Field has at a place (m), between the middles of four cells."""
    rows, columns = field.distances.shape
    u = (x - field.origin_x) / field.resolution - 0.5
    v = (y - field.origin_y) / field.resolution - 0.5
    if not (-0.5 <= u < columns - 0.5 and -0.5 <= v < rows - 0.5):
        return field.reach
    j, i = min(max(int(math.floor(u)), 0), columns - 2), min(max(int(math.floor(v)), 0), rows - 2)
    across, up = u - j, v - i
    low = field.distances[i, j] + across * (field.distances[i, j + 1] - field.distances[i, j])
    high = field.distances[i + 1, j] + across * (field.distances[i + 1, j + 1] - field.distances[i + 1, j])
    return low + up * (high - low)


@kernel
def gap(field: Field, outline: Outline, x: float, y: float, yaw: float) -> float:
    """The least distance (m) of an Outline at a pose to what is blocked."""
    left, right = gaps_beside(field, outline, x, y, yaw)
    return min(left, right)


@kernel
def gaps_beside(field: Field, outline: Outline, x: float, y: float, yaw: float) -> tuple[float, float]:
    """The least distances (m) of the left and of the right half of an Outline at a pose to what is blocked."""
    far = field.reach - outline.radius
    if distance_at(field, x, y) >= field.reach:
        return far, far
    pose, half = (x, y, math.cos(yaw), math.sin(yaw)), outline.half
    left = _least(field, outline, (0, half), pose, far)
    return left, _least(field, outline, (half, len(outline.points)), pose, far)


@kernel
def too_near(gaps: tuple[float, float], beside: tuple[float, float]) -> float:
    """How much nearer (m) a body is to what is on its left and right than it is to be, or than the middle of what is
    free. gaps, beside: m to the left and right.
    """
    middle = 0.5 * (gaps[0] + gaps[1])
    return max(0.0, min(beside[0], middle) - gaps[0]) + max(0.0, min(beside[1], middle) - gaps[1])


@kernel
def _least(field, outline, part, pose, least):
    """The least distance (m) of a part (first, end) of an Outline's points at a pose (x, y, its cosine, its sine) to
    what is blocked, at most ``least``.

    A distance changes by no more than the way between two places, so points near one that is far from everything need
    not be looked at (sphere tracing; Hart 1996).
    """
    x, y, c, s = pose
    k, end = part
    points = outline.points
    while k < end:
        a, b = points[k, 0], points[k, 1]
        here = distance_at(field, x + c * a - s * b, y + s * a + c * b)
        least = min(least, here)
        k += max(1, int((here - least - field.resolution) / outline.spacing))
    return least


def outline_of(length: float, width: float, spacing: float, ahead: float = 0.0) -> Outline:
    """The Outline of a rectangle centred on base_link, its corners among the points, at most `spacing` (m) apart.

    ahead: m that it is longer at the front, or at the rear where it is negative.
    """
    front, rear, side = 0.5 * length + max(ahead, 0.0), -0.5 * length + min(ahead, 0.0), 0.5 * width
    corners = np.array([[front, 0.0], [front, side], [rear, side], [rear, 0.0], [rear, -side], [front, -side]])
    sides = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        n = math.ceil(math.hypot(*(b - a)) / spacing)
        sides.append(a + np.arange(n)[:, None] / n * (b - a))
    half = sum(map(len, sides[:3]))
    radius = float(np.hypot(*corners.T).max())
    return Outline(np.ascontiguousarray(np.vstack(sides)), half, float(spacing), radius)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = field_of(LocalGrid(np.ones((3, 3), bool), 0.1, 0.0, 0.0), 0.2)
    gap(field, outline_of(1.0, 0.5, 0.1), 0.0, 0.0, 0.0)
