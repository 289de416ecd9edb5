"""Where a robot is that may be anywhere in the map, from ranges alone: Monte Carlo localization.

Particles over all free places move with the dead reckoning and are weighed by what the range sensors hear against the
map (echo_table.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse, wrap
from sara_localization.particles import field
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.belief import Belief, belief
from sara_localization.particles.likelihood import Likelihoods
from sara_localization.particles.particle_filter import ParticleFilter
from sara_localization.ranges import echo_table
from sara_localization.ranges.echo_table import BeamModel
from sara_localization.ranges.range_data import RangeMap

Pose = tuple[float, float, float]

PARTICLES_PER_M2, LEAST, MOST = 150, 2000, 100_000
MOTION = {
    'odom_model_type': 'diff-corrected',
    'odom_alpha1': 0.002,
    'odom_alpha2': 0.0002,
    'odom_alpha3': 0.003,
    'odom_alpha4': 0.001,
}
STEP_M, STEP_RAD = 0.2, math.radians(20.0)
WEIGHT = 0.5
MODEL = BeamModel(0.10, 0.80, 0.06, 0.06, 0.08)
CLEARANCE = 0.25
JITTER_M, JITTER_RAD = 0.04, math.radians(2.0)
IN_WALL = -10.0


class Heard(NamedTuple):
    """A reading: where the sensor was at its burst, in the dead reckoning's frame (x, y, yaw); bin of its range."""

    sensor: Pose
    bin: int


class GlobalSearch:
    def __init__(self, map_: RangeMap, field_of_view: float, limit: float, least: float, rng: np.random.Generator):
        echo_table.warm()
        self.map, self.least = map_, least
        self.table = echo_table.make(map_, field_of_view, limit)
        self.logs = echo_table.logarithms(MODEL, limit, least)
        free = field.free_cells(map_)
        squares = field.squares_of(map_, field.reach_of(map_, CLEARANCE))
        roomy = free[squares.ravel()[free] > (CLEARANCE / map_.resolution) ** 2]
        self._roomy = np.zeros(map_.cells.size, bool)
        self._roomy[roomy] = True
        self._roomy = self._roomy.reshape(map_.cells.shape)
        self._draw = lambda count: field.random_poses(map_, roomy, count, rng)
        count = int(min(PARTICLES_PER_M2 * len(roomy) * map_.resolution**2, MOST))
        config = AmclConfig(
            min_particles=min(LEAST, count), max_particles=count, kld_err=0.02, selective_resampling=True, **MOTION
        )
        self.filter = ParticleFilter(config, rng)
        self.filter.start_anywhere(self._draw, count)
        self.last: Pose | None = None
        self.stations: list[tuple[Pose, np.ndarray]] = []
        self.belief: Belief | None = None

    def due(self, here: Pose) -> bool:
        last = self.last
        return (
            last is None or math.dist(last[:2], here[:2]) > STEP_M or abs(float(wrap(here[2] - last[2]))) > STEP_RAD
        )

    def update(self, here: Pose, heard: Sequence[Heard]) -> Belief:
        if self.last is not None:
            self.filter.move(self.last, here)
            jitter = self.filter.rng.standard_normal(self.filter.poses.shape) * (JITTER_M, JITTER_M, JITTER_RAD)
            self.filter.poses = self.filter.poses + jitter
        self.last = here
        back = inverse(here)
        readings = np.array([(*compose(back, h.sensor), h.bin) for h in heard], float).reshape(-1, 4)
        self.stations.append((here, readings))
        poses = self.filter.poses
        sums = np.zeros(len(poses))
        echo_table.add_logarithms(self.table, self.logs, poses, readings, sums)
        sums = WEIGHT * sums + np.where(self._has_room(poses), 0.0, IN_WALL)
        self.filter.weigh(Likelihoods(np.exp(sums - sums.max()), np.zeros(len(poses))))
        self.filter.resample(None)
        self.belief = belief(self.filter.poses, self.filter.weights)
        return self.belief

    def _has_room(self, poses):
        place = self.table.place
        dx, dy = (poses[:, 0] - place.x) / place.resolution, (poses[:, 1] - place.y) / place.resolution
        columns = np.floor(place.cosine * dx + place.sine * dy).astype(int)
        rows = np.floor(place.cosine * dy - place.sine * dx).astype(int)
        inside = (rows >= 0) & (rows < self._roomy.shape[0]) & (columns >= 0) & (columns < self._roomy.shape[1])
        found = np.zeros(len(poses), bool)
        found[inside] = self._roomy[rows[inside], columns[inside]]
        return found
