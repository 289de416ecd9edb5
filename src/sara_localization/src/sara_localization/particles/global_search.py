"""Where a robot is that may be anywhere in the map, from ranges alone: Monte Carlo localization.

Particles over all places where the robot has room move with the dead reckoning and are weighed by what the range
sensors hear against the map (echo_table.py; S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, chapter 8).
After each step they are spread a little (the regularized particle filter: C. Musso, N. Oudjane, F. Le Gland, "Improving
regularised particle filters", 2001), so that few of them per square metre find the middle of a place. Readings of one
step and of its neighbours err together: a reading counts as WEIGHT of one.

One cluster of particles is no proof, for others may have died by chance. So what was heard is compared with the whole
map once more before the place counts as found (rivals.py). Places that explain it about as well get particles again.
Where in its place the robot is the same readings tell; until they do so exactly enough, the search goes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse
from sara_localization.particles import echo_table, field
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.belief import Belief, belief
from sara_localization.particles.echo_table import EchoTable
from sara_localization.particles.likelihood import Likelihoods
from sara_localization.particles.particle_filter import ParticleFilter
from sara_localization.particles.rivals import Rivals, Station
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_data import RangeData, RangeMap

PARTICLES_PER_M2, LEAST, MOST = 150, 2000, 100_000
"""Per square metre where the robot has room at the start, and at least and at most in all."""
MOTION = {
    'odom_model_type': 'diff-corrected',
    'odom_alpha1': 0.002,
    'odom_alpha2': 0.0002,
    'odom_alpha3': 0.003,
    'odom_alpha4': 0.001,
}
"""Errors of the dead reckoning in a step, as motion.py takes them: 4 % of a turn, 5 % of the way."""
JITTER = (0.04, 0.04, math.radians(2.0))
"""m, m, rad: standard deviations by which particles are spread after a step."""
WEIGHT = 0.15
"""Of a reading, as the exponent of its likelihood."""
IN_WALL = -10.0
"""Logarithm by which a place without room for the robot is less likely."""
CLUSTER, SPREAD_M, SPREAD_RAD = 0.99, 0.25, math.radians(6.0)
"""Share of the particles, and standard deviations, from which on a cluster may be the place."""
SURE = 8.0
"""By how much, as a logarithm, the place must be likelier than any other."""
EXACT_M, EXACT_RAD = 0.10, math.radians(2.5)
"""Standard deviations of a pose that counts as found, at most: it is within 0.20 m and 5 deg, at two of these."""
AGAIN_M = 1.0
"""m driven from one comparison with the whole map to the next."""
FEWEST = 8
"""Steps before the first of these."""
BACK = 0.5
"""Share of the particles that go to the rivals that a comparison has found."""


class Echo(NamedTuple):
    """A reading: the sensor at its burst in the dead reckoning's frame (x, y, yaw); range, m (REP-117); least that it
    measures, m.
    """

    sensor: tuple[float, float, float]
    range: float
    least: float

    @classmethod
    def of(cls, here: tuple[float, float, float], reading: RangeData) -> Echo:
        """Of a reading, for whose burst the dead reckoning has the robot at (x, y, yaw)."""
        return cls(compose(here, reading.mount), reading.range, reading.least)


class Places:
    """Where on a map the robot may be, `roomy`: bool (rows, columns), and what is heard there; good for any number of
    searches on that map.
    """

    def __init__(self, map_: RangeMap, clearance: float):
        """Free cells farther than `clearance` (m) from walls. Raises ValueError with a sentence where there is none, or
        there are too many cells.
        """
        free = field.free_cells(map_)
        if len(free) > echo_table.MOST_CELLS:
            raise ValueError(f'the map has {len(free)} free cells, allowed are {echo_table.MOST_CELLS}')
        squares = field.squares_of(map_, field.reach_of(map_, clearance))
        roomy = np.zeros(map_.cells.size, np.bool_)
        roomy[free] = squares.ravel()[free] > (clearance / map_.resolution) ** 2
        if not roomy.any():
            raise ValueError(f'the map has no free place that is {clearance:g} m from its walls')
        self.roomy, self._map = roomy.reshape(map_.cells.shape), map_
        self._tables: dict[tuple[float, float], EchoTable] = {}

    @classmethod
    def prepared(
        cls, map_: RangeMap, clearance: float, field_of_view: float, limit: float, pause: Callable[[], None]
    ) -> Places:
        """With the table that sensors need; see there."""
        places = cls(map_, clearance)
        places.table(field_of_view, limit, pause)
        return places

    def table(self, field_of_view: float, limit: float, pause: Callable[[], None] = lambda: None) -> EchoTable:
        """What sensors with a full cone (rad) hear there up to `limit` (m): takes a second or so the first time.

        pause: called every few ms meanwhile.
        """
        cone = field_of_view, limit
        if cone not in self._tables:
            self._tables[cone] = echo_table.make(self._map, *cone, pause)
        return self._tables[cone]


class Found(NamedTuple):
    """Where the robot is: (x, y, yaw) in the map, and the covariance (3, 3) of that."""

    pose: tuple[float, float, float]
    covariance: np.ndarray


class GlobalSearch:
    """A search over a map. `filter`: the particles; `belief`: what they say, None before the first step; `rival`: the
    pose of another place that explains what was heard about as well as the one they agree on, None where there is none
    or they do not agree; `steps`: how many there were.
    """

    def __init__(self, config: RangeConfig, map_: RangeMap, places: Places, field_of_view: float, limit: float):
        """places: of the map; field_of_view: the sensors' full cone, rad; limit: m, farther nothing is heard."""
        echo_table.warm()
        self.config, self.field_of_view, self.limit, self._roomy = config, field_of_view, limit, places.roomy
        self._table = places.table(field_of_view, limit)
        self._logs = echo_table.logarithms(config.beam_model, limit, config.range_min_range)
        roomy, rng = np.flatnonzero(places.roomy).astype(np.int32), np.random.default_rng(config.seed)
        count = int(min(max(PARTICLES_PER_M2 * len(roomy) * map_.resolution**2, LEAST), MOST))
        self.filter = ParticleFilter(
            AmclConfig(min_particles=LEAST, max_particles=count, kld_err=0.02, selective_resampling=True, **MOTION),
            rng,
        )
        self.filter.start_anywhere(lambda number: field.random_poses(map_, roomy, number, rng), count)
        self._rivals = Rivals(self._table, self._logs, WEIGHT, places.roomy)
        self._last, self._way, self._compared = None, 0.0, -AGAIN_M
        self.belief: Belief | None = None
        self.rival: tuple[float, float, float] | None = None
        self.steps = 0

    def is_due(self, here: tuple[float, float, float]) -> bool:
        """Whether the robot has moved enough for a step, by the dead reckoning's pose (x, y, yaw)."""
        return self._last is None or self.config.has_moved(self._last, here)

    def step(self, here: tuple[float, float, float], echoes: Sequence[Echo]) -> Found | None:
        """The robot is at (x, y, yaw) by the dead reckoning, and has heard these since the last step, the newest of
        each sensor. Returns the place once it is sure.
        """
        self._move(here)
        self._weigh(self._station(here, echoes))
        self.filter.resample(None)
        self.belief = belief(self.filter.poses, self.filter.weights)
        self.steps += 1
        if self._agree():
            return self._compare(here)
        self.rival = None
        return None

    def _move(self, here):
        particles = self.filter
        if self._last is not None:
            self._way += math.dist(self._last[:2], here[:2])
            particles.move(self._last, here)
            particles.poses += particles.rng.standard_normal(particles.poses.shape) * JITTER
        self._last = here

    def _station(self, here, echoes):
        back, least = inverse(here), self.config.range_min_range
        rows = [
            (*compose(back, e.sensor), echo_table.bin_of(self._table, e.range, max(e.least, least))) for e in echoes
        ]
        station = Station(here, np.array(rows, float).reshape(-1, 4))
        self._rivals.add(station)
        return station

    def _weigh(self, station):
        poses = self.filter.poses
        sums = np.zeros(len(poses))
        echo_table.add_logarithms(self._table, self._logs, poses, station.readings, sums)
        sums = WEIGHT * sums + np.where(echo_table.is_marked(self._table, self._roomy, poses), 0.0, IN_WALL)
        self.filter.weigh(Likelihoods(np.exp(sums - sums.max()), np.zeros(len(poses))))

    def _agree(self):
        """Whether the particles are in one place."""
        found = self.belief
        return (
            self.steps >= FEWEST
            and found.weight >= CLUSTER
            and _is_within(found.cluster_covariance, SPREAD_M, SPREAD_RAD)
        )

    def _compare(self, here):
        """What step returns where the particles agree."""
        if self._way - self._compared < AGAIN_M:
            return None
        self._compared = self._way
        lead, others = self._rivals.compare(here, self.belief.pose, SURE)
        if lead > SURE:
            self.rival = None
            found = Found(*self._rivals.pose_near(here, self.belief.pose))
            return found if _is_within(found.covariance, EXACT_M, EXACT_RAD) else None
        self.rival = tuple(others[0].tolist())
        particles = self.filter
        moved = particles.rng.random(len(particles.poses)) < BACK
        chosen = others[particles.rng.integers(len(others), size=np.count_nonzero(moved))]
        particles.poses[moved] = chosen + particles.rng.standard_normal(chosen.shape) * JITTER
        return None


def _is_within(covariance, metres, radians):
    """Whether standard deviations of x, y, yaw are: that of the place, and of the heading."""
    return covariance[0, 0] + covariance[1, 1] <= metres**2 and covariance[2, 2] <= radians**2
