"""Short walls in the building's directions, as sides of furniture are, in the echoes that no other wall explains. The
poses are known by then, so that a few readings from several places are enough.
"""

from __future__ import annotations

import math

import numpy as np

from sara_slam.sonar.forward_model import Heard
from sara_slam.sonar.sonar_config import SonarConfig

VOTES = 6
"""Readings of a wall."""
BIN_RHO, BIN_ALONG = 0.03, 0.05
"""m: bins of a wall's distance, and of places along it."""
WINDOW = 9
"""Bins along a wall that are added up."""
WITHIN = 0.04
"""m that a reading is off its wall at most."""
HOLE = 0.15
"""m along a wall without a reading."""
APART, SHARE = 0.10, 0.1
"""m between the sensors that are farthest from each other along a wall, at least, and share of how far it is off."""
BETTER = 3.0
"""Times that the sum of squares of a wall's residuals is that of a point's from which on readings are of the point."""
STEPS, LONGEST = 10, 0.2
"""Of Gauss and Newton towards the point; m of each at most."""


def short_walls(config: SonarConfig, rest: Heard, direction: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2): theta, rho of walls, those of most readings first; and (n, 2) m: from where to where along the tangent
    (-sin theta, cos theta) their readings have their feet. rest: echoes that nothing explains yet; direction: rad, of
    one wall of the building; others are square to it, or parallel.
    """
    left, lines, spans = np.ones(len(rest.ranges), bool), [], []
    directions = (direction + 0.5 * math.pi * np.arange(4)).tolist()
    found = [_best(config, rest, left, theta) for theta in directions]
    alone = config.field_of_view < 0.5 * math.pi  # each reading is of one direction at most
    while True:
        best = max(range(len(found)), key=lambda number: len(found[number][0]))
        members, theta, rho, along = found[best]
        if len(members) < VOTES:
            return np.array(lines).reshape(-1, 2), np.array(spans).reshape(-1, 2)
        left[members] = False
        wide = along[1] - along[0] >= max(APART, SHARE * float(rest.ranges[members].mean()))
        if wide and not _is_of_a_point(rest, members, theta, rho, along):
            lines.append((theta, rho))
            spans.append(along)
        for number in (best,) if alone else range(len(found)):
            found[number] = _best(config, rest, left, directions[number])


def _is_of_a_point(rest, members, theta, rho, along):
    """Whether readings agree far better on one point than on a wall: from afar a corner looks like one, for its way to
    a sensor hardly changes as that passes (Leonard and Durrant-Whyte 1992).
    """
    sensors, ranges = rest.sensors[members, :2], rest.ranges[members]
    c, s, foot = math.cos(theta), math.sin(theta), 0.5 * (along[0] + along[1])
    point = np.array((c * rho - s * foot, s * rho + c * foot))
    for _ in range(STEPS):
        to = point - sensors
        far = np.maximum(np.hypot(*to.T), 1e-6)
        step = np.linalg.lstsq(to / far[:, None], ranges - far, rcond=None)[0]
        point = point + step * min(1.0, LONGEST / max(math.hypot(*step), 1e-9))
    off_point = ranges - np.hypot(*(point - sensors).T)
    off_wall = sensors @ (c, s) - rho - ranges
    return bool((off_wall**2).sum() > BETTER * (off_point**2).sum())


def _best(config, rest, left, theta):
    """(members, theta, rho, (from, to)) of the wall of a direction that most readings agree on."""
    c, s = math.cos(theta), math.sin(theta)
    x, y, axis = rest.sensors.T
    steep = np.abs((axis - theta + 2.0 * math.pi) % (2.0 * math.pi) - math.pi)
    used = np.flatnonzero(left & (steep <= 0.5 * config.field_of_view))
    if len(used) < VOTES:
        return np.empty(0, int), theta, 0.0, (0.0, 0.0)
    rho, along = (c * x + s * y - rest.ranges)[used], (c * y - s * x)[used]
    row, column = np.floor(rho / BIN_RHO).astype(int), np.floor(along / BIN_ALONG).astype(int)
    row, column = row - row.min() + 1, column - column.min()
    votes = np.zeros((row.max() + 2, column.max() + WINDOW))
    np.add.at(votes, (row, column), 1.0)
    votes[1:-1] += votes[:-2] + votes[2:]
    sums = np.cumsum(np.pad(votes, ((0, 0), (1, 0))), 1)
    at, first = np.unravel_index(
        int(np.argmax(sums[:, WINDOW:] - sums[:, :-WINDOW])), (len(votes), sums.shape[1] - WINDOW)
    )
    near = (np.abs(row - at) <= 1) & (column >= first) & (column < first + WINDOW)
    middle = float(np.median(rho[near]))
    nearest = float(rho[near][np.argmin(np.abs(rho[near] - middle))])
    if abs(nearest - middle) > WITHIN:  # it is between two rows of readings
        middle = nearest
    on = np.flatnonzero(np.abs(rho - middle) <= WITHIN)
    on = on[np.argsort(along[on], kind='stable')]
    runs = np.split(on, np.flatnonzero(np.diff(along[on]) > HOLE) + 1)
    run = max(runs, key=lambda members: int(near[members].sum()))
    return used[run], theta, float(np.mean(rho[run])), (float(along[run[0]]), float(along[run[-1]]))
