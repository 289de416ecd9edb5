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
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sara_common.repeatable import cos_sin
from sara_nav.maps.map_io import FREE, OCCUPIED, GridMap
from sara_slam.sonar.doorways import Doorways, doorways, gaps_of, in_doorway, in_order
from sara_slam.sonar.echo_points import other_points
from sara_slam.sonar.forward_model import (
    GLIMPSES,
    THROUGH,
    Heard,
    driven_over,
    glances,
    looked_through,
    unexplained,
)
from sara_slam.sonar.free_space import Sheet, known_free
from sara_slam.sonar.short_walls import short_walls
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.square_walls import square_off

PIECE = 0.05
"""m of a wall that is there or not."""
SHORTER, LONGER = 0.04, 0.035
"""m that a reading may be shorter or longer than the way to a wall whose piece it is of; beyond a wall's end, readings
of its edge are longer.
"""
HOLE = 14
"""Pieces of a wall between two that are there, which nobody looked through: they are there, too. No door is so
narrow.
"""
WIDE = 39
"""Pieces missing of a wall along or across the first one: what readings neither looked through nor went through of such
a hole is there, too. Slanted ones may be none: two edges are enough for them.
"""
CORNER, SQUARE = 0.75, 0.9
"""m from the corner of two walls up to which both are believed to reach it, unless somebody looked through; sine of the
angle between such walls at least.
"""
GOES_ON = HOLE // 2
"""Pieces by which a wall goes on beyond what was heard of it: two that do so close such a hole."""
LONG, LONG_GOES_ON = 30, 14
"""Pieces next to each other of a wall that is longer than most furniture, and by which such a wall goes on."""
NEAR_FEET = 0.6
"""m along a wall from the nearest foot of a sensor up to which an echo may be of it."""
_NOTHING = np.empty((0, 4))


class Drawn(NamedTuple):
    """A map, and the doorways on it."""

    grid: GridMap
    doorways: Doorways


def draw(config: SonarConfig, heard: Heard, walls: np.ndarray, poses: np.ndarray) -> Drawn:
    """The map. walls (m, 2): theta, rho; short ones are square to the first. poses (k, 3): x, y, yaw of the robot."""
    found = wall_pieces(config, heard, walls)
    pieces, open_ = np.concatenate((_NOTHING, *found)), doorways(config, heard, found[:-1], PIECE)
    pieces = pieces[~(driven_over(config, poses, pieces[:, :2]) | in_doorway(config, poses, pieces))]
    points = other_points(config, heard, pieces, poses)
    pieces, points = pieces[~open_.ends(pieces[:, :2])], points[~open_.ends(points)]
    return Drawn(_raster(config, heard, pieces, points, poses[:, :2]), open_)


def wall_pieces(config: SonarConfig, heard: Heard, walls: np.ndarray) -> list[np.ndarray]:
    """(n, 4) each: x, y and the normal of the pieces of each wall that are there, then of short walls in echoes that
    they do not explain; last of all those by which walls go on.
    """
    if not len(walls):
        return []
    pieces = _that_are_there(config, heard, [_pieces_of(config, heard, wall) for wall in walls.tolist()], _NOTHING)
    rest = unexplained(config, heard, np.concatenate(pieces))
    short, spans = short_walls(config, rest, float(walls[0, 0]))
    walls = np.concatenate((walls, short))
    found = [_pieces_of(config, heard, wall, span) for wall, span in zip(short.tolist(), spans.tolist())]
    pieces += _that_are_there(config, heard, found, np.concatenate(pieces))
    return [*pieces, _going_on(config, heard, walls, pieces)]


def _that_are_there(config, heard, found, before):
    """Of the pieces (n, 5) of some walls those, (k, 4), that more readings were of than looked through. Those of before
    (m, 4) stand, and hide what is behind them, as do those of found that every look leaves standing.
    """
    if not found:
        return []
    pieces = np.concatenate(found)
    count, looks = pieces[:, 4], glances(config, heard, pieces)
    sure = looked_through(config, heard, pieces, looks, before) <= THROUGH * count
    before = np.concatenate((before, pieces[sure, :4]))
    there = looked_through(config, heard, pieces, looks, before) <= THROUGH * count
    ends = np.cumsum([len(of) for of in found])[:-1]
    return [of[keep, :4] for of, keep in zip(found, np.split(there, ends))]


