"""The measurement models of amcl for laser scans: `likelihood_field`, `likelihood_field_prob` and `beam`.

The first and the last weigh by 1 + sum p^3 over the beams, as the C++ node does; `likelihood_field_prob` by the product
of all p, the textbook's law, of which beams that most particles disagree with can be skipped. What a scan weighs is
raised to `laser_likelihood_power`: beams of one scan are not independent (S. Thrun, W. Burgard, D. Fox, "Probabilistic
Robotics", 2005, section 6.3.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_localization.particles import field, scan_kernels
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.beams import BeamChoice, Beams
from sara_localization.particles.likelihood import Likelihoods, MeasurementModel
from sara_localization.particles.lost import Agreement
from sara_localization.particles.scan_kernels import BeamLaw
from sara_localization.ranges.range_data import RangeMap

_CONVERGED = 0.5
"""m from their mean in x and in y within which all particles are where beams may be skipped."""


class Skipping(NamedTuple):
    """A beam is skipped that ends further than `distance` (m) from any wall for all but a share `threshold` of the
    particles; if more than the share `error_threshold` of the beams would be, none is.
    """

    distance: float
    threshold: float
    error_threshold: float


class _Scan:
    """A scan's beams on the map."""

    def __init__(self, model: ScanModel, beams: Beams):
        self.walls, self.origin, self.most = (model.place, model.cells), (float(beams.x), float(beams.y)), beams.most
        self.beams = np.stack((beams.directions, beams.ranges), 1)
        self.power = model.config.laser_likelihood_power

    def agreement(self, pose: Sequence[float]) -> Agreement:
        place = np.array(pose, float)[None]
        return Agreement(*scan_kernels.agreement(*self.walls, place, self.origin, self.beams, float(self.most)))


class FieldScan(_Scan):
    """A scan against the likelihood field: how far from the nearest wall do its beams end?"""

    def __init__(self, model: ScanModel, beams: Beams):
        super().__init__(model, beams)
        self.grid, self.points = (model.place, model.squares), beams.points
        self.probabilities = model.hits + model.config.laser_z_rand / beams.most

    def likelihoods(self, poses: np.ndarray) -> Likelihoods:
        sums = scan_kernels.field_sums(*self.grid, poses, self.points, self.probabilities**3)
        return Likelihoods.of_sums(sums, len(self.points), self.probabilities[0] ** 3, self.power)


class FieldProductScan(FieldScan):
    """The same, as the product of the beams' probabilities. `skipping`: None where all beams are used."""

    def __init__(self, model: ScanModel, beams: Beams):
        super().__init__(model, beams)
        c = model.config
        self.skipping = (
            Skipping(c.beam_skip_distance, c.beam_skip_threshold, c.beam_skip_error_threshold)
            if c.do_beamskip
            else None
        )

    def likelihoods(self, poses: np.ndarray) -> Likelihoods:
        points = self.points[self.used(poses)]
        return Likelihoods.of_logarithms(
            scan_kernels.field_logarithms(*self.grid, poses, points, self.probabilities),
            len(points),
            float(self.probabilities[0]),
            self.power,
        )

    def used(self, poses: np.ndarray) -> np.ndarray:
        """(b,) bool: which beams are used. Only particles that are together can tell what the map does not hold."""
        everything = np.ones(len(self.points), bool)
        if self.skipping is None or not is_together(poses):
            return everything
        within = self.skipping.distance / self.grid[0].resolution
        agree = scan_kernels.agreeing(*self.grid, poses, self.points, within) / len(poses)
        kept = agree > self.skipping.threshold
        return kept if np.count_nonzero(~kept) <= self.skipping.error_threshold * len(kept) else everything


class BeamScan(_Scan):
    """A scan against rays cast through the map."""

    def __init__(self, model: ScanModel, beams: Beams):
        super().__init__(model, beams)
        c = model.config
        self.law = BeamLaw(
            c.laser_z_hit,
            c.laser_z_short,
            c.laser_z_max,
            c.laser_z_rand,
            c.laser_sigma_hit,
            c.laser_lambda_short,
            float(beams.most),
        )

    def likelihoods(self, poses: np.ndarray) -> Likelihoods:
        sums = scan_kernels.beam_sums(*self.walls, poses, self.origin, self.beams, self.law)
        best = (self.law.hit + self.law.random / self.law.most) ** 3
        return Likelihoods.of_sums(sums, len(self.beams), best, self.power)


_SCANS = {'likelihood_field': FieldScan, 'likelihood_field_prob': FieldProductScan, 'beam': BeamScan}


class ScanModel:
    """What is common to all scans: the map's `cells`, their `place`; for the likelihood field the `squares` of the
    distances from a wall (cells), and the `hits`' part of a beam's probability over these.
    """

    def __init__(self, config: AmclConfig, map_: RangeMap):
        self.config, self.cells, self.place = config, map_.cells, field.Placement.of(map_)
        if config.laser_model_type != 'beam':
            reach = field.reach_of(map_, config.laser_likelihood_max_dist)
            self.squares = field.squares_of(map_, reach)
            distances = np.sqrt(np.arange(reach**2 + 2.0)) * map_.resolution
            distances[-1] = config.laser_likelihood_max_dist
            self.hits = config.laser_z_hit * np.exp(-0.5 * (distances / config.laser_sigma_hit) ** 2)

    @property
    def choice(self) -> BeamChoice:
        """Which beams of a scan are used."""
        c = self.config
        return BeamChoice(c.laser_max_beams, c.laser_min_range, c.laser_max_range, c.laser_model_type == 'beam')

    def scan(self, beams: Beams) -> MeasurementModel:
        """The measurement model of one scan's beams, of which there is at least one."""
        return _SCANS[self.config.laser_model_type](self, beams)


def is_together(poses: np.ndarray) -> bool:
    """Whether all particles (n, 3) are within half a metre of their mean, in x and in y."""
    places = poses[:, :2]
    return bool((np.abs(places - places.mean(0)) <= _CONVERGED).all())


SETTINGS = tuple(f.name for f in AmclConfig.__dataclass_fields__.values() if f.name.startswith(('laser_', 'beam_')))
"""Parameters that a ScanModel depends on, beside do_beamskip."""


def same_model(a: AmclConfig, b: AmclConfig) -> bool:
    """Whether one ScanModel serves both configurations."""
    return all(getattr(a, name) == getattr(b, name) for name in (*SETTINGS, 'do_beamskip'))
