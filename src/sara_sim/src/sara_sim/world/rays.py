"""The loops that must be fast: a sonar's cone of rays over map cells and obstacles, and a rectangle's overlap with
either.

Rays walk the grid cell by cell (Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing", 1987). The
overlap of the rectangle with a square cell is the separating axis test.
"""

from __future__ import annotations

from math import ceil, cos, floor, inf, sin
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel


class Walls(NamedTuple):
    """A map: which cells are occupied, (rows, columns) bool, row 0 lowest; unit vectors towards the nearby wall, zero
    where there is none; m per cell.
    """

    occupied: np.ndarray
    normal_x: np.ndarray
    normal_y: np.ndarray
    resolution: float


class Cone(NamedTuple):
    """What a sonar hears: half its cone, rad; rays in it; the cosine of the steepest angle between its axis and a
    wall's normal; up to which distance, m.
    """

    half_angle: float
    rays: int
    cos_steepest: float
    limit: float


@kernel
def cast(occupied: np.ndarray, x: float, y: float, angle: float, limit: float) -> tuple[float, int, int]:
    """Walk one ray. `occupied`: (rows, columns) bool, row 0 lowest; x, y, limit in cells; angle in rad.

    Returns (distance in cells or inf, row, column of the last free cell before the hit).
    """
    rows, columns = occupied.shape
    dx, dy = cos(angle), sin(angle)
    column, row = int(floor(x)), int(floor(y))
    step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    gap_x = abs(1.0 / dx) if dx != 0.0 else inf
    gap_y = abs(1.0 / dy) if dy != 0.0 else inf
    next_x = ((column + 1 - x) if dx > 0 else (x - column)) * gap_x if dx != 0.0 else inf
    next_y = ((row + 1 - y) if dy > 0 else (y - row)) * gap_y if dy != 0.0 else inf
    distance, free_row, free_column = 0.0, row, column
    while distance <= limit:
        if 0 <= row < rows and 0 <= column < columns and occupied[row, column]:
            return distance, free_row, free_column
        free_row, free_column = row, column
        if next_x < next_y:
            distance = next_x
            next_x += gap_x
            column += step_x
        else:
            distance = next_y
            next_y += gap_y
            row += step_y
    return inf, free_row, free_column


@kernel
def _angle_of(axis, cone, i):
    """The direction of the i-th ray of a cone."""
    return axis + cone.half_angle * (2.0 * i / (cone.rays - 1) - 1.0) if cone.rays > 1 else axis


@kernel
def echo(walls: Walls, place: tuple[float, float, float], cone: Cone) -> float:
    """Nearest echo in a cone, in cells, or inf. place: x, y in cells, and the cone's axis, rad.

    A hit counts if the wall's normal is within the steepest angle of the cone's axis.
    """
    x, y, axis = place
    nearest, limit = inf, cone.limit / walls.resolution
    ax, ay = cos(axis), sin(axis)
    rows, columns = walls.occupied.shape
    for i in range(cone.rays):
        distance, row, column = cast(walls.occupied, x, y, _angle_of(axis, cone, i), min(limit, nearest))
        if distance < nearest:
            if 0 <= row < rows and 0 <= column < columns:
                nx, ny = walls.normal_x[row, column], walls.normal_y[row, column]
                if (nx != 0.0 or ny != 0.0) and nx * ax + ny * ay < cone.cos_steepest:
                    continue
            nearest = distance
    return nearest


@kernel
def is_clear(clear: np.ndarray, x: float, y: float) -> bool:
    """Whether a place (in cells) is on the map and its cell is one of those that are `clear`, (rows, columns) bool."""
    rows, columns = clear.shape
    return 0 <= y < rows and 0 <= x < columns and clear[int(y), int(x)]


@kernel
def rectangle_overlaps(
    occupied: np.ndarray, x: float, y: float, yaw: float, half_length: float, half_width: float
) -> bool:
    """True if the rectangle centred on (x, y) overlaps an occupied cell. Lengths in cells, touching edges do not
    overlap.
    """
    rows, columns = occupied.shape
    c, s = cos(yaw), sin(yaw)
    extent_x = abs(c) * half_length + abs(s) * half_width
    extent_y = abs(s) * half_length + abs(c) * half_width
    margin = 0.5 * (abs(c) + abs(s))
    first_row, last_row = max(int(floor(y - extent_y)), 0), min(int(ceil(y + extent_y)), rows)
    first_column, last_column = max(int(floor(x - extent_x)), 0), min(int(ceil(x + extent_x)), columns)
    for row in range(first_row, last_row):
        for column in range(first_column, last_column):
            if occupied[row, column]:
                dx, dy = column + 0.5 - x, row + 0.5 - y
                if abs(c * dx + s * dy) < half_length + margin and abs(c * dy - s * dx) < half_width + margin:
                    return True
    return False


