"""A message's values on their way to a measurement: what is no data is left out, masks and covariances turn with their
frame.

A sensor states the same covariance in every message, as a rule, and sits still on its robot: what follows from
covariance, mask and mounting is worked out once and kept (Memory) for as long as they stay the same; then only the
values are looked at. The loops are compiled: numpy's calls cost more than their work here.
"""

from __future__ import annotations

from math import fabs, sqrt
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_localization.filters.covariance import cholesky
from sara_localization.filters.state import NAMES, OFF_PLANE, SIZE
from sara_localization.geometry.rigid import Quaternion, rotation_matrix

OFF_PLANE_VARIANCE = 1e-6
# Drivers write "I do not measure this" as a very large variance; squared, it would no longer be a number.
LARGEST_VARIANCE = 1e15
# No robot is as far away or as fast (m, m/s, ...); a few steps on, such a number would no longer be one.
LARGEST_VALUE = 1e12


class Problem(NamedTuple):
    """Something wrong with a message: its kind (counted by it) and a sentence for the user."""

    kind: str
    sentence: str


class Measurement(NamedTuple):
    """k of the state's variables at a time: indices, z (k,), R (k, k), perhaps shared with others, the gate in sigmas.

    extra: for each of the k the index of the bias that z holds besides, or -1; None: no biases.
    informative: how many of the k a sensor measured; the zeros of two_d_mode and of a parked robot are nobody's.
    inflation: by what R is multiplied once the gate has let z pass: of errors that persist (correlation.py).
    """

    stamp: float
    source: str
    indices: tuple[int, ...]
    z: np.ndarray
    R: np.ndarray
    threshold: float = float('inf')
    extra: tuple[int, ...] | None = None
    informative: int = 0
    inflation: float = 1.0


class Memory:
    """What was worked out of the last sound covariance of a source; given: the array itself if nobody can change it."""

    __slots__ = ('given', 'covariance', 'mask', 'rotation', 'two_d', 'indices', 'places', 'R', 'informative')

    def __init__(self):
        self.given = self.covariance = self.mask = None

    def keep(self, covariance: np.ndarray) -> None:
        """Remember what is worked out of this one. One that cannot be written is known again by itself, another by its
        bytes.
        """
        self.covariance = np.asarray(covariance).tobytes()
        self.given = covariance if isinstance(covariance, np.ndarray) and not covariance.flags.writeable else None

    def holds(self, covariance: np.ndarray) -> bool:
        """Whether it is the one that is remembered."""
        return covariance is self.given or self.covariance == np.asarray(covariance).tobytes()


