"""How well a scan's beams fit poses in a map: the loops over particles and beams, compiled by numba.

S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, sections 6.3 (beam model) and 6.4 (likelihood field).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.grids import distances
from sara_localization.particles.field import Placement, to_cells
from sara_localization.ranges.map_echo import OCCUPIED, UNKNOWN, cast

_TOGETHER = 8
"""Probabilities that are multiplied before a logarithm is taken."""
NEAR, NEARER = 0.15, 0.03
"""m, and m per m of range: from a wall within which a beam's end agrees with it."""
_LEAST = 1e-30
"""A probability below this counts as this: eight of them still are a number."""


class BeamLaw(NamedTuple):
    """Weights of a beam's parts (hit, short, no echo, random); sigma of a hit, m; lambda of what is short, 1/m; the
    range of no echo, m.
    """

    hit: float
    short: float
    silent: float
    random: float
    sigma: float
    decay: float
    most: float


@kernel(inline='always')
def _square_at(squares, x, y, c, s, point_x, point_y):
    """The squared distance (cells) at a point of the robot's frame, -1 outside of the grid. x, y: the robot, cells; c,
    s: its heading in the grid, over the cells' size.
    """
    column, row = x + c * point_x - s * point_y, y + s * point_x + c * point_y
    rows, columns = squares.shape
    if 0.0 <= column < columns and 0.0 <= row < rows:
        return squares[np.uint32(row), np.uint32(column)]
    return np.int32(-1)


@kernel(inline='always')
def _placed(place, poses, i):
    """(x, y in cells, cosine, sine over the cells' size) of a particle."""
    x, y = to_cells(place, poses[i, 0], poses[i, 1])
    c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
    return (
        x,
        y,
        (c * place.cosine + s * place.sine) / place.resolution,
        (s * place.cosine - c * place.sine) / place.resolution,
    )


@kernel
def field_sums(
    place: Placement, squares: np.ndarray, poses: np.ndarray, points: np.ndarray, table: np.ndarray
) -> np.ndarray:
    """(n,) 1 + the sum over the beams of table[squared distance at the beam's end].

    squares: int32 (rows, columns) of the grid. poses: (n, 3). points: (b, 2), ends of the beams in the robot's frame,
    m. table: (reach^2 + 2,), the last for what is beyond the reach or outside of the map.
    """
    beyond = len(table) - 1
    sums = np.empty(len(poses))
    for i in range(len(poses)):
        x, y, c, s = _placed(place, poses, i)
        total = 1.0
        for b in range(len(points)):
            square = _square_at(squares, x, y, c, s, points[b, 0], points[b, 1])
            total += table[square if square >= 0 else beyond]
        sums[i] = total
    return sums


@kernel
def field_logarithms(
    place: Placement, squares: np.ndarray, poses: np.ndarray, points: np.ndarray, table: np.ndarray
) -> np.ndarray:
    """(n,) the sum over the beams of log p, p = table[...]; arguments as of `field_sums`."""
    beyond = len(table) - 1
    sums = np.empty(len(poses))
    for i in range(len(poses)):
        x, y, c, s = _placed(place, poses, i)
        total, product = 0.0, 1.0
        for b in range(len(points)):
            square = _square_at(squares, x, y, c, s, points[b, 0], points[b, 1])
            product *= max(table[square if square >= 0 else beyond], _LEAST)
            if b % _TOGETHER == _TOGETHER - 1:
                total += math.log(product)
                product = 1.0
        sums[i] = total + math.log(product)
    return sums


@kernel
def agreeing(place: Placement, squares: np.ndarray, poses: np.ndarray, points: np.ndarray, within: float) -> np.ndarray:
    """(b,) for how many particles each beam ends within a distance (cells) of a wall."""
    counts = np.zeros(len(points), np.int64)
    for i in range(len(poses)):
        x, y, c, s = _placed(place, poses, i)
        for b in range(len(points)):
            square = _square_at(squares, x, y, c, s, points[b, 0], points[b, 1])
            if 0 <= square < within * within:
                counts[b] += 1
    return counts


