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
STRIP = 0.25
"""m: width of the strips in which pieces are looked for."""
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
    strips, order = _strips(pieces)
    piece, reading = _glances(heard.sensors, reach, strips, half, steepest)
    return Glances(order[piece], reading)


class Strips(NamedTuple):
    """Pieces (n, 4), strip by strip along y, and in the order of their y in each. begins (k + 1,): numbers of the first
    one of each strip, and n; x: m, where the first strip begins.
    """

    pieces: np.ndarray
    begins: np.ndarray
    x: float


def _strips(pieces):
    """The Strips of pieces (n, 4 or more), and their numbers (n,) there."""
    x = float(pieces[:, 0].min()) if len(pieces) else 0.0
    strip = np.floor((pieces[:, 0] - x) / STRIP).astype(np.int64)
    order = np.lexsort((pieces[:, 1], strip))
    begins = np.searchsorted(strip[order], np.arange(strip.max(initial=-1) + 2))
    return Strips(np.ascontiguousarray(pieces[order, :4]), begins, x), order


@kernel
def _span(at, axis, half, reach):
    """From where to where on an axis of coordinates a cone reaches that begins `at` one; axis: rad from that one."""
    one, other, widest = math.cos(axis - half), math.cos(axis + half), math.cos(half)
    low = -1.0 if -math.cos(axis) >= widest else min(0.0, one, other)
    high = 1.0 if math.cos(axis) >= widest else max(0.0, one, other)
    return at + reach * low - SLACK, at + reach * high + SLACK


@kernel
def _strips_between(strips, low, high):
    """The first strip, and that after the last, that have something of x from low to high."""
    last = min(math.floor((high - strips.x) / STRIP), len(strips.begins) - 2.0)
    return int(max(math.floor((low - strips.x) / STRIP), 0.0)), int(max(last, -1.0)) + 1


@kernel
def _between(strips, strip, low, high):
    """The first piece of a strip, and that after the last, whose y is from low to high."""
    begin, end = strips.begins[strip], strips.begins[strip + 1]
    y = strips.pieces[begin:end, 1]
    return begin + np.searchsorted(y, low), begin + np.searchsorted(y, high)


@kernel
def _glances(sensors, reach, strips, half, steepest):
    """Numbers (k,) of pieces in their strips, and of readings, in the order of those."""
    found, count = np.empty((2, 1024), np.int64), 0
    for reading in range(len(sensors)):
        if reach[reading] <= 0.1:
            continue
        x, y, axis = sensors[reading]
        c, s = math.cos(axis), math.sin(axis)
        most = reach[reading] ** 2
        low, high = _span(y, axis - 0.5 * math.pi, half, reach[reading])
        for strip in range(*_strips_between(strips, *_span(x, axis, half, reach[reading]))):
            for piece in range(*_between(strips, strip, low, high)):
                px, py, nx, ny = strips.pieces[piece]
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
    _explain(heard.sensors, heard.ranges, _strips(pieces)[0], half, steepest, rest)
    return Heard(heard.sensors[rest], heard.ranges[rest])


@kernel
def _explain(sensors, ranges, strips, half, steepest, rest):
    """Put False into rest (n,) where a reading is of a piece."""
    for reading in range(len(sensors)):
        if not rest[reading]:
            continue
        x, y, axis = sensors[reading]
        c, s = math.cos(axis), math.sin(axis)
        nearest, most = max(ranges[reading] - NEARER, 0.0) ** 2, (ranges[reading] + NEARER) ** 2
        low, high = _span(y, axis - 0.5 * math.pi, half, ranges[reading] + NEARER)
        for strip in range(*_strips_between(strips, *_span(x, axis, half, ranges[reading] + NEARER))):
            for piece in range(*_between(strips, strip, low, high)):
                px, py, nx, ny = strips.pieces[piece]
                far = (px - x) ** 2 + (py - y) ** 2
                if far <= nearest or far >= most or -(nx * c + ny * s) <= steepest:
                    continue
                if _off_axis(px - x, py - y, axis) < half:
                    rest[reading] = False
                    break
            if not rest[reading]:
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
    sensors, (strips, _) = np.zeros((1, 3)), _strips(np.zeros((1, 4)))
    _glances(sensors, np.ones(1), strips, 0.5, 0.5)
    _explain(sensors, np.ones(1), strips, 0.5, 0.5, np.ones(1, bool))
