"""What readings tell of reflectors at known places: the nearest one in the cone is heard, a smooth one only up to a
steepest angle between its normal and the cone's axis (S. Thrun, "Learning occupancy grid maps with forward sensor
models", 2003).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sara_slam.sonar.sonar_config import SonarConfig

NEARER = 0.08
"""m by which a reading must be longer to look through."""
EDGE = math.radians(4.0)
"""Inside the cone, and less steep than the steepest, where it is sure that an echo comes back."""
THROUGH = 0.3
"""Readings that looked through a piece, for each that was of it, from which on it is not there."""

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


def looked_through(config: SonarConfig, heard: Heard, pieces: np.ndarray) -> np.ndarray:
    """(n,) how many readings would have heard pieces (n, 4) nearer than what they heard. A normal of 0, 0 answers all
    round.
    """
    counts = np.zeros(len(pieces))
    tree = cKDTree(pieces[:, :2])
    half, steepest = 0.5 * config.field_of_view - EDGE, math.cos(config.steepest - EDGE)
    reach = np.minimum(heard.ranges, config.range_max_range) - NEARER
    for (x, y, axis), far in zip(heard.sensors.tolist(), reach.tolist()):
        if far <= 0.1:
            continue
        near = np.array(tree.query_ball_point((x, y), far), int)
        if not len(near):
            continue
        p = pieces[near]
        bearing = np.arctan2(p[:, 1] - y, p[:, 0] - x)
        off = np.abs((bearing - axis + math.pi) % (2.0 * math.pi) - math.pi)
        facing = -(p[:, 2] * math.cos(axis) + p[:, 3] * math.sin(axis))
        answers = (facing > steepest) | ((p[:, 2] == 0.0) & (p[:, 3] == 0.0))
        counts[near[(off < half) & answers]] += 1.0
    return counts


def unexplained(config: SonarConfig, heard: Heard, pieces: np.ndarray) -> Heard:
    """The echoes that no piece of a wall accounts for."""
    used = (heard.ranges >= config.range_min_range) & (heard.ranges <= config.range_max_range)
    rest = used.copy()
    if len(pieces):
        tree = cKDTree(pieces[:, :2])
        half, steepest = 0.5 * config.field_of_view + EDGE, math.cos(config.steepest + EDGE)
        for i in np.flatnonzero(used).tolist():
            x, y, axis = heard.sensors[i].tolist()
            distance = float(heard.ranges[i])
            near = np.array(tree.query_ball_point((x, y), distance + NEARER), int)
            if not len(near):
                continue
            p = pieces[near]
            off = np.abs((np.arctan2(p[:, 1] - y, p[:, 0] - x) - axis + math.pi) % (2.0 * math.pi) - math.pi)
            facing = -(p[:, 2] * math.cos(axis) + p[:, 3] * math.sin(axis))
            away = np.hypot(p[:, 0] - x, p[:, 1] - y)
            rest[i] = not (np.abs(away - distance)[(off < half) & (facing > steepest)] < NEARER).any()
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