@kernel
def agreement(
    place: Placement, cells: np.ndarray, pose: np.ndarray, origin: tuple[float, float], beams: np.ndarray, most: float
) -> tuple[int, int, int, int]:
    """How many beams agree with the map at a pose, agree behind a wall, are shorter and longer than the map has them:
    the counts of lost.Agreement.

    cells, origin, beams: as of `beam_sums`. pose: (1, 3). most: m, the range of no echo. A beam agrees that ends within
    NEAR + NEARER * range of a wall.
    """
    agree = behind = short = long = 0
    x, y, c, s = _placed(place, pose, 0)
    x, y = x + c * origin[0] - s * origin[1], y + s * origin[0] + c * origin[1]
    turn = math.atan2(place.sine, place.cosine)
    for b in range(len(beams)):
        measured, angle = beams[b, 1] / place.resolution, pose[0, 2] + beams[b, 0] - turn
        within = NEAR / place.resolution + NEARER * measured
        distance, what = cast(cells, x, y, angle, measured + within)
        if what == UNKNOWN:
            continue
        through = distance < measured - within
        if beams[b, 1] < most and _wall_about(
            cells, x + measured * math.cos(angle), y + measured * math.sin(angle), within
        ):
            agree += not through
            behind += through
        elif through:
            long += 1
        elif beams[b, 1] < most:
            short += 1
        else:
            agree += 1
    return agree, behind, short, long


@kernel
def _wall_about(cells, x, y, within):
    """Whether a wall is within so many cells of a place."""
    rows, columns = cells.shape
    first_row, last_row = max(int(y - within), 0), min(int(y + within), rows - 1)
    first_column, last_column = max(int(x - within), 0), min(int(x + within), columns - 1)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            dx, dy = column + 0.5 - x, row + 0.5 - y
            if cells[row, column] == OCCUPIED and dx * dx + dy * dy <= within * within:
                return True
    return False


@kernel
def beam_sums(
    place: Placement, cells: np.ndarray, poses: np.ndarray, origin: tuple[float, float], beams: np.ndarray, law: BeamLaw
) -> np.ndarray:
    """(n,) 1 + the sum over the beams of p^3 by the beam model.

    cells: uint8 (rows, columns), as map_echo.cast takes them. origin: the scanner in the robot's frame, m. beams: (b,
    2), directions there, rad, and ranges, m.
    """
    sums = np.empty(len(poses))
    turn, limit = math.atan2(place.sine, place.cosine), law.most / place.resolution
    for i in range(len(poses)):
        x, y, c, s = _placed(place, poses, i)
        x, y = x + c * origin[0] - s * origin[1], y + s * origin[0] + c * origin[1]
        total = 1.0
        for b in range(len(beams)):
            distance, _ = cast(cells, x, y, poses[i, 2] + beams[b, 0] - turn, limit)
            p = _beam_probability(beams[b, 1], min(distance * place.resolution, law.most), law)
            total += p * p * p
        sums[i] = total
    return sums


@kernel
def _beam_probability(measured, expected, law):
    off = measured - expected
    p = law.hit * math.exp(-0.5 * off * off / (law.sigma * law.sigma))
    if off < 0.0:
        p += law.short * law.decay * math.exp(-law.decay * measured)
    return p + (law.silent if measured >= law.most else law.random / law.most)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    place, cells = Placement(0.0, 0.0, 1.0, 0.0, 1.0), np.zeros((2, 2), np.uint8)
    squares = distances.squared_distances(cells, 1)
    poses, pairs, table = np.zeros((1, 3)), np.zeros((1, 2)), np.ones(3)
    field_sums(place, squares, poses, pairs, table)
    field_logarithms(place, squares, poses, pairs, table)
    agreeing(place, squares, poses, pairs, 1.0)
    agreement(place, cells, poses, (0.0, 0.0), pairs, 5.0)
    beam_sums(place, cells, poses, (0.0, 0.0), pairs, BeamLaw(1.0, 0.1, 0.1, 0.1, 0.2, 0.1, 5.0))
