"""State and covariance with what an EKF and a UKF share: time, the first measurement, corrections, control, dynamic
noise.

    correct:  y = z - h x (angles wrapped),  S = H P H' + R,  K = P H' / S,  x <- x + K y,  P <- (I - K H) P (I - K H)'
    + K R K'

A measurement is some of the state's variables as they are, so that the unscented transform of it is this very algebra:
the two filters differ in `_propagate` alone. What happens to the first measurement, to old ones and to variances that
are none is robot_localization's; that its UKF leaves R out of the posterior and takes sigma points that lack the
process noise is not followed. The covariance is kept symmetric and positive definite.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap_exact
from sara_localization.filters import covariance, kernel
from sara_localization.filters.control import Control
from sara_localization.filters.residual import Measured
from sara_localization.filters.state import POSE, ROLL, SIZE, TWIST, YAW

# A time step above this is no time step but a clock that was set (a bag played without simulated time).
LONGEST_STEP = 100000.0
STEP_INSTEAD = 0.01


@functools.lru_cache(maxsize=512)
def _int_array(indices: tuple) -> np.ndarray:
    return np.array(indices, dtype=np.int64)


@functools.lru_cache(maxsize=32)
def _no_bias(k: int) -> np.ndarray:
    return np.full(k, -1, dtype=np.int64)


def measured(
    indices: Sequence[int],
    z: Sequence[float],
    R: np.ndarray,
    threshold: float = math.inf,
    extra: Sequence[int] | None = None,
) -> Measured:
    """The arguments of Estimator.correct as the kernels take them."""
    rows = _int_array(tuple(indices))
    biases = _no_bias(len(z)) if extra is None else _int_array(tuple(extra))
    z, R = np.ascontiguousarray(z, dtype=float), np.ascontiguousarray(R, dtype=float)
    return Measured(rows, biases, z, R, float(threshold))


def observation(m: Measured, n: int) -> np.ndarray:
    """H (k, n) of what is measured of n variables."""
    H = np.zeros((len(m.z), n))
    H[range(len(m.z)), m.indices] = 1.0
    H[np.flatnonzero(m.extra >= 0), m.extra[m.extra >= 0]] = 1.0
    return H


def valid_step(dt: float) -> float:
    """dt, or 0.01 s where it can only come from a clock that was set."""
    return STEP_INSTEAD if dt > LONGEST_STEP else dt


Snapshot = tuple[float, np.ndarray, np.ndarray]
"""(time, x, P)"""


class Biases(NamedTuple):
    """m biases that walk at random behind the 15 variables: process noise (m,) per second, and variance (m,) at the
    start.
    """

    noise: Sequence[float] = ()
    variance: Sequence[float] = ()


class Estimator:
    """Base of Ekf and Ukf.

    Args:
        process_noise: (15, 15) Q per second.
        initial_covariance: (15, 15) P before the first measurement.
        initial_state: (15,) x before the first measurement; zeros if left out.
        control: Control, or None.
        dynamic_process_noise: scale the pose's block of Q by the squared norm of the six velocities.
        biases: none if left out.

    keep_positive: False leaves the covariance as the formulas give it, even where the first measurement makes it none
    (robot_localization's way, for comparison with it).
    """

    def __init__(
        self,
        process_noise,
        initial_covariance,
        initial_state=None,
        control: Control | None = None,
        dynamic_process_noise: bool = False,
        biases: Biases = Biases(),
    ):
        self.n = SIZE + len(biases.noise)
        self.process_noise = np.zeros((self.n, self.n))
        self.process_noise[:SIZE, :SIZE] = 0.5 * (np.asarray(process_noise) + np.transpose(process_noise))
        self.process_noise[range(SIZE, self.n), range(SIZE, self.n)] = biases.noise
        self._initial_covariance = np.zeros((self.n, self.n))
        self._initial_covariance[:SIZE, :SIZE] = initial_covariance
        self._initial_covariance[range(SIZE, self.n), range(SIZE, self.n)] = biases.variance
        self._initial_state = np.zeros(self.n)
        if initial_state is not None:
            self._initial_state[:SIZE] = initial_state
        self.control, self.dynamic_process_noise = control, dynamic_process_noise
        self.keep_positive, self.repairs = True, 0
        self.reset()

    def reset(self) -> None:
        """Back to the state before the first measurement."""
        self.x, self.P = self._initial_state.copy(), self._initial_covariance.copy()
        self.initialised = False
        self.last_measurement_time = 0.0
        self.nis = 0.0

    def set_state(self, x: np.ndarray, P: np.ndarray) -> None:
        """Replace the 15 variables (15,) and their covariance (15, 15); biases stay as they are, independent of the
        rest.
        """
        self.x[:SIZE] = x
        self.P[:SIZE, :SIZE] = P
        self.P[:SIZE, SIZE:] = 0.0
        self.P[SIZE:, :SIZE] = 0.0
        self._keep_positive(covariance.positive_definite(self.P))

    def snapshot(self) -> Snapshot:
        """(time, x, P), to go back to with `restore`."""
        return self.last_measurement_time, self.x.copy(), self.P.copy()

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot."""
        self.last_measurement_time, x, P = snapshot
        self.x, self.P = x.copy(), P.copy()

    def predict(self, dt: float, time: float = math.nan) -> None:
        """Move the state dt seconds on; `time`: the time (s) at the end, for the age of the control input."""
        self._propagate(dt, time)

    def _propagate(self, dt, time):
        raise NotImplementedError

    def _noise(self, x) -> np.ndarray:
        """Q at the state x."""
        if not self.dynamic_process_noise:
            return self.process_noise
        Q = self.process_noise.copy()
        Q[POSE, POSE] *= float(x[TWIST] @ x[TWIST])
        return Q

    def _keep_positive(self, positive: bool):
        if not positive and self.keep_positive:
            self.repairs += 1
            covariance.repair(self.P)

    def correct(
        self,
        indices: Sequence[int],
        z: Sequence[float],
        R: np.ndarray,
        threshold: float = math.inf,
        extra: Sequence[int] | None = None,
    ) -> bool:
        """Take in a measurement of some of the state's variables.

        Args:
            indices: the k variables measured; z: (k,) their values; R: (k, k) the covariance of z.
            threshold: Mahalanobis distance (in sigmas) from which on the measurement is rejected.
            extra: for each of the k the index of the bias it holds besides, or -1; None: no biases.

        Values that are not finite are left out; a negative variance counts as its absolute value and none below 1e-9.
        Returns False if nothing was taken in; `nis` then and else holds the squared Mahalanobis distance.
        """
        return self.take(measured(indices, z, R, threshold, extra))

    def take(self, m: Measured) -> bool:
        """As `correct`."""
        if not len(m.z):
            return False
        result, nis, positive = kernel.take(self.x, self.P, m)
        if result == kernel.NOT_FINITE:
            keep = np.flatnonzero(np.isfinite(m.z) & np.isfinite(m.R.diagonal()))
            if not len(keep):
                return False
            R = np.where(np.isfinite(m.R), m.R, 0.0)[keep[:, None], keep]
            m = Measured(m.indices[keep], m.extra[keep], m.z[keep], R, m.gate)
            result, nis, positive = kernel.take(self.x, self.P, m)
        self.nis = nis
        if result == kernel.CORRELATED_BADLY:
            return self._correct_at_once(m._replace(R=kernel.floored(m.z, m.R)[1]))
        self._keep_positive(positive)
        return result == kernel.TAKEN

    def _correct_at_once(self, m: Measured) -> bool:
        """The same for an R that is no covariance: the formulas as they stand, as far as they go."""
        H = observation(m, self.n)
        y = kernel.innovation(self.x, m)
        PHt = self.P @ H.T
        try:
            inverse = np.linalg.inv(H @ PHt + m.R)
        except np.linalg.LinAlgError:
            return False
        self.nis = float(y @ inverse @ y)
        if not math.isfinite(self.nis) or self.nis >= m.gate * m.gate:
            return False
        K = PHt @ inverse
        G = np.eye(self.n) - K @ H
        self.x += K @ y
        P = G @ self.P @ G.T + K @ m.R @ K.T
        self.P = 0.5 * (P + P.T)
        kernel.wrap_angles(self.x)
        self._keep_positive(covariance.positive_definite(self.P))
        return True

    def process(
        self,
        stamp: float,
        indices: Sequence[int],
        z: Sequence[float],
        R: np.ndarray,
        threshold: float = math.inf,
        extra: Sequence[int] | None = None,
        inflation: float = 1.0,
    ) -> bool:
        """Predict to the measurement's stamp (s) and correct with it; an older one only corrects.

        inflation: by what R is multiplied once the gate has let the measurement pass.

        The first measurement ever is not fused: its values and its block of R are copied into state and covariance.
        Returns False if the measurement was rejected.
        """
        if not self.initialised:
            if not np.isfinite(z).any():
                return False
            self._begin(indices, z, R)
            self.last_measurement_time = stamp
            return True
        dt, m = stamp - self.last_measurement_time, measured(indices, z, R, threshold, extra)
        if inflation != 1.0:
            taken = self._predict_and_correct_inflated(valid_step(dt) if dt > 0.0 else 0.0, stamp, m, inflation)
        else:
            taken = self._predict_and_correct(valid_step(dt), stamp, m) if dt > 0.0 else self.take(m)
        if dt >= 0.0:
            self.last_measurement_time = stamp
        return taken

    def _predict_and_correct(self, dt, stamp, m):
        self._propagate(dt, stamp)
        return self.take(m)

    def _predict_and_correct_inflated(self, dt, stamp, m, inflation):
        """The gate judges a measurement by its own R; what is taken of it is what the inflated one lets."""
        if dt:
            self._propagate(dt, stamp)
        x, P = self.x.copy(), self.P.copy()
        taken, nis = self.take(m), self.nis
        if taken:
            self.x[:], self.P[:] = x, P
            taken = self.take(m._replace(R=inflation * m.R, gate=math.inf))
            self.nis = nis
        return taken

    def predict_to(self, time: float) -> None:
        """Move the state to the time (s), which becomes the time of the state."""
        dt = valid_step(time - self.last_measurement_time)
        self._propagate(dt, time)
        self.last_measurement_time += dt

    def _begin(self, indices, z, R):
        z, R = np.asarray(z, dtype=float), np.asarray(R, dtype=float)
        keep = np.flatnonzero(np.isfinite(z))
        measured = np.asarray(indices, dtype=int)[keep]
        self.x[measured] = z[keep]
        self.P[measured[:, None], measured] = R[keep[:, None], keep]
        for i in range(ROLL, YAW + 1):
            self.x[i] = wrap_exact(self.x[i])
        self.initialised = True
        # What the initial covariance said about the measured variables and the others together need not fit the new
        # block: then it is dropped, and the filter does not start with a covariance that is none.
        if self.keep_positive:
            self.P = 0.5 * (self.P + self.P.T)
        if self.keep_positive and not covariance.positive_definite(self.P):
            others = np.setdiff1d(np.arange(self.n), measured)
            self.P[measured[:, None], others] = 0.0
            self.P[others[:, None], measured] = 0.0
            self._keep_positive(covariance.positive_definite(self.P))
