"""The gap between the chair's rectangle and what stands about it, exactly: map cells are squares, obstacles discs or
boxes.

Two convex shapes that do not overlap are nearest at a corner of one of them; so the distance is the least of the
corners' distances to the other shape. Overlap is a gap of 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ahead_of_time import kernel

if TYPE_CHECKING:
    from sara_sim.world.world import World

REACH = 1.0  # m: what is farther is not looked for
NOWHERE = np.zeros((0, 0), bool)  # a map without cells


def at(world: World, pose: tuple[float, float, float], body: tuple[float, float], obstacles: bool = True) -> float:
    """m between the rectangle `body` (length, width; m) at a pose (x, y, yaw) and the nearest of a sara_sim World,
    REACH at most; 0: they overlap.
    """
    shapes = world.obstacles.shapes if obstacles else np.empty((0, 6))
    row = np.array([pose], float)
    return float(
        _gaps(world.occupied, world.resolution, *world.origin, row, 0.5 * body[0], 0.5 * body[1], shapes, REACH)[0]
    )


def to_shape(pose: tuple[float, float, float], body: tuple[float, float], shape: Sequence[float]) -> float:
    """m between the rectangle `body` at a pose, as in `at`, and a row of `Obstacles.shapes`."""
    row, shapes = np.array([pose], float), np.array([shape], float)
    return float(_gaps(NOWHERE, 1.0, 0.0, 0.0, row, 0.5 * body[0], 0.5 * body[1], shapes, math.inf)[0])


def along(world: World, t: np.ndarray, pose: np.ndarray, body: tuple[float, float], step: float) -> np.ndarray:
    """(m,) gaps at poses (n, 3) at times (n,), one each `step` s or more; obstacles are where they were then."""
    chosen = [0]
    for k in range(1, len(t)):
        if t[k] - t[chosen[-1]] >= step - 1e-9:
            chosen.append(k)
    poses = np.ascontiguousarray(pose[chosen], float)
    fixed = (world.occupied, world.resolution, *world.origin)
    if not world.obstacles.all:
        return _gaps(*fixed, poses, 0.5 * body[0], 0.5 * body[1], np.empty((0, 6)), REACH)
    now, result = world.obstacles.time, np.empty(len(chosen))
    for row, k in enumerate(chosen):
        world.obstacles.move_to(float(t[k]))
        result[row] = _gaps(*fixed, poses[row : row + 1], 0.5 * body[0], 0.5 * body[1], world.obstacles.shapes, REACH)[
            0
        ]
    world.obstacles.move_to(now)
    return result


@kernel
def _to_box(px, py, half, side):
    """Distance of a point, given in a box's own axes, from the box."""
    return math.hypot(max(abs(px) - half, 0.0), max(abs(py) - side, 0.0))


@kernel
def _between(x, y, c, s, half, side, shape):
    """Distance of the rectangle at (x, y) with axes (c, s) from a box (a row of Obstacles.shapes): the corners of each
    to the other, 0 when they overlap.
    """
    sx, sy, sc, ss, long, wide = shape
    dx, dy = sx - x, sy - y
    cosine, sine = c * sc + s * ss, c * ss - s * sc  # the box's axes in the rectangle's
    ax, ay = c * dx + s * dy, c * dy - s * dx  # its centre there
    bx, by = -(sc * dx + ss * dy), -(sc * dy - ss * dx)  # the rectangle's centre in the box's
    if (
        abs(ax) < half + long * abs(cosine) + wide * abs(sine)
        and abs(ay) < side + long * abs(sine) + wide * abs(cosine)
        and abs(bx) < long + half * abs(cosine) + side * abs(sine)
        and abs(by) < wide + half * abs(sine) + side * abs(cosine)
    ):
        return 0.0
    least = math.inf
    for i in (-1.0, 1.0):
        for j in (-1.0, 1.0):
            px, py = i * long, j * wide
            least = min(least, _to_box(ax + cosine * px - sine * py, ay + sine * px + cosine * py, half, side))
            px, py = i * half, j * side
            least = min(least, _to_box(bx + cosine * px + sine * py, by - sine * px + cosine * py, long, wide))
    return least


@kernel
def _gaps(occupied, size, origin_x, origin_y, poses, half, side, shapes, reach):
    """The gap (n,) at each pose (n, 3); cells of `occupied` (rows, columns) are `size` m wide."""
    rows, columns = occupied.shape
    result = np.empty(len(poses))
    cell = np.array([0.0, 0.0, 1.0, 0.0, 0.5 * size, 0.5 * size])
    for k in range(len(poses)):
        x, y = poses[k, 0], poses[k, 1]
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        wide, high = abs(c) * half + abs(s) * side + reach, abs(s) * half + abs(c) * side + reach
        first_column, last_column = (
            max(int(math.floor((x - wide - origin_x) / size)), 0),
            min(int(math.ceil((x + wide - origin_x) / size)), columns),
        )
        first_row, last_row = (
            max(int(math.floor((y - high - origin_y) / size)), 0),
            min(int(math.ceil((y + high - origin_y) / size)), rows),
        )
        least = reach
        for row in range(first_row, last_row):
            for column in range(first_column, last_column):
                if occupied[row, column]:
                    cell[0], cell[1] = origin_x + (column + 0.5) * size, origin_y + (row + 0.5) * size
                    dx, dy = cell[0] - x, cell[1] - y
                    # The centre's distance less the cell's own radius is a bound that spares the corners.
                    if _to_box(c * dx + s * dy, c * dy - s * dx, half, side) - 0.7072 * size < least:
                        least = min(least, _between(x, y, c, s, half, side, cell))
        for j in range(len(shapes)):
            if shapes[j, 5] < 0.0:
                dx, dy = shapes[j, 0] - x, shapes[j, 1] - y
                least = min(least, max(_to_box(c * dx + s * dy, c * dy - s * dx, half, side) - shapes[j, 4], 0.0))
            else:
                least = min(least, _between(x, y, c, s, half, side, shapes[j]))
        result[k] = least
    return result


@kernel
def from_line(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Distances (n,) of points (n, 2) from a line through points (k, 2), m."""
    result = np.empty(len(points))
    for i in range(len(points)):
        least = math.hypot(points[i, 0] - line[0, 0], points[i, 1] - line[0, 1])
        for j in range(len(line) - 1):
            ax, ay = line[j, 0], line[j, 1]
            bx, by = line[j + 1, 0] - ax, line[j + 1, 1] - ay
            square = bx * bx + by * by
            if square > 0.0:
                share = min(max(((points[i, 0] - ax) * bx + (points[i, 1] - ay) * by) / square, 0.0), 1.0)
                least = min(least, math.hypot(points[i, 0] - ax - share * bx, points[i, 1] - ay - share * by))
        result[i] = least
    return result


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    _gaps(np.zeros((2, 2), np.bool_), 0.05, 0.0, 0.0, np.zeros((1, 3)), 0.5, 0.3, np.zeros((1, 6)), 0.1)
    from_line(np.zeros((1, 2)), np.zeros((2, 2)))
