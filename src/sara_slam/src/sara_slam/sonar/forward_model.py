"""What readings tell of reflectors at known places: the nearest one in the cone is heard, a smooth one only up to a
steepest angle between its normal and the cone's axis (S. Thrun, "Learning occupancy grid maps with forward sensor
models", 2003).
"""

from __future__ import annotations

import math
from itertools import chain
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.wall_filter import cos_sin

NEARER = 0.08
"""m by which a reading must be longer to look through."""
EDGE = math.radians(4.0)
"""Inside the cone, and less steep than the steepest, where it is sure that an echo comes back."""
THROUGH = 0.3
"""Readings that looked through a piece, for each that was of it, from which on it is not there."""
SIDE = 0.12
"""m from a sensor, or from what it may hear, from which on a wall hides that."""
AT_ONCE = 1000
"""Readings that are compared with pieces together."""
INSIDE = 0.02
"""m inside the body's outline, where nothing can stand although poses are a little off."""


class Heard(NamedTuple):
    """Readings: sensors (n, 3) x, y, axis in the map; ranges (n,) m, inf without an echo."""

    sensors: np.ndarray
    ranges: np.ndarray


def thinned(heard: Heard, names: np.ndarray) -> Heard:
    """Without readings that repeat the last one of their sensor. names (n,): int."""
    keep, last = [], {}
    for i, (name, (x, y, axis), distance) in enumerate(
        zip(names.tolist(), heard.sensors.tolist(), heard.ranges.tolist())
    ):
        before = last.get(name)
        if (
            before is None
            or math.hypot(x - before[0], y - before[1]) > 0.03
            or abs(axis - before[2]) > 0.04
            or not abs(distance - before[3]) < 0.03
            and distance != before[3]
        ):
            last[name] = x, y, axis, distance
            keep.append(i)
    return Heard(heard.sensors[keep], heard.ranges[keep])


class Glances(NamedTuple):
    """Which readings would have heard which pieces nearer than what they heard: numbers (k,) of both."""

    piece: np.ndarray
    reading: np.ndarray


def glances(config: SonarConfig, heard: Heard, pieces: np.ndarray) -> Glances:
    """Of pieces (n, 4); a normal of 0, 0 answers all round."""
    half, steepest = 0.5 * config.field_of_view - EDGE, math.cos(config.steepest - EDGE)
    reach = np.minimum(heard.ranges, config.range_max_range) - NEARER
    found = [(np.empty(0, int),) * 2]
    for piece, reading in _within(heard, reach, pieces):
        off, facing, _ = _seen(heard.sensors[reading], pieces[piece])
        answers = (facing > steepest) | ((pieces[piece, 2] == 0.0) & (pieces[piece, 3] == 0.0))
        through = (off < half) & answers
        found.append((piece[through], reading[through]))
    return Glances(*(np.concatenate(numbers) for numbers in zip(*found)))


def _within(heard, reach, pieces):
    """For some readings at a time: numbers of pieces within their reach, and of the readings."""
    tree, used = cKDTree(pieces[:, :2]), np.flatnonzero(reach > 0.1)
    for some in np.array_split(used, len(used) // AT_ONCE + 1):
        near = tree.query_ball_point(heard.sensors[some, :2], reach[some], return_sorted=True)
        count = [len(numbers) for numbers in near]
        yield np.fromiter(chain.from_iterable(near), int, sum(count)), np.repeat(some, count)


def _seen(sensors, pieces):
    """Of pieces that sensors look at, one by one: rad off the axis, cosine between axis and normal, m away."""
    x, y = np.ascontiguousarray((pieces[:, :2] - sensors[:, :2]).T)
    axis = sensors[:, 2]
    c, s = cos_sin(axis)
    off = np.abs((np.arctan2(y, x) - axis + math.pi) % (2.0 * math.pi) - math.pi)
    return off, -(pieces[:, 2] * c + pieces[:, 3] * s), np.hypot(x, y)


def looked_through(
    config: SonarConfig, heard: Heard, pieces: np.ndarray, glances: Glances, before: np.ndarray
) -> np.ndarray:
    """(n,) how many of the glances at pieces (n, 4) went there, as far as other pieces, before (m, 4), do not stand in
    between.
    """
    clear = in_sight(config, heard.sensors[glances.reading, :2], pieces[glances.piece, :2], before)
    return np.bincount(glances.piece[clear], minlength=len(pieces)).astype(float)


def in_sight(config: SonarConfig, eyes: np.ndarray, places: np.ndarray, before: np.ndarray) -> np.ndarray:
    """(n,) whether nothing of pieces (m, 4) stands between eyes (n, 2) and places (n, 2), m."""
    clear = np.ones(len(eyes), bool)
    if not len(before) or not len(eyes):
        return clear
    size = config.resolution
    low = np.floor(np.minimum(before[:, :2].min(0), np.minimum(eyes.min(0), places.min(0))) / size).astype(int)
    high = np.floor(np.maximum(before[:, :2].max(0), np.maximum(eyes.max(0), places.max(0))) / size).astype(int)
    stands = np.zeros(high - low + 1, bool)
    stands[tuple((np.floor(before[:, :2] / size).astype(int) - low).T)] = True
    way = places - eyes
    far = np.hypot(*way.T)
    alive = np.arange(len(eyes))
    for distance in np.arange(SIDE, config.range_max_range, 0.5 * size).tolist():
        alive = alive[far[alive] > distance + SIDE]
        at = eyes[alive] + way[alive] * (distance / far[alive])[:, None]
        hit = stands[tuple((np.floor(at / size).astype(int) - low).T)]
        clear[alive[hit]] = False
        alive = alive[~hit]
    return clear


def unexplained(config: SonarConfig, heard: Heard, pieces: np.ndarray) -> Heard:
    """The echoes that no piece of a wall accounts for."""
    rest = (heard.ranges >= config.range_min_range) & (heard.ranges <= config.range_max_range)
    half, steepest = 0.5 * config.field_of_view + EDGE, math.cos(config.steepest + EDGE)
    reach = np.where(rest, heard.ranges + NEARER, 0.0)
    for piece, reading in _within(heard, reach, pieces) if len(pieces) else ():
        off, facing, away = _seen(heard.sensors[reading], pieces[piece])
        of = (np.abs(away - heard.ranges[reading]) < NEARER) & (off < half) & (facing > steepest)
        rest[reading[of]] = False
    return Heard(heard.sensors[rest], heard.ranges[rest])


def driven_over(config: SonarConfig, poses: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(n,) whether places (n, 2), m, were under the robot's body at one of its poses (k, 3): x, y, yaw."""
    under = np.zeros(len(places), bool)
    if not len(places) or min(config.body_length, config.body_width) <= 2.0 * INSIDE:
        return under
    tree, half = cKDTree(places), (0.5 * config.body_length - INSIDE, 0.5 * config.body_width - INSIDE)
    for x, y, yaw in poses.tolist():
        near = np.array(tree.query_ball_point((x, y), math.hypot(*half)), int)
        dx, dy = places[near, 0] - x, places[near, 1] - y
        c, s = math.cos(yaw), math.sin(yaw)
        under[near[(np.abs(c * dx + s * dy) < half[0]) & (np.abs(c * dy - s * dx) < half[1])]] = True
    return under
