"""New walls in the newest readings that no known wall explains: a Hough transform of lines that touch the arcs on which
the echoes began (Tardos et al. 2002, section 3), then least squares.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

ANGLES = 90
"""Of lines, all round."""
GAP = 0.04
"""m between lines of one angle."""
WITHIN = 0.025
"""m that readings may be off their wall."""
LEAST = 7
"""Readings of a wall."""
HOLE = 0.35
"""m along a wall without a reading."""
SURE = math.radians(1.5)
"""Of the angle of a wall."""
SIGMA = np.diag([math.radians(0.3), 0.01])
"""rad, m that a wall's angle and distance are uncertain at least."""


class FoundWall(NamedTuple):
    """theta, rho: of the line, in the frame of the sensors given; covariance (2, 2); span: m along it; members: which
    readings.
    """

    theta: float
    rho: float
    covariance: np.ndarray
    span: tuple[float, float]
    members: np.ndarray


def search(sensors: np.ndarray, ranges: np.ndarray, half_cone: float, sigma: float) -> FoundWall | None:
    """The wall that most readings agree on. sensors (n, 3): x, y, axis; ranges (n,) m; half_cone: rad; sigma: m."""
    if len(ranges) < LEAST:
        return None
    theta = (np.arange(ANGLES) - ANGLES // 2) * (2.0 * math.pi / ANGLES)
    steep = np.abs((sensors[:, 2:3] - theta + 2.0 * math.pi) % (2.0 * math.pi) - math.pi)
    rho = np.cos(theta) * sensors[:, 0:1] + np.sin(theta) * sensors[:, 1:2] - ranges[:, None]
    touches = steep <= half_cone
    row = np.round(rho / GAP).astype(int)
    low = row.min()
    reading, angle = np.nonzero(touches)
    votes = np.zeros((ANGLES, row.max() - low + 3))
    np.add.at(votes, (angle, row[reading, angle] - low + 1), 1.0)
    votes[:, 1:-1] += 0.5 * (votes[:, :-2] + votes[:, 2:])
    for _ in range(3):
        angle, at = np.unravel_index(int(np.argmax(votes)), votes.shape)
        if votes[angle, at] < LEAST:
            return None
        found = _fit(sensors, ranges, half_cone, sigma, (theta[angle], (at - 1 + low) * GAP))
        if found is not None:
            return found
        votes[max(angle - 1, 0) : angle + 2, max(at - 1, 0) : at + 2] = 0.0
    return None


def _fit(sensors, ranges, half_cone, sigma, line):
    theta, rho = line
    for within in (3.0 * WITHIN, 2.0 * WITHIN, WITHIN, WITHIN):
        c, s = math.cos(theta), math.sin(theta)
        off = c * sensors[:, 0] + s * sensors[:, 1] - rho - ranges
        steep = np.abs((sensors[:, 2] - theta + 2.0 * math.pi) % (2.0 * math.pi) - math.pi)
        along = c * sensors[:, 1] - s * sensors[:, 0]
        members = _longest(np.flatnonzero((np.abs(off) < within) & (steep <= half_cone)), along)
        if len(members) < LEAST:
            return None
        J = np.stack((along[members], np.full(len(members), -1.0)), 1)
        N = J.T @ J
        if np.linalg.det(N) < 1e-9:
            return None
        move = np.linalg.solve(N, -J.T @ off[members])
        theta, rho = theta + move[0], rho + move[1]
    covariance = np.linalg.inv(N) * sigma**2
    spread = along[members].max() - along[members].min()
    if math.sqrt(covariance[0, 0]) > SURE or spread < 0.3 + 0.15 * float(ranges[members].mean()):
        return None
    span = float(along[members].min()), float(along[members].max())
    return FoundWall(theta, rho, covariance + SIGMA**2, span, members)


def _longest(members, along):
    """Those of a run along the wall without a hole that has most readings."""
    if not len(members):
        return members
    order = members[np.argsort(along[members], kind='stable')]
    runs = np.split(order, np.flatnonzero(np.diff(along[order]) > HOLE) + 1)
    return max(runs, key=len)
