"""What readings tell of reflectors at known places: the nearest one in the cone is heard, a smooth one only up to a
steepest angle between its normal and the cone's axis (S. Thrun, "Learning occupancy grid maps with forward sensor
models", 2003).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ahead_of_time import kernel
from sara_slam.sonar.sonar_config import SonarConfig

NEARER = 0.08
"""m by which a reading must be longer to look through."""
EDGE = math.radians(4.0)
"""Inside the cone, and less steep than the steepest, where it is sure that an echo comes back."""
THROUGH = 0.3
"""Readings that looked through a piece, for each that was of it, from which on it is not there."""
GLIMPSES = 1
"""Readings that may have looked through what nobody heard."""
SILENT = 0.5
"""What a reading without an echo counts, for some echoes get lost."""
SIDE = 0.12
"""m from a sensor, or from what it may hear, from which on a wall hides that."""
SLACK = 1e-6
"""m that are looked at beyond a cone's ends, which are rounded."""
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
    """Of pieces (n, 4 or more); a normal of 0, 0 answers all round."""
    half, steepest = 0.5 * config.field_of_view - EDGE, math.cos(config.steepest - EDGE)
    reach = np.minimum(heard.ranges, config.range_max_range) - NEARER
    order = np.argsort(pieces[:, 0], kind='stable')
    piece, reading = _glances(heard.sensors, reach, np.ascontiguousarray(pieces[order, :4]), half, steepest)
    return Glances(order[piece], reading)


@kernel
def _within(x, axis, half, reach, sorted_x):
    """The first number of sorted_x, and that after the last, to which a cone at x reaches, `half` to both sides of an
    axis, rad.
    """
    one, other, widest = math.cos(axis - half), math.cos(axis + half), math.cos(half)
    low = -1.0 if -math.cos(axis) >= widest else min(0.0, one, other)
    high = 1.0 if math.cos(axis) >= widest else max(0.0, one, other)
    return np.searchsorted(sorted_x, x + reach * low - SLACK), np.searchsorted(sorted_x, x + reach * high + SLACK)


@kernel
def _glances(sensors, reach, pieces, half, steepest):
    """Numbers (k,) of pieces, which are in the order of their x, and of readings, in the order of those."""
    found, count, sorted_x = np.empty((2, 1024), np.int64), 0, pieces[:, 0].copy()
    for reading in range(len(sensors)):
        if reach[reading] <= 0.1:
            continue
        x, y, axis = sensors[reading]
        c, s = math.cos(axis), math.sin(axis)
        most = reach[reading] ** 2
        first, last = _within(x, axis, half, reach[reading], sorted_x)
        for piece in range(first, last):
            px, py, nx, ny = pieces[piece]
            if (px - x) ** 2 + (py - y) ** 2 > most or not (-(nx * c + ny * s) > steepest or nx == ny == 0.0):
                continue
            if _off_axis(px - x, py - y, axis) >= half:
                continue
            if count == found.shape[1]:
                more = np.empty((2, 2 * count), np.int64)
                more[:, :count] = found
                found = more
            found[0, count], found[1, count] = piece, reading
            count += 1
    return found[0, :count].copy(), found[1, :count].copy()


@kernel
def _off_axis(x, y, axis):
    """rad between the way (x, y) and an axis."""
    return abs((math.atan2(y, x) - axis + math.pi) % (2.0 * math.pi) - math.pi)


def looked_through(
    config: SonarConfig, heard: Heard, pieces: np.ndarray, glances: Glances, before: np.ndarray
) -> np.ndarray:
    """(n,) how many of the glances at pieces (n, 4) went there, as far as other pieces, before (m, 4), do not stand in
    between; those without an echo count SILENT.
    """
    clear = in_sight(config, heard.sensors[glances.reading, :2], pieces[glances.piece, :2], before)
    counts = np.where(np.isinf(heard.ranges[glances.reading[clear]]), SILENT, 1.0)
    return np.bincount(glances.piece[clear], counts, len(pieces))


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
    distances = np.arange(SIDE, config.range_max_range, 0.5 * size)
    steps = Steps(size, low[0], low[1], distances)
    _hidden(stands, np.ascontiguousarray(eyes), np.ascontiguousarray(places), steps, clear)
    return clear


class Steps(NamedTuple):
    """Of a grid: m per cell, its lowest column and row; and m from an eye at which is looked."""

    size: float
    column: int
    row: int
    distances: np.ndarray


@kernel
def _hidden(stands, eyes, places, steps, clear):
    """Put False into clear (n,) where a cell of stands lies between an eye and a place, (n, 2) each, m."""
    for n in range(len(eyes)):
        x, y = eyes[n, 0], eyes[n, 1]
        dx, dy = places[n, 0] - x, places[n, 1] - y
        far = math.hypot(dx, dy)
        for distance in steps.distances:
            if far <= distance + SIDE:
                break
            share = distance / far
            column = int(math.floor((x + dx * share) / steps.size)) - steps.column
            row = int(math.floor((y + dy * share) / steps.size)) - steps.row
            if stands[column, row]:
                clear[n] = False
                break


def unexplained(config: SonarConfig, heard: Heard, pieces: np.ndarray) -> Heard:
    """The echoes that no piece of a wall accounts for."""
    rest = (heard.ranges >= config.range_min_range) & (heard.ranges <= config.range_max_range)
    half, steepest = 0.5 * config.field_of_view + EDGE, math.cos(config.steepest + EDGE)
    order = np.argsort(pieces[:, 0], kind='stable')
    _explain(heard.sensors, heard.ranges, pieces[order], half, steepest, rest)
    return Heard(heard.sensors[rest], heard.ranges[rest])


@kernel
def _explain(sensors, ranges, pieces, half, steepest, rest):
    """Put False into rest (n,) where a reading is of a piece; those are in the order of their x."""
    sorted_x = pieces[:, 0].copy()
    for reading in range(len(sensors)):
        if not rest[reading]:
            continue
        x, y, axis = sensors[reading]
        c, s = math.cos(axis), math.sin(axis)
        nearest, most = max(ranges[reading] - NEARER, 0.0) ** 2, (ranges[reading] + NEARER) ** 2
        first, last = _within(x, axis, half, ranges[reading] + NEARER, sorted_x)
        for piece in range(first, last):
            px, py, nx, ny = pieces[piece]
            far = (px - x) ** 2 + (py - y) ** 2
            if far <= nearest or far >= most or -(nx * c + ny * s) <= steepest:
                continue
            if _off_axis(px - x, py - y, axis) < half:
                rest[reading] = False
                break


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


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    one = np.zeros((1, 2))
    _hidden(np.zeros((1, 1), bool), one, one, Steps(0.05, 0, 0, np.zeros(1)), np.ones(1, bool))
    sensors, pieces = np.zeros((1, 3)), np.zeros((1, 4))
    _glances(sensors, np.ones(1), pieces, 0.5, 0.5)
    _explain(sensors, np.ones(1), pieces, 0.5, 0.5, np.ones(1, bool))
