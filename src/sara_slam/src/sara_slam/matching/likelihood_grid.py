"""Where a scan fits into points that are known: the likelihood grid of a few scans, and the match of another in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_slam.matching import fit_kernels, grid_kernels, search_kernels
from sara_slam.matching.fit_kernels import Lines, Prior
from sara_slam.matching.search_kernels import Search
from sara_slam.matching.surfaces import Surfaces

Pose = tuple[float, float, float]
STEPS = 20
"""Most Gauss-Newton steps of the refinement."""
STRAYED = 0.15
"""m that a refinement may move a pose; one that moves it further is not heeded."""
TILT = 0.07
"""rad: standard deviation of the normals' directions."""
WIDE = 1.0
"""m of a window from which on its search goes by blocks of 8 cells instead of 4."""


class Grain(NamedTuple):
    """resolution: m per cell. sigma: standard deviation of an echo's place, m. information: what one echo counts: below
    1, for the errors of neighbouring ones are alike.
    """

    resolution: float = 0.05
    sigma: float = 0.06
    information: float = 0.2


class Window(NamedTuple):
    """What is searched about a predicted pose: up to `shift` (m) along each axis and `turn` (rad) to each side;
    sigma_shift (m), sigma_turn (rad): the prediction's standard deviations.
    """

    shift: float
    turn: float
    sigma_shift: float
    sigma_turn: float


class Match(NamedTuple):
    """pose: (x, y, yaw) in the grid's frame; covariance (3, 3) of it by the echoes and the prediction, m and rad, along
    that frame's axes; response: the
    mean likelihood of the points, 0 to 1; score: their sum; agreement: the share of points on known points among these
    and those that known rays went through, NaN where there is none.
    """

    pose: Pose
    covariance: np.ndarray
    response: float
    score: float
    agreement: float


def believed(information: np.ndarray) -> np.ndarray:
    """(3, 3) the information (x, y, yaw) of echoes on surfaces, less what their normals' errors feign across the
    direction that they tell most of: along a bare wall nothing is known, and the pose there is the predicted one.
    """
    values, vectors = np.linalg.eigh(information[:2, :2])
    if values[1] <= 0.0:
        return np.zeros((3, 3))
    least = max(values[0], 0.0)
    share = math.sqrt(max(least - TILT**2 * values.sum(), 0.0) / least) if least else 0.0
    M = np.eye(3)
    M[:2, :2] -= (1.0 - share) * np.outer(vectors[:, 0], vectors[:, 0])
    return M @ information @ M


class LikelihoodGrid:
    """Likelihoods of echoes by the surfaces that known scans saw, at least one place of them; `margin`: m of the widest
    window.
    """

    def __init__(self, surfaces: Surfaces, margin: float, grain: Grain = Grain()):
        for kernels in (grid_kernels, search_kernels, fit_kernels):
            kernels.warm()
        self.grain, self.block = grain, 8 if margin > WIDE else 4
        r, points = grain.resolution, surfaces.points
        reach = math.ceil(3.7 * grain.sigma / r)
        self.margin = self.block * (math.ceil(margin / r / self.block) + 1)
        around = 2 * self.margin + reach + 1
        self.first = np.floor(points.min(0) / r) - around
        shape = (np.floor(points.max(0) / r) + around + 1 - self.first).astype(int)
        squares = np.full((shape[1], shape[0]), np.float32(np.inf), np.float32)
        nearest, cells = np.full((shape[1], shape[0]), -1, np.int32), self._in_cells(points)
        grid_kernels.stamp(squares, nearest, cells, reach)
        normals = np.ascontiguousarray(surfaces.normals)
        self.lines = Lines(nearest, cells, normals, float(grain.sigma / r), float(grain.information))
        self.grid = grid_kernels.likelihoods(squares, grain.sigma / r)
        self.free = np.zeros_like(self.grid)

    def _in_cells(self, points):
        return np.ascontiguousarray(points / self.grain.resolution - self.first)

    def clear(self, origin: Sequence[float], ends: np.ndarray) -> None:
        """A known scan's rays went from an origin (x, y) to their ends (n, 2), m: other echoes contradict them."""
        x, y = self._in_cells(np.array(origin, float)[None])[0]
        grid_kernels.clear_rays(self.free, (float(x), float(y)), self._in_cells(ends))

    def match(self, points: np.ndarray, predicted: Sequence[float], window: Window) -> Match:
        """The best pose of all in a window about the predicted one (x, y, yaw), of a scan's points (n, 2) in the
        robot's frame; at least one point.

        The score of a pose is the sum of the points' likelihoods, less what its deviation from the prediction costs.
        """
        r = self.grain.resolution
        cells = np.ascontiguousarray(points / r)
        search, turns = self._search(points, predicted, window)
        coarse = grid_kernels.pooled(self.grid, self.block)
        most = search_kernels.bounds(coarse, cells, turns, search)
        order = np.argsort(-most, axis=None, kind='stable')
        _, turn, dx, dy = search_kernels.best_shift(self.grid, cells, turns, search, most, order)
        found = np.array((search.x + dx, search.y + dy, search.yaw + turns[turn]))
        prior = Prior(*search[:3], (r / window.sigma_shift) ** 2, 1.0 / window.sigma_turn**2)
        pose, information = fit_kernels.refined(self.lines, cells, found, prior, STEPS)
        if not math.dist(pose[:2], found[:2]) * r <= STRAYED:
            pose = found
        told = np.diag((prior.shift_information, prior.shift_information, prior.turn_information))
        covariance = np.linalg.inv(believed(information - told) + told)
        pose = pose + covariance @ told @ (np.array(prior[:3]) - pose)
        return self._judged(cells, pose, covariance)

    def _search(self, points, predicted, window):
        """The Search, and the turns (a,) of a step that moves the middle point by a cell."""
        r = self.grain.resolution
        far = max(float(np.percentile(np.hypot(points[:, 0], points[:, 1]), 75)), 1.0)
        count = math.ceil(window.turn * far / r)
        turns = np.arange(-count, count + 1) * (window.turn / max(count, 1))
        blocks = 2 * min(math.ceil(window.shift / r / self.block), self.margin // self.block - 1)
        x, y = np.array(predicted[:2]) / r - self.first
        unit = 0.5 * grid_kernels.FULL / self.grain.information
        weights = unit * (r / window.sigma_shift) ** 2, unit / window.sigma_turn**2
        return Search(float(x), float(y), float(predicted[2]), blocks, self.block, self.margin, *weights), turns

    def _judged(self, cells, pose, covariance):
        on, through, response = fit_kernels.agreement(self.grid, self.free, cells, pose)
        r = self.grain.resolution
        scale = np.array((r, r, 1.0))
        place = (pose[:2] + self.first) * r
        return Match(
            (float(place[0]), float(place[1]), float(pose[2])),
            covariance * np.outer(scale, scale),
            response,
            response * len(cells),
            on / (on + through) if on + through else math.nan,
        )
