"""All poses of a drive and all walls at once, as the odometry and the readings agree best on them: least squares by
Gauss and Newton, with Geman and McClure's weights for readings that were taken for a wall's and are not: many are of
its end, and longer than the way to its line. What counts as an outlier narrows from step to step (graduated
non-convexity: H. Yang, P. Antonante, V. Tzoumas, L. Carlone, 2020).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix

from sara_common.planar import wrap
from sara_common.repeatable import cos_sin
from sara_slam.sonar import arrow_system
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.square_walls import square_off

BAND = 6
"""Unknowns of two poses that follow each other."""
ITERATIONS = 12
SHARED = 2.5
"""Times range_sigma_hit: the standard deviation of a reading, for those one after the other share their errors."""
WIDEST, NARROWEST, NARROWER = 4.0, 0.75, 0.6
"""Times range_sigma_hit: the residual at which a reading weighs half, at the first step and at the last ones; and the
factor from step to step.
"""
LITTLE = 0.05
"""rad, m: standard deviation with which a wall stays where a step finds it, for walls that little was seen of."""
DONE = 1e-4
"""m, rad that nothing moves any more."""


class Evidence(NamedTuple):
    """relations (poses - 1, 3): x, y, yaw of each pose in the frame of the one before, by odometry. node, wall (n,): of
    readings; sensors (n, 2): x, y of the sensor in the frame of its node; ranges (n,), m. square (walls,): that are
    held square to the one with the number `reference`.
    """

    relations: np.ndarray
    node: np.ndarray
    wall: np.ndarray
    sensors: np.ndarray
    ranges: np.ndarray
    square: np.ndarray
    reference: int


class Solved(NamedTuple):
    """poses (n, 3): x, y, yaw; walls (m, 2): theta, rho; scales (2,): relative errors of the odometry's turns and
    ways.
    """

    poses: np.ndarray
    walls: np.ndarray
    scales: np.ndarray


def optimise(config: SonarConfig, first: Solved, evidence: Evidence) -> Solved:
    """What agrees best, from first guesses on. The first pose stays."""
    poses, walls, scales = (values.copy() for values in first)
    for iteration in range(ITERATIONS):
        width = max(WIDEST * NARROWER**iteration, NARROWEST)
        size = 3 * len(poses) + 2 * len(walls) + 2
        system = _System()
        _odometry(system, config, poses, scales, evidence.relations, size)
        _readings(system, config, (poses, walls), evidence, width * config.range_sigma_hit)
        _priors(system, config, (poses, walls, scales), evidence)
        step = system.solve(size, 3 * len(poses))
        poses += step[: 3 * len(poses)].reshape(-1, 3)
        walls += step[3 * len(poses) : size - 2].reshape(-1, 2)
        scales += step[size - 2 :]
        if np.abs(step).max() < DONE and width == NARROWEST:
            break
    poses[:, 2] = wrap(poses[:, 2])
    return Solved(poses, walls, scales)


class _System:
    """Rows of weighted equations J step = -r."""

    def __init__(self):
        self.rows, self.columns, self.values, self.right, self.count = [], [], [], [], 0

    def add(self, columns, values, residuals, weights):
        """columns (n, k) of unknowns, values (n, k) derivatives, residuals (n,), weights (n,): one over sigma."""
        n, k = columns.shape
        self.rows.append(np.repeat(np.arange(self.count, self.count + n), k))
        self.columns.append(columns.ravel())
        self.values.append((values * weights[:, None]).ravel())
        self.right.append(-residuals * weights)
        self.count += n

    def solve(self, size, chain):
        """The step (size,) of least squares. chain: how many unknowns are of poses."""
        entries = np.concatenate(self.values), (np.concatenate(self.rows), np.concatenate(self.columns))
        J = coo_matrix(entries, (self.count, size)).tocsc()
        N, right = (J.T @ J).tocsc(), J.T @ np.concatenate(self.right)
        T, C, D = N[:chain, :chain], N[:chain, chain:].toarray(), N[chain:, chain:].toarray()
        band = np.zeros((BAND, chain))
        for below in range(min(BAND, chain)):
            band[below, : chain - below] = T.diagonal(-below)
        return arrow_system.solve(band, np.ascontiguousarray(C), np.ascontiguousarray(D), right)


def _odometry(system, config, poses, scales, relations, size):
    turns, ways = scales
    dx, dy, turn = relations.T
    a, b = poses[:-1], poses[1:]
    heading = a[:, 2] + 0.5 * turns * turn
    c, s = cos_sin(heading)
    ex, ey = c * dx - s * dy, s * dx + c * dy
    n = len(relations)
    way, rotation = np.hypot(dx, dy), np.abs(turn)
    plane = 1.0 / np.sqrt(config.odom_alpha3 * way + config.odom_alpha4 * rotation + 1e-8)
    yaw = 1.0 / np.sqrt(config.odom_alpha1 * rotation + config.odom_alpha2 * way + 1e-8)
    first = 3 * np.arange(n)
    one, turns_at, ways_at = np.ones(n), np.full(n, size - 2), np.full(n, size - 1)
    for axis, e, across in ((0, ex, -ey), (1, ey, ex)):
        across = (1.0 + ways) * across
        system.add(
            np.stack((first + axis, first + 3 + axis, first + 2, turns_at, ways_at), 1),
            np.stack((-one, one, -across, -0.5 * turn * across, -e), 1),
            b[:, axis] - a[:, axis] - (1.0 + ways) * e,
            plane,
        )
    system.add(
        np.stack((first + 2, first + 5, turns_at), 1),
        np.stack((-one, one, -turn), 1),
        wrap(b[:, 2] - a[:, 2] - (1.0 + turns) * turn),
        yaw,
    )


def _readings(system, config, unknowns, evidence, width):
    if not len(evidence.ranges):
        return
    poses, walls = unknowns
    at = poses[evidence.node]
    c, s = cos_sin(at[:, 2])
    mx, my = evidence.sensors.T
    lx, ly = c * mx - s * my, s * mx + c * my
    x, y = at[:, 0] + lx, at[:, 1] + ly
    theta, rho = walls[evidence.wall].T
    nx, ny = cos_sin(theta)
    residuals = nx * x + ny * y - rho - evidence.ranges
    weights = 1.0 / (SHARED * config.range_sigma_hit * (1.0 + (residuals / width) ** 2))
    first, line = 3 * evidence.node, 3 * len(poses) + 2 * evidence.wall
    system.add(
        np.stack((first, first + 1, first + 2, line, line + 1), 1),
        np.stack((nx, ny, ny * lx - nx * ly, nx * y - ny * x, np.full(len(x), -1.0)), 1),
        residuals,
        weights,
    )


def _priors(system, config, unknowns, evidence):
    poses, walls, scales = unknowns
    squares = np.flatnonzero(evidence.square)
    size = 3 * len(poses) + 2 * len(walls) + 2
    system.add(np.arange(3)[:, None], np.ones((3, 1)), np.zeros(3), np.full(3, 1e4))
    weights = 1.0 / np.array([config.turn_scale_sigma, config.way_scale_sigma])
    system.add(np.array([[size - 2], [size - 1]]), np.ones((2, 1)), scales, weights)
    line = 3 * len(poses)
    if len(squares):
        off = square_off(walls[squares, 0] - walls[evidence.reference, 0])
        weights = 1.0 / (config.square_sigma * np.sqrt(1.0 + (off / (2.0 * config.square_sigma)) ** 2))
        columns = np.stack((line + 2 * squares, np.full(len(squares), line + 2 * evidence.reference)), 1)
        system.add(columns, np.tile((1.0, -1.0), (len(squares), 1)), off, weights)
    if len(walls):  # a wall that little was seen of stays about where it is
        count = 2 * len(walls)
        system.add(line + np.arange(count)[:, None], np.ones((count, 1)), np.zeros(count), np.full(count, 1.0 / LITTLE))