class RawMeasurement:
    """Up to 15 variables from `first` on being prepared, three at a time of one kind: values (n,), covariance (n, n),
    which are measured (mask (n,)), and what was wrong with them. memory: the source's own, None: nothing is kept.
    """

    def __init__(self, first: int, values, covariance, mask, memory: Memory | None = None):
        self.first, self.values, self.problems = first, list(map(float, values)), []
        self._given, self._memory, self._rotation = (covariance, mask), memory, None
        self._known = None
        if memory is not None and memory.mask == mask and memory.holds(covariance) and _sane(self.values):
            self._known = memory
            return
        self._write()
        if not sound(np.array(self.values), self._covariance, self._mask):
            self._sift()

    def _write(self):
        """From here on with arrays of its own."""
        self._known = None
        covariance, mask = self._given
        n = len(self.values)
        self._covariance = np.array(covariance, dtype=float).reshape(n, n)
        self._mask = np.array(mask, dtype=bool)
        if self._rotation is not None:
            turn(rotation_matrix(self._rotation), self._mask, self._covariance)

    @property
    def covariance(self) -> np.ndarray:
        if self._known is not None:
            self._write()
        return self._covariance

    @property
    def mask(self) -> np.ndarray:
        if self._known is not None:
            self._write()
        return self._mask

    def _sift(self):
        """Leave out what is measured but no data; zero what is neither, so that it cannot spread by a rotation."""
        covariance, mask, variances = self._covariance, self._mask, self._covariance.diagonal()
        for i in np.flatnonzero(~mask):
            if not (abs(self.values[i]) < LARGEST_VALUE and abs(variances[i]) < LARGEST_VARIANCE):
                self.values[i] = 0.0
                covariance[i, :] = covariance[:, i] = 0.0
            covariance[i, ~np.isfinite(covariance[i])] = 0.0
            covariance[~np.isfinite(covariance[:, i]), i] = 0.0
        for i in np.flatnonzero(mask):
            name, variance = NAMES[self.first + i], float(variances[i])
            if not np.isfinite(self.values[i]):
                self._leave_out(i, 'not_finite', f'{name} is {self.values[i]}')
            elif abs(self.values[i]) >= LARGEST_VALUE:
                self._leave_out(i, 'huge_value', f'{name} is {self.values[i]:g}')
            elif not np.isfinite(variance):
                self._leave_out(i, 'not_finite', f'the variance of {name} is {variance}')
            elif variance <= 0.0:
                self._leave_out(
                    i,
                    'bad_variance',
                    f'the variance of {name} is {variance:g} and {name} is left out; its sensor must state a '
                    'positive one',
                )
            elif variance >= LARGEST_VARIANCE:
                self._leave_out(i, 'huge_variance', f'the variance of {name} is {variance:g}')
        for i in np.flatnonzero(mask):
            fit = np.isfinite(covariance[i]) & np.isfinite(covariance[:, i])
            fit &= np.abs(covariance[i]) < LARGEST_VARIANCE
            fit &= np.abs(covariance[:, i]) < LARGEST_VARIANCE
            if not fit.all():
                name, variance = NAMES[self.first + i], float(variances[i])
                self.problems.append(Problem('not_finite', f'a covariance of {name} is not a number: taken as 0'))
                covariance[i, :] = covariance[:, i] = 0.0
                covariance[i, i] = variance

    def _leave_out(self, i, kind, sentence):
        self._mask[i] = False
        self.values[i] = 0.0
        self._covariance[i, :] = self._covariance[:, i] = 0.0
        self.problems.append(Problem(kind, sentence))

    def turn(self, rotation: Quaternion) -> None:
        """Turn mask and covariance, three variables at a time, by the unit quaternion."""
        self._rotation = rotation
        if self._known is None:
            turn(rotation_matrix(rotation), self._mask, self._covariance)

    def measurement(self, stamp: float, source: str, threshold: float, two_d: bool) -> Measurement | None:
        """What is measured after all; with two_d the variables off the plane besides, as zero and uncorrelated with the
        rest.
        """
        known = self._known
        if known is not None:
            if known.rotation == self._rotation and known.two_d == two_d and _sane(self.values):
                values = (*self.values, 0.0)
                return Measurement(
                    stamp,
                    source,
                    known.indices,
                    np.array([values[k] for k in known.places]),
                    known.R,
                    threshold,
                    None,
                    known.informative,
                )
            self._write()
        if not self._mask.any():
            return None
        indices, z, R, positive, informative, sane = measured(
            self.first, np.array(self.values), self._covariance, self._mask, two_d
        )
        if not sane:
            # The lever arm of a sensor on a robot whose state has run away, squared: it would run away further.
            self._sift()
            return self.measurement(stamp, source, threshold, two_d)
        if not positive:
            self.problems.append(
                Problem('indefinite_covariance', 'the covariance is not positive definite: only its diagonal is used')
            )
            R = np.diag(np.maximum(R.diagonal(), 1e-9))
        indices = tuple(indices.tolist())
        if self._memory is not None and not self.problems:
            self._keep(indices, R, informative, two_d)
        return Measurement(stamp, source, indices, z, R, threshold, None, informative)

    def _keep(self, indices, R, informative, two_d):
        m, n = self._memory, len(self.values)
        m.keep(self._given[0])
        m.mask, m.rotation, m.two_d = self._given[1], self._rotation, two_d
        m.indices, m.R, m.informative = indices, R, informative
        m.places = tuple(n if two_d and i in OFF_PLANE else i - self.first for i in indices)


