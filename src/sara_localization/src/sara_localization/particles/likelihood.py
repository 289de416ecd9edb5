"""What a measurement says of particles, whatever measured it: the interface of measurement models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from sara_localization.particles.lost import Agreement

_LEAST = 1e-300


class Likelihoods(NamedTuple):
    """How well one measurement fits each of n particles. values (n,): by how much its weight grows, up to a common
    factor. fits (n,): the same as a mean over the parts of the measurement (a scan's beams), from 0 to 1, so that
    measurements of different sizes and models can be compared.
    """

    values: np.ndarray
    fits: np.ndarray

    @classmethod
    def of_sums(cls, sums: np.ndarray, parts: int, best: float, power: float = 1.0) -> Likelihoods:
        """Of 1 + sums (n,) over the parts. best: what a part adds where it fits perfectly. power: to which the values
        are raised, the fits are not.
        """
        values = sums if power == 1.0 else (sums / sums.max()) ** power
        return cls(values, np.minimum((sums - 1.0) / max(parts * best, _LEAST), 1.0))

    @classmethod
    def of_logarithms(cls, logarithms: np.ndarray, parts: int, best: float, power: float = 1.0) -> Likelihoods:
        """Of the logarithms (n,) of products over the parts, which may be too small for a float. best, power: as
        above; best is a factor.
        """
        fits = np.minimum(np.exp(logarithms / parts) / max(best, _LEAST), 1.0)
        return cls(np.exp(power * (logarithms - logarithms.max())), fits)


class MeasurementModel(Protocol):
    """One measurement against a map."""

    def likelihoods(self, poses: np.ndarray) -> Likelihoods:
        """Of poses (n, 3) of the robot in the map: x, y, yaw; m, rad."""
        ...

    def agreement(self, pose: Sequence[float]) -> Agreement:
        """How its readings agree with the map at one pose (x, y, yaw)."""
        ...
