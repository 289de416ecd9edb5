"""The probability that the pose is wrong, from how well the newest readings agree with the map there.

A hidden Markov model of two states, found and lost (S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005,
section 2.4; K. Murphy, "Machine Learning", 2012, section 17.4). The spread of the particles does not tell: in a place
that looks alike they are as close together.

Each reading agrees with the map, ends before the wall that the map has there, or goes through one. People and furniture
cause the second kind, never the third. Readings of one measurement err together, for one person hides many of them;
their counts follow a Dirichlet-multinomial distribution in each state (T. Minka, "Estimating a Dirichlet
distribution", 2000), which is sure of nothing after one measurement, however many readings it has. Where a place fits
as badly as among many people, that is no proof of being lost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap

NEAR, TURNED = 0.5, math.radians(30.0)
"""m, rad from the robot from which on a pose is wrong."""


_LEAST = 1e-6

Dirichlet = tuple[float, float, float, float]
"""The four parameters of a Dirichlet distribution, as Agreement has its counts."""


class Agreement(NamedTuple):
    """How many readings of a measurement, at one pose: agree with the map; agree, but behind a wall (past a corner, as
    a rule); are shorter than the map has them; are longer. Readings that the map says nothing of count nowhere.
    """

    agree: int
    behind: int
    short: int
    long: int


class Evidence(NamedTuple):
    """What a measurement says of the pose that is judged. outside: `outside` of it; moved: whether the robot has moved
    since the measurement before.
    """

    agreement: Agreement
    outside: float
    moved: bool


class LostLaw(NamedTuple):
    """The model's numbers. found, lost: the distributions of readings in either state.
    loses, finds: probability from one measurement to the next that a right pose becomes wrong, and a wrong one right.
    share: how much a measurement says beside those before it, 0 to 1; at_rest: times this, where the robot has not
    moved since. rivals: how much of the log odds that the particles elsewhere have by their weights is believed.
    """

    found: Dirichlet
    lost: Dirichlet
    loses: float
    finds: float
    share: float
    at_rest: float
    rivals: float


LAW = LostLaw((7.23, 1.31, 1.33, 0.0704), (2.13, 0.568, 0.816, 1.4), 0.0283, 0.169, 0.999, 0.138, 0.742)
"""What `rosrun sara_lab fit_lost --seeds 5 --held-out 2` finds over 60 simulated drives of 40 m in a flat, a school
and a hall, half of them among pedestrians, with and without a gyro; in each the robot was carried away once.
"""


class LostFilter:
    """`hidden`: the probability that none of the particles is right; `probability`: that the pose is wrong. Both 0 to
    1. `evidence`: the newest, None before the first.
    """

    def __init__(self, law: LostLaw = LAW):
        self.law = law
        self.start(1.0)

    def start(self, probability: float) -> None:
        """Begin anew, lost with that probability."""
        self.hidden = self.probability = probability
        self.evidence: Evidence | None = None

    def update(self, said: Evidence) -> None:
        """Take a measurement."""
        law, self.evidence = self.law, said
        agreement, outside, moved = said
        weight = law.share * (1.0 if moved else law.at_rest)
        before = self.hidden * (1.0 - law.finds) + (1.0 - self.hidden) * law.loses if moved else self.hidden
        before = min(max(before, _LEAST), 1.0 - _LEAST)
        log_odds = math.log(before / (1.0 - before)) + weight * log_ratio(agreement, law.found, law.lost)
        self.hidden = 1.0 / (1.0 + math.exp(-log_odds))
        self.probability = 1.0 - (1.0 - self.hidden) * (1.0 - _tempered(outside, law.rivals))


def _tempered(share, exponent):
    """A probability whose log odds count by a factor."""
    kept, lost = (max(part, _LEAST) ** exponent for part in (1.0 - share, share))
    return lost / (kept + lost)


def log_ratio(agreement: Agreement, found: Dirichlet, lost: Dirichlet) -> float:
    """The logarithm of how many times likelier a measurement is where the pose is wrong than where it is right."""
    return log_likelihood(agreement, lost) - log_likelihood(agreement, found)


def log_likelihood(counts: Sequence[int], alphas: Sequence[float]) -> float:
    """Of the Dirichlet-multinomial distribution, but for what does not depend on alphas."""
    total, n = sum(alphas), sum(counts)
    parts = sum(math.lgamma(alpha + count) - math.lgamma(alpha) for alpha, count in zip(alphas, counts))
    return math.lgamma(total) - math.lgamma(total + n) + parts


def outside(pose: tuple[float, float, float], poses: np.ndarray, weights: np.ndarray) -> float:
    """The share, by weight, of particles (n, 3) that say that a pose is wrong."""
    x, y, yaw = pose
    far = np.hypot(poses[:, 0] - x, poses[:, 1] - y) > NEAR
    far |= np.abs(wrap(poses[:, 2] - yaw)) > TURNED
    return min(float(weights[far].sum()), 1.0)