@kernel
def hit_shape(x: float, y: float, dx: float, dy: float, shape: np.ndarray) -> tuple[float, float, float]:
    """Where the ray from (x, y) along the unit vector (dx, dy) meets a shape (a row of `Obstacles.shapes`).

    Returns (distance or inf, normal x, normal y of the surface there, towards the shape). 0 from inside.
    """
    px, py, c, s, half, side = x - shape[0], y - shape[1], shape[2], shape[3], shape[4], shape[5]
    if side < 0.0:
        along = -(px * dx + py * dy)
        inside = px * px + py * py - half * half
        if inside <= 0.0:
            return 0.0, dx, dy
        square = along * along - inside
        if along < 0.0 or square < 0.0:
            return inf, 0.0, 0.0
        distance = along - square**0.5
        return distance, -(px + distance * dx) / half, -(py + distance * dy) / half
    bx, by, ex, ey = c * px + s * py, c * py - s * px, c * dx + s * dy, c * dy - s * dx
    low, high, nx, ny = 0.0, inf, dx, dy
    if abs(ex) < 1e-12:
        if abs(bx) > half:
            return inf, 0.0, 0.0
    else:
        first, last = (-half - bx) / ex, (half - bx) / ex
        sign = 1.0
        if first > last:
            first, last, sign = last, first, -1.0
        if first > low:
            low, nx, ny = first, sign * c, sign * s
        high = min(high, last)
    if abs(ey) < 1e-12:
        if abs(by) > side:
            return inf, 0.0, 0.0
    else:
        first, last = (-side - by) / ey, (side - by) / ey
        sign = 1.0
        if first > last:
            first, last, sign = last, first, -1.0
        if first > low:
            low, nx, ny = first, -sign * s, sign * c
        high = min(high, last)
    if low > high:
        return inf, 0.0, 0.0
    return low, nx, ny


@kernel
def echo_with_shapes(walls: Walls, place: tuple[float, float, float], cone: Cone, shapes: np.ndarray) -> float:
    """As `echo`, with the rows of `shapes` (lengths in cells too) in front of or behind the walls."""
    x, y, axis = place
    nearest, limit = inf, cone.limit / walls.resolution
    ax, ay = cos(axis), sin(axis)
    rows, columns = walls.occupied.shape
    for i in range(cone.rays):
        angle = _angle_of(axis, cone, i)
        distance, row, column = cast(walls.occupied, x, y, angle, limit)
        nx = ny = 0.0
        if distance < inf and 0 <= row < rows and 0 <= column < columns:
            nx, ny = walls.normal_x[row, column], walls.normal_y[row, column]
        dx, dy = cos(angle), sin(angle)
        for k in range(shapes.shape[0]):
            reach, hx, hy = hit_shape(x, y, dx, dy, shapes[k])
            if reach < distance:
                distance, nx, ny = reach, hx, hy
        steep = (nx != 0.0 or ny != 0.0) and nx * ax + ny * ay < cone.cos_steepest
        if distance > limit or distance >= nearest or steep:
            continue
        nearest = distance
    return nearest


@kernel
def laser(walls: Walls, rays: np.ndarray, limit: float, shapes: np.ndarray, found: np.ndarray) -> None:
    """How far each of `rays` (n, 3: x, y in cells, direction in rad) gets, up to `limit` cells: fills `found` (n,), in
    cells, inf where it meets nothing. `shapes`: as in `echo_with_shapes`.
    """
    for i in range(len(rays)):
        x, y, angle = rays[i, 0], rays[i, 1], rays[i, 2]
        nearest, _, _ = cast(walls.occupied, x, y, angle, limit)
        for k in range(shapes.shape[0]):
            nearest = min(nearest, hit_shape(x, y, cos(angle), sin(angle), shapes[k])[0])
        found[i] = nearest if nearest <= limit else inf


@kernel
def rectangle_meets_shapes(
    shapes: np.ndarray, pose: tuple[float, float, float], half: tuple[float, float], met: np.ndarray
) -> int:
    """Which shapes a rectangle centred on a pose (x, y, yaw), of half a length and half a width, overlaps: fills `met`
    (n bool), returns how many. Touching edges do not overlap.
    """
    x, y, yaw = pose
    half_length, half_width = half
    count = 0
    c, s = cos(yaw), sin(yaw)
    for k in range(shapes.shape[0]):
        px, py, a, b = shapes[k, 0] - x, shapes[k, 1] - y, shapes[k, 4], shapes[k, 5]
        along, across = c * px + s * py, c * py - s * px
        if b < 0.0:
            ox, oy = max(abs(along) - half_length, 0.0), max(abs(across) - half_width, 0.0)
            met[k] = ox * ox + oy * oy < a * a
        else:
            # Separating axis test: the axes of either rectangle.
            cc, cs = abs(c * shapes[k, 2] + s * shapes[k, 3]), abs(c * shapes[k, 3] - s * shapes[k, 2])
            far_x, far_y = shapes[k, 2] * px + shapes[k, 3] * py, shapes[k, 2] * py - shapes[k, 3] * px
            met[k] = (
                abs(along) < half_length + a * cc + b * cs
                and abs(across) < half_width + a * cs + b * cc
                and abs(far_x) < a + half_length * cc + half_width * cs
                and abs(far_y) < b + half_length * cs + half_width * cc
            )
        if met[k]:
            count += 1
    return count


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    occupied, normals, shapes = np.zeros((2, 2), np.bool_), np.zeros((2, 2), np.float32), np.ones((1, 6))
    walls, cone, place = Walls(occupied, normals, normals, 1.0), Cone(0.0, 1, 1.0, 1.0), (0.0, 0.0, 0.0)
    echo(walls, place, cone)
    echo_with_shapes(walls, place, cone, shapes)
    laser(walls, np.zeros((1, 3)), 1.0, shapes, np.zeros(1))
    is_clear(occupied, 0.0, 0.0)
    rectangle_overlaps(occupied, 0.0, 0.0, 0.0, 1.0, 1.0)
    rectangle_meets_shapes(shapes, place, (1.0, 1.0), np.zeros(1, np.bool_))
