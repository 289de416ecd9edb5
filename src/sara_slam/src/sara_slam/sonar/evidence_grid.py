"""The grid that is drawn of walls as lines: what was heard of them, what is free, and what stands about that is no
wall.

Every reading says where something is, and that nothing that would have answered is nearer (the forward model of S.
Thrun, "Learning occupancy grid maps with forward sensor models", 2003): the nearest surface in the cone is heard, a
smooth one only up to a steepest angle between its normal and the cone's axis. So a piece of a wall counts if more
readings had their foot on it than looked through it, and doors stay open. Echoes that no wall explains are those of
corners and of small things: the points that explain most of them, one after the other.
"""

from __future__ import annotations

import math

import numpy as np

from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap
from sara_slam.sonar.echo_points import other_points
from sara_slam.sonar.forward_model import THROUGH, Heard, driven_over, looked_through
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.wall_filter import cos_sin

PIECE = 0.05
"""m of a wall that is there or not."""
SHORTER, LONGER = 0.04, 0.035
"""m that a reading may be shorter or longer than the way to a wall whose piece it is of; beyond a wall's end, readings
of its edge are longer.
"""
LEAST = 2
"""Readings of a piece."""
HOLE = 14
"""Pieces of a wall between two that are there, which nobody looked through: they are there, too. No door is so
narrow.
"""
CORNER, SQUARE = 0.75, 0.9
"""m from the corner of two walls up to which both are believed to reach it, unless somebody looked through; sine of the
angle between such walls at least.
"""
NEAR_FEET = 0.6
"""m along a wall from the nearest foot of a sensor up to which an echo may be of it."""
FREE_HALF = math.radians(12.0)
"""Half the cone in which a reading tells of free space."""
FREE_FAR = 1.5
"""m up to which silence tells of free space."""
MARGIN = 2.6
"""m about everything heard."""


def draw(config: SonarConfig, heard: Heard, walls: np.ndarray, poses: np.ndarray) -> GridMap:
    """The map. walls (m, 2): theta, rho; poses (k, 3): x, y, yaw that the robot had."""
    pieces = wall_pieces(config, heard, walls)
    pieces = pieces[~driven_over(config, poses, pieces[:, :2])]
    points = other_points(config, heard, pieces, poses)
    return _raster(config, heard, pieces, points, poses[:, :2])


def wall_pieces(config: SonarConfig, heard: Heard, walls: np.ndarray) -> np.ndarray:
    """(n, 4): x, y and the normal of the pieces of walls that are there."""
    found = [_pieces_of(config, heard, wall) for wall in walls.tolist()]
    pieces = np.concatenate(found) if found else np.empty((0, 5))
    if not len(pieces):
        return np.empty((0, 4))
    number = np.repeat(np.arange(len(found)), [len(of) for of in found])
    count, through = pieces[:, 4], looked_through(config, heard, pieces[:, :4])
    there = (through <= THROUGH * count) & ((count >= LEAST) | (count == 0.0))
    pieces, number = pieces[there, :4], number[there]
    corners = _to_corners(walls, [pieces[number == wall] for wall in range(len(walls))])
    unseen = looked_through(config, heard, corners) == 0.0 if len(corners) else np.empty(0, bool)
    return np.concatenate((pieces, corners[unseen]))


def _to_corners(walls, pieces):
    """(n, 4): pieces by which two walls that are about square to each other would reach the corner they make, where
    both end within CORNER of it.
    """
    c, s = cos_sin(walls[:, 0])
    found = [np.empty((0, 4))]
    for i in range(len(walls)):
        for j in range(len(walls)):
            across = c[i] * s[j] - s[i] * c[j]
            if abs(across) < SQUARE or not len(pieces[i]) or not len(pieces[j]):
                continue
            corner = (
                np.array((walls[i, 1] * s[j] - walls[j, 1] * s[i], walls[j, 1] * c[i] - walls[i, 1] * c[j])) / across
            )
            off, its_off = (np.hypot(*(of[:, :2] - corner).T) for of in (pieces[i], pieces[j]))
            if PIECE < off.min() < CORNER and its_off.min() < CORNER:
                end = pieces[i][int(off.argmin())]
                shares = np.arange(1, round(off.min() / PIECE) + 1)[:, None] * PIECE / off.min()
                places = end[:2] + shares * (corner - end[:2])
                found.append(np.hstack((places, np.tile(end[2:], (len(places), 1)))))
    return np.concatenate(found)


