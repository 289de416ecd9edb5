"""Adaptive Monte Carlo localization: weighted poses that move, are weighed and drawn anew.

S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005: table 8.3 (augmented MCL) for random particles, table 8.4
(KLD sampling) for their number.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sara_common.planar import wrap
from sara_common.repeatable import weighted_sum
from sara_localization.particles import bins
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.likelihood import Likelihoods, MeasurementModel
from sara_localization.particles.motion import MotionNoise, moved

RandomPoses = Callable[[int], np.ndarray]
"""(n, 3) poses that the robot may have, drawn uniformly."""
KEPT, TRIED = 0.25, 10
"""The share of particles that a new search keeps; how often as many candidates as particles are tried with a first
scan.
"""
FIRST, SEARCHING = 10.0, 5.0
"""How a fit (0 to 1) counts at a start anywhere: by exp(FIRST fit) at the first scan, and while the place is searched
for each weight by exp(SEARCHING fit) besides. The greater, the sooner it is found, and the less may stand about that
the map does not hold.
"""
PREFERRED, ABOUT = 0.7 * FIRST, np.array([0.2, 0.2, np.radians(5.0)])
"""How the fit of a candidate counts, and by how much what is tried about it differs: m, m, rad, standard deviations."""


class ParticleFilter:
    """`poses` (n, 3): x, y, yaw in the map; `weights` (n,), of which the sum is 1; `slow`, `fast`: averages over the
    past of how well measurements fit.
    """

    def __init__(self, config: AmclConfig, rng: np.random.Generator):
        bins.warm()
        self.config, self.rng = config, rng
        self._start(np.zeros((config.max_particles, 3)))

    def _start(self, poses):
        self._take(poses)
        self.most = max(self.config.max_particles, len(poses))
        self.slow = self.fast = self._averaged = 0

    def start_at(self, pose: Sequence[float], covariance: np.ndarray) -> None:
        """Normally distributed about a pose (x, y, yaw) with a covariance (3, 3), positive semidefinite."""
        variances, axes = np.linalg.eigh(covariance)
        scaled = axes * np.sqrt(np.maximum(variances, 0.0))
        poses = np.asarray(pose, float) + self.rng.standard_normal((self.config.max_particles, 3)) @ scaled.T
        poses[:, 2] = wrap(poses[:, 2])
        self._start(poses)

    def start_anywhere(self, random_poses: RandomPoses, count: int) -> None:
        """`count` particles, uniformly over where the robot may be. There may be so many until KLD sampling wants less
        than max_particles: over a large map hardly one of these is near the robot.
        """
        self._start(random_poses(count))

    def start_where_it_fits(self, random_poses: RandomPoses, measured: MeasurementModel, least: int = 0) -> None:
        """As many particles as there are, drawn by exp(FIRST * fit) of a first measurement from poses about (ABOUT)
        candidates, a block at a time, of which those that fit are preferred: an auxiliary particle filter (M. Pitt, N.
        Shephard, "Filtering via simulation", 1999). So a place keeps its weight however few candidates are near.
        least: how many candidates there are at least in each of TRIED blocks.
        """
        block, total = max(len(self.poses), least), 0.0
        kept = np.zeros((block, 4))
        for _ in range(TRIED):
            poses = random_poses(block)
            preference = PREFERRED * measured.likelihoods(poses).fits
            weights = np.exp(preference)
            total += weights.sum()
            better = self.rng.random(block) < weights.sum() / total
            kept = np.where(better[:, None], np.column_stack((poses, preference))[self._drawn(weights, block)], kept)
        poses = kept[:, :3] + ABOUT * self.rng.standard_normal((block, 3))
        poses[:, 2] = wrap(poses[:, 2])
        weights = np.exp(FIRST * measured.likelihoods(poses).fits - kept[:, 3])
        self._start(poses[self._drawn(weights, len(self.poses))])

    def search(self, random_poses: RandomPoses, measured: MeasurementModel, count: int, least: int = 0) -> None:
        """Look for the place anew with `count` particles where a measurement fits, as after a start anywhere, beside
        a share KEPT of those that there are: for it may be they that are right.
        """
        kept = self.poses[self._drawn(self.weights, max(int(KEPT * count), 1))]
        self.start_anywhere(random_poses, count)
        self.start_where_it_fits(random_poses, measured, least)
        self.poses[: len(kept)] = kept

    def move(self, before: Sequence[float], after: Sequence[float]) -> None:
        """The odometry went from one pose (x, y, yaw) to another."""
        self.poses = moved(self.poses, before, after, MotionNoise.of(self.config), self.rng)

    def spread(self, sigmas: tuple[float, float]) -> None:
        """The robot has moved by nobody knows what; sigmas: standard deviations of that, m and rad."""
        self.poses = self.poses + np.array((sigmas[0], *sigmas)) * self.rng.standard_normal(self.poses.shape)
        self.poses[:, 2] = wrap(self.poses[:, 2])

    def weigh(self, likelihoods: Likelihoods, sharpened: bool = False) -> bool:
        """Take a measurement; False where it fits no particle at all: then all weigh the same again. sharpened: as
        while the place is searched for.
        """
        weights = self.weights * likelihoods.values
        if sharpened or self.is_searching:
            weights *= np.exp(SEARCHING * likelihoods.fits)
        total = weights.sum()
        if not (np.isfinite(total) and total > 0.0):
            self.weights = np.full(len(self.poses), 1.0 / len(self.poses))
            return False
        self.weights = weights / total
        self._average(weighted_sum(self.weights, likelihoods.fits))
        return True

    def _average(self, quality):
        """Running averages, which begin as plain means. The particles count as they weigh now: random ones that fit
        nothing do not make for more of them.
        """
        c = self.config
        self._averaged += 1
        self.slow += max(c.recovery_alpha_slow, 1.0 / self._averaged) * (quality - self.slow)
        self.fast += max(c.recovery_alpha_fast, 1.0 / self._averaged) * (quality - self.fast)

    @property
    def is_searching(self) -> bool:
        """Whether, since a start anywhere, KLD sampling wants more than max_particles."""
        return self.most > self.config.max_particles

    @property
    def random_share(self) -> float:
        """Of the particles that the next resampling sets anywhere, because measurements fit worse than they did."""
        return max(0.0, 1.0 - self.fast / self.slow) if self.slow > 0.0 else 0.0

    @property
    def effective(self) -> float:
        """As many particles of the same weight would say as much: 1 / sum w^2."""
        return 1.0 / weighted_sum(self.weights, self.weights)

    def resample(self, random_poses: RandomPoses | None) -> bool:
        """Draw particles by their weights, as many as KLD sampling wants. False where `selective_resampling` leaves
        them as they are, for more than half of them count. random_poses: None where the map has no free cell.
        """
        c = self.config
        if c.selective_resampling and self.effective > 0.5 * len(self.poses):
            return False
        self.most = max(self.most, c.max_particles)
        poses = self.poses[self._drawn(self.weights, self.most)]
        share = self.random_share if random_poses is not None else 0.0
        if share > 0.0:
            anywhere = self.rng.random(len(poses)) < share
            poses[anywhere] = random_poses(np.count_nonzero(anywhere))
        count = bins.enough(poses, c.min_particles, c.kld_err, c.kld_z)
        if count <= c.max_particles:
            self.most = c.max_particles
        self._take(self._thinned(poses, count))
        return True

    def _thinned(self, poses, count):
        """(count, 3) of the poses, one from each of as many equal shares of them in the order of their places: every
        cluster keeps its share, so that of two that measurements cannot tell apart none dies out by chance (M. Gerber,
        N. Chopin, N. Whiteley, "Negative association, ordering and convergence of resampling methods", 2019).
        """
        if count == len(poses):
            return poses
        order = np.lexsort(np.floor(poses[:, :2].T / bins.BIN_M))
        at = (np.arange(count) + self.rng.random(count)) * (len(poses) / count)
        return poses[order[at.astype(int)]]

    def _drawn(self, weights, count):
        """(count,) indices, drawn by the weights, one from each of as many equal shares of their sum (stratified: fewer
        particles are lost by chance than with independent draws), in random order, since KLD sampling takes the first.
        """
        cumulative = np.cumsum(weights)
        at = (np.arange(count) + self.rng.random(count)) * (cumulative[-1] / count)
        drawn = np.minimum(np.searchsorted(cumulative, at, side='right'), len(weights) - 1)
        return self.rng.permutation(drawn)

    def _take(self, poses):
        self.poses = np.ascontiguousarray(poses)
        self.weights = np.full(len(poses), 1.0 / len(poses))