def _going_on(config, heard, walls, pieces):
    """(n, 4): pieces by which walls go on, through wide holes, to corners and at their ends, up to where a reading says
    that they do not, or another wall crosses them, or reaches a corner with them.
    """
    before = np.concatenate(pieces)
    square = np.abs(square_off(walls[:, 0] - walls[0, 0])) <= config.square_gate
    holes = [hole for of, fits in zip(pieces, square) if fits for hole in gaps_of(of, PIECE, 1, WIDE)]
    wide = np.concatenate((_NOTHING, *holes))
    wide = wide[~known_free(config, heard, before[:, :2], wide[:, :2])]
    corners = _to_corners(walls, pieces)
    runs = [*corners, *(run for of in pieces for run in _ends(of))]
    more = np.concatenate((wide, *runs))
    most = np.repeat((0, GLIMPSES), (len(wide), len(more) - len(wide)))
    fits = looked_through(config, heard, more, glances(config, heard, more), before) <= most
    ends = np.cumsum([len(wide), *map(len, runs)]).tolist()
    to_corners, beyond = np.split(np.column_stack((ends[:-1], ends[1:])), [len(corners)])
    fits = _unbroken(fits, _crossed(before, more[: ends[len(corners)]]), to_corners)
    others = np.concatenate((before, *(more[begin:end][fits[begin:end]] for begin, end in to_corners)))
    return more[_unbroken(fits, _crossed(others, more), beyond)]


def _unbroken(fits, crossed, runs):
    """bool (n,): what fits, but of runs (k, 2), begin and end of each, what comes after the first piece that does not
    fit, or that is crossed.
    """
    fits = fits.copy()
    for begin, end in runs:
        fits[begin + 1 : end] &= ~crossed[begin : end - 1]
        fits[begin:end] = np.logical_and.accumulate(fits[begin:end])
    return fits


def _crossed(others, pieces):
    """(n,) whether pieces (n, 4) lie on others, (m, 4), about square to them."""
    near = cKDTree(others[:, :2]).query_ball_point(pieces[:, :2], PIECE)
    across = [others[of, 3] * nx - others[of, 2] * ny for of, (nx, ny) in zip(near, pieces[:, 2:].tolist())]
    return np.array([bool((np.abs(sine) > SQUARE).any()) for sine in across], bool)


def _ends(pieces):
    """(n, 4) each: pieces by which a wall goes on at an end, from there on."""
    if not len(pieces):
        return []
    pieces, along = in_order(pieces)
    tangent = np.array((-pieces[0, 3], pieces[0, 2]))
    breaks = np.flatnonzero(np.diff(along) > 1.5 * PIECE)
    low, high = np.r_[0, breaks + 1], np.r_[breaks, len(pieces) - 1]
    more = GOES_ON if (high - low).max() + 1 < LONG else LONG_GOES_ON
    steps = np.arange(1, more + 1) * PIECE
    return [
        np.hstack((pieces[end, :2] + sign * steps[:, None] * tangent, np.tile(pieces[end, 2:], (more, 1))))
        for ends, sign in ((low, -1.0), (high, 1.0))
        for end in ends.tolist()
    ]


def _to_corners(walls, pieces):
    """(n, 4) each: pieces by which a wall would reach, from its end on, the corner that it makes with another one about
    square to it, where both end within CORNER of it.
    """
    c, s = cos_sin(walls[:, 0])
    found = []
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
    return found


def _pieces_of(config, heard, wall, span=(-math.inf, math.inf)):
    """(n, 5): x, y, normal and how many readings were of each piece of a wall, 0 for those of narrow holes; of its
    tangent's span alone, m.
    """
    theta, rho = wall
    c, s = math.cos(theta), math.sin(theta)
    along = _touched(config, heard, theta, rho)
    along = along[(along > span[0] - PIECE) & (along < span[1] + PIECE)]
    if not len(along):
        return np.empty((0, 5))
    at = np.floor(along / PIECE).astype(int)
    first = at.min() - 1
    counts = np.bincount(at - first, minlength=at.max() - first + 2).astype(float)
    seen = np.flatnonzero(counts)
    counts[1:-1] += counts[:-2] + counts[2:]
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
    sheet = Sheet.about(size, np.concatenate((heard.sensors[:, :2], pieces[:, :2], points, body)))
    sheet.mark(pieces[:, :2] - 0.2 * size * pieces[:, 2:], OCCUPIED)
    sheet.mark(points, OCCUPIED)
    sheet.clear(config, heard)
    sheet.mark(body, FREE)
    return sheet.grid()