def _pieces_of(config, heard, wall):
    """(n, 5): x, y, normal and how many readings were of each piece of a wall, 0 for those of narrow holes."""
    theta, rho = wall
    c, s = math.cos(theta), math.sin(theta)
    along = _touched(config, heard, theta, rho)
    if not len(along):
        return np.empty((0, 5))
    at = np.floor(along / PIECE).astype(int)
    first = at.min() - 1
    counts = np.bincount(at - first, minlength=at.max() - first + 2).astype(float)
    own = counts > 0.0
    counts[1:-1] += counts[:-2] + counts[2:]
    seen = np.flatnonzero(own & (counts >= LEAST))
    if not len(seen):
        return np.empty((0, 5))
    holes = [np.arange(a + 1, b) for a, b in zip(seen, seen[1:]) if 1 < b - a <= HOLE]
    counts[np.concatenate([np.empty(0, int), *holes])] = 0.0
    there = np.concatenate((seen, *holes))
    t = (there + first + 0.5) * PIECE
    return np.stack((c * rho - s * t, s * rho + c * t, np.full(len(t), c), np.full(len(t), s), counts[there]), 1)


def _touched(config, heard, theta, rho):
    """m along a wall where readings touched it: the foot of the sensor where the cone holds it, and else the wall's
    nearest place in the cone, at its edge; that counts near the feet alone.
    """
    sensors, ranges = heard
    half = 0.5 * config.field_of_view
    c, s = math.cos(theta), math.sin(theta)
    used = (ranges >= config.range_min_range) & (ranges <= config.range_max_range)
    x, y, r = *sensors[used, :2].T, ranges[used]
    off = (sensors[used, 2] - theta + 2.0 * math.pi) % (2.0 * math.pi) - math.pi
    steep = np.abs(off)
    bearing = theta + math.pi + np.sign(off) * np.maximum(steep - half, 0.0)
    ex, ey = x + r * np.cos(bearing), y + r * np.sin(bearing)
    ahead = c * ex + s * ey - rho
    on = (ahead < SHORTER) & (ahead > -LONGER) & (steep <= config.steepest) & (c * x + s * y > rho)
    along = c * ey - s * ex
    feet = np.sort(along[on & (steep <= half)])
    if not len(feet):
        return feet
    edges = along[on & (steep > half)]
    next_ = np.searchsorted(feet, edges).clip(1, len(feet) - 1) if len(feet) > 1 else np.zeros(len(edges), int)
    away = np.minimum(np.abs(edges - feet[next_]), np.abs(edges - feet[np.maximum(next_ - 1, 0)]))
    return np.concatenate((feet, edges[away < NEAR_FEET]))


def _raster(config, heard, pieces, points, body):
    size = config.resolution
    every = np.concatenate((heard.sensors[:, :2], pieces[:, :2], points, body))
    low = np.floor((every.min(0) - MARGIN) / size).astype(int)
    columns, rows = (np.ceil((every.max(0) + MARGIN) / size).astype(int) - low).tolist()
    data = np.full((rows, columns), UNKNOWN, np.int8)

    def mark(places, value):
        at = np.floor(places / size).astype(int) - low
        inside = (at >= 0).all(1) & (at[:, 0] < columns) & (at[:, 1] < rows)
        data[at[inside, 1], at[inside, 0]] = value

    walls = pieces[:, :2] - 0.2 * size * pieces[:, 2:]
    mark(walls, OCCUPIED)
    mark(points, OCCUPIED)
    _clear(heard, config, data, low)
    mark(body, FREE)
    return GridMap(data, GridGeometry(columns, rows, size, float(low[0]) * size, float(low[1]) * size))


def _clear(heard, config, data, low):
    """Mark free what readings went through, up to what is occupied."""
    size = config.resolution
    fan = np.linspace(-FREE_HALF, FREE_HALF, 9)
    reach = np.where(heard.ranges <= config.range_max_range, heard.ranges, FREE_FAR) - size
    x, y, angle = (np.repeat(column, len(fan)) for column in heard.sensors.T)
    angle, reach = angle + np.tile(fan, len(heard.ranges)), np.repeat(reach, len(fan))
    dx, dy = np.cos(angle), np.sin(angle)
    alive = np.arange(len(x))
    for distance in np.arange(0.0, config.range_max_range, 0.5 * size).tolist():
        alive = alive[reach[alive] > distance]
        column = np.floor((x[alive] + distance * dx[alive]) / size).astype(int) - low[0]
        row = np.floor((y[alive] + distance * dy[alive]) / size).astype(int) - low[1]
        goes_on = data[row, column] != OCCUPIED
        alive, row, column = alive[goes_on], row[goes_on], column[goes_on]
        data[row, column] = FREE
