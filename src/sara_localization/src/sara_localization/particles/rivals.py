"""Other places of a map that explain what was heard on the newest part of the way: a comparison with all of it.

Every place with room for the robot is tried, on a grid of places and headings, as the newest pose of the dead-reckoned
way: first with few of the readings, then the best of them with all (branch by a coarse score, as correlative scan
matching does: E. Olson, "Real-time correlative scan matching", 2009), then the best are refined. That the dead
reckoning drifts a little on the way is within the model's errors.

Where in the place the robot is the same readings tell more exactly than the particles, which are spread at each step:
the mean over a fine grid of poses (grid localization: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005,
section 8.2).
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_localization.particles import echo_table
from sara_localization.particles.echo_table import EchoTable

KEPT = 40
"""Newest stations, about 8 m of way."""
FIRST = 6
"""Stations of the first score, evenly among these."""
SPACING, HEADINGS = 0.15, 48
"""m and number of headings of the grid."""
BEST, REFINED = 4000, 40
"""Candidates that are scored by all readings, and that are refined."""
NEAR_M, NEAR_RAD = 0.6, math.radians(30.0)
"""Nearer than that it is the same place."""
STEPS = ((0.08, math.radians(4.0)), (0.04, math.radians(2.0)), (0.02, math.radians(1.0)))
"""m and rad of the refinement, one after the other."""
FINE_M, FINE_RAD, FINE = 0.03, math.radians(1.5), 6
"""Spacing of the fine grid, and how many poses it has to either side in x, y and yaw."""
DRIFT = (0.03, 0.03, math.radians(1.0))
"""m, m, rad: standard deviations of a pose on it beside what the readings leave open: the dead reckoning drifts on the
way, and the map has cells.
"""


class Station(NamedTuple):
    """The dead reckoning's pose (x, y, yaw), and readings (k, 4) as echo_table.add_logarithms has them."""

    here: tuple[float, float, float]
    readings: np.ndarray


class Rivals:
    """table, logarithms: of the readings; weight: what a reading counts; roomy: bool (rows, columns) of the table's
    map, cells where the robot may be.
    """

    def __init__(self, table: EchoTable, logarithms: np.ndarray, weight: float, roomy: np.ndarray):
        self._table, self._logs, self._weight, self._roomy = table, logarithms, weight, roomy
        self._stations: deque[Station] = deque(maxlen=KEPT)
        self._grid: np.ndarray | None = None

    def add(self, station: Station) -> None:
        """The newest station."""
        self._stations.append(station)

    def compare(
        self, here: tuple[float, float, float], pose: tuple[float, float, float], lead: float
    ) -> tuple[float, np.ndarray]:
        """How much likelier (as a logarithm) the readings are if the robot, at `here` by the dead reckoning, is at a
        pose (x, y, yaw) in the map, than anywhere else; and other poses (n, 3), best first, than which it is likelier
        by at most `lead`.
        """
        if self._grid is None:
            self._grid = self._candidates()
        stations = list(self._stations)
        every = self._readings(here, stations)
        few = self._readings(here, stations[:: max(len(stations) // FIRST, 1)])
        others = self._grid[_far(self._grid, pose)]
        if not len(others):
            return math.inf, others
        others = others[_best(self._scores(others, few), BEST)]
        others = _apart(others[_best(self._scores(others, every), len(others))], REFINED)
        own = float(self._scores(self._refined(np.array([pose], float), every), every)[0])
        others = self._refined(others, every)
        others = others[_far(others, pose)]
        if not len(others):
            return math.inf, others
        scores = self._scores(others, every)
        order = np.argsort(-scores)
        leads = own - scores[order]
        return float(leads[0]), others[order][leads <= lead]

    def pose_near(
        self, here: tuple[float, float, float], pose: tuple[float, float, float]
    ) -> tuple[tuple[float, float, float], np.ndarray]:
        """Where the robot, at `here` by the dead reckoning, is in the map by all the readings if it is near a pose (x,
        y, yaw): (x, y, yaw), and the covariance (3, 3) of that.
        """
        readings = self._readings(here, list(self._stations))
        middle = self._refined(np.array([pose], float), readings)[0]
        places, turns = FINE_M * np.arange(-FINE, FINE + 1), FINE_RAD * np.arange(-FINE, FINE + 1)
        offsets = np.stack(np.meshgrid(places, places, turns, indexing='ij'), -1).reshape(-1, 3)
        scores = self._scores(middle + offsets, readings)
        weights = np.exp(scores - scores.max())
        mean, covariance = np.average(offsets, axis=0, weights=weights), np.cov(offsets.T, aweights=weights, ddof=0)
        x, y, yaw = (middle + mean).tolist()
        return (x, y, float(wrap(yaw))), covariance + np.diag(np.square(DRIFT))

    def _readings(self, here, stations):
        """(k, 4) readings with the sensors in the robot as it is at `here`."""
        back, rows = inverse(here), []
        for station in stations:
            x, y, yaw = compose(back, station.here)
            c, s = math.cos(yaw), math.sin(yaw)
            r = station.readings
            rows.append(
                np.stack((x + c * r[:, 0] - s * r[:, 1], y + s * r[:, 0] + c * r[:, 1], yaw + r[:, 2], r[:, 3]), 1)
            )
        return np.ascontiguousarray(np.concatenate(rows))

    def _scores(self, poses, readings):
        sums = np.zeros(len(poses))
        echo_table.add_logarithms(self._table, self._logs, poses, readings, sums)
        return self._weight * sums

    def _candidates(self):
        """(n, 3) poses over all places with room."""
        place = self._table.place
        step = max(int(round(SPACING / place.resolution)), 1)
        rows, columns = np.nonzero(self._roomy[::step, ::step])
        across, along = (columns * step + 0.5) * place.resolution, (rows * step + 0.5) * place.resolution
        x = place.x + place.cosine * across - place.sine * along
        y = place.y + place.sine * across + place.cosine * along
        yaw = np.linspace(-math.pi, math.pi, HEADINGS, endpoint=False)
        return np.column_stack((np.repeat(x, HEADINGS), np.repeat(y, HEADINGS), np.tile(yaw, len(x))))

    def _refined(self, poses, readings):
        """Each pose moved to where it explains the readings best, close by."""
        for metres, radians in STEPS:
            offsets = np.array(
                [
                    (dx, dy, turn)
                    for dx in (-metres, 0, metres)
                    for dy in (-metres, 0, metres)
                    for turn in (-radians, 0, radians)
                ]
            )
            tried = (poses[:, None, :] + offsets).reshape(-1, 3)
            scores = self._scores(tried, readings).reshape(len(poses), -1)
            poses = tried.reshape(len(poses), -1, 3)[np.arange(len(poses)), scores.argmax(1)]
        return np.ascontiguousarray(poses)


def _far(poses, pose):
    """bool (n,): which poses are another place than a pose."""
    far = np.hypot(poses[:, 0] - pose[0], poses[:, 1] - pose[1]) > NEAR_M
    return far | (np.abs(wrap(poses[:, 2] - pose[2])) > NEAR_RAD)


def _best(scores, count):
    """Indices of the best scores, best first."""
    chosen = np.argpartition(-scores, count - 1)[:count] if count < len(scores) else np.arange(len(scores))
    return chosen[np.argsort(-scores[chosen])]


def _apart(poses, count):
    """(at most count, 3) of poses that are sorted, best first, none near a better one."""
    kept = []
    left = poses
    while len(left) and len(kept) < count:
        kept.append(left[0])
        left = left[_far(left, left[0])]
    return np.array(kept)
