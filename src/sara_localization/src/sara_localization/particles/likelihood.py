"""What a measurement says of particles, whatever measured it: the interface of measurement models."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np


class Likelihoods(NamedTuple):
    """How well one measurement fits each of n particles. values (n,): by how much its weight grows, up to a common
    factor. fits (n,): the same as a mean over the parts of the measurement (a scan's beams), so that measurements of
    different sizes can be compared.
    """

    values: np.ndarray
    fits: np.ndarray

    @classmethod
    def of_sums(cls, sums: np.ndarray, parts: int) -> Likelihoods:
        """Of 1 + sums (n,) over the parts."""
        return cls(sums, (sums - 1.0) / parts)

    @classmethod
    def of_logarithms(cls, logarithms: np.ndarray, parts: int) -> Likelihoods:
        """Of the logarithms (n,) of products over the parts, which may be too small for a float."""
        return cls(np.exp(logarithms - logarithms.max()), np.exp(logarithms / parts))


class MeasurementModel(Protocol):
    """One measurement against a map."""

    def likelihoods(self, poses: np.ndarray) -> Likelihoods:
        """Of poses (n, 3) of the robot in the map: x, y, yaw; m, rad."""
        ...