def _sane(values) -> bool:
    """Whether all are numbers, and none is huge (nor all of them together, which errs on the side of a second look)."""
    return sum(map(abs, values)) < LARGEST_VALUE


@kernel
def sound(values: np.ndarray, covariance: np.ndarray, mask: np.ndarray) -> bool:
    """Whether everything is a number of a sane size and what is measured (mask (n,) bool) has a positive variance."""
    n = values.shape[0]
    for i in range(n):
        if not fabs(values[i]) < LARGEST_VALUE:
            return False
        for j in range(n):
            if not fabs(covariance[i, j]) < LARGEST_VARIANCE:
                return False
        if mask[i] and not covariance[i, i] > 0.0:
            return False
    return True


@kernel
def turn(R: np.ndarray, mask: np.ndarray, covariance: np.ndarray) -> None:
    """Turn mask (n,) and covariance (n, n), three variables at a time, by the (3, 3) matrix R, in place."""
    n = mask.shape[0]
    turned = np.empty((n, n))
    for block in range(0, n, 3):
        on = mask[block : block + 3].copy()
        for i in range(3):
            length = 0.0
            for j in range(3):
                if on[j]:
                    length += R[i, j] * R[i, j]
            mask[block + i] = sqrt(length) >= 1e-6
            for k in range(n):
                turned[block + i, k] = (
                    R[i, 0] * covariance[block, k]
                    + R[i, 1] * covariance[block + 1, k]
                    + R[i, 2] * covariance[block + 2, k]
                )
    for block in range(0, n, 3):
        for i in range(3):
            for k in range(n):
                covariance[k, block + i] = (
                    R[i, 0] * turned[k, block] + R[i, 1] * turned[k, block + 1] + R[i, 2] * turned[k, block + 2]
                )


@kernel
def measured(
    first: int, values: np.ndarray, covariance: np.ndarray, mask: np.ndarray, two_d: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool, int, bool]:
    """Of n variables from `first` on those that are measured: (indices (k,), z (k,), R (k, k), whether R is positive
    definite, how many of the k are not forced, whether all of z is below LARGEST_VALUE).

    two_d: the variables OFF_PLANE are measured as 0 besides, uncorrelated with the rest.
    """
    n = values.shape[0]
    taken = np.zeros(SIZE, np.bool_)
    forced = np.zeros(SIZE, np.bool_)
    for i in range(n):
        taken[first + i] = mask[i]
    if two_d:
        for i in OFF_PLANE:
            taken[i] = forced[i] = True
    k = 0
    for i in range(SIZE):
        k += taken[i]
    indices, z, R = np.empty(k, np.int64), np.zeros(k), np.zeros((k, k))
    a = 0
    for i in range(SIZE):
        if taken[i]:
            indices[a] = i
            a += 1
    correlated, sane = False, True
    for a in range(k):
        i = indices[a]
        if forced[i]:
            R[a, a] = OFF_PLANE_VARIANCE
            continue
        z[a] = values[i - first]
        sane = sane and fabs(z[a]) < LARGEST_VALUE
        for b in range(k):
            j = indices[b]
            if not forced[j]:
                R[a, b] = 0.5 * (covariance[i - first, j - first] + covariance[j - first, i - first])
                correlated = correlated or (a != b and R[a, b] != 0.0)
    return indices, z, R, not correlated or cholesky(R, np.zeros((k, k))), k - forced.sum(), sane


def warm() -> None:
    """Compile (or load from the cache) everything."""
    mask = np.ones(6, dtype=bool)
    sound(np.zeros(6), np.eye(6), mask)
    turn(np.eye(3), mask, np.eye(6))
    measured(0, np.zeros(6), np.eye(6), mask, True)
