"""The extended Kalman filter: filterpy's algebra under the 15-variable state of robot_localization.

    predict:  x <- f(x, dt),  P <- F P F' + Q dt
    correct:  y = z - x[measured] (angles wrapped),  S = H P H' + R,  K = P H' / S,
              x <- x + K y,  P <- (I - K H) P (I - K H)' + K R K'   (Joseph's form)

Method: R. Labbe, "Kalman and Bayesian Filters in Python" (filterpy) for the algebra; robot_localization's Ekf and
FilterBase for what happens to the first measurement, to old ones and to variances that are no variances.
"""
from __future__ import annotations

import functools
import math

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from . import motion_model
from .geometry import wrap
from .state import ROLL, SIZE, YAW

# A time step above this is no time step but a clock that was set (a bag played without simulated time).
LONGEST_STEP = 100000.0
STEP_INSTEAD = 0.01
SMALLEST_VARIANCE = 1e-9


@functools.lru_cache(maxsize=256)
def _selection(indices: tuple):
    """H (k, 15) that picks the measured variables, their indices as an array, and which of the k are angles."""
    H = np.zeros((len(indices), SIZE))
    H[range(len(indices)), indices] = 1.0
    H.flags.writeable = False
    angles = tuple(k for k, i in enumerate(indices) if ROLL <= i <= YAW)
    return H, np.array(indices, dtype=int), angles


class _Filter(ExtendedKalmanFilter):
    """filterpy's filter with the motion model in the place of x = F x, as filterpy asks for in predict_x."""

    dt = 0.0

    def predict_x(self, u=0):
        self.x, self.F = motion_model.predict(self.x, self.dt)


class Ekf:
    """State and covariance, moved by predict and correct.

    Args:
        process_noise: (15, 15) Q per second.
        initial_covariance: (15, 15) P before the first measurement.
        initial_state: (15,) x before the first measurement; zeros if left out.
    """

    def __init__(self, process_noise, initial_covariance, initial_state=None):
        self.process_noise = np.array(process_noise, dtype=float)
        self._initial_covariance = np.array(initial_covariance, dtype=float)
        self._initial_state = np.zeros(SIZE) if initial_state is None else np.array(initial_state, dtype=float)
        self.reset()

    def reset(self):
        """Back to the state before the first measurement."""
        self.kf = _Filter(dim_x=SIZE, dim_z=SIZE)
        self.kf.x = self._initial_state.copy()
        self.kf.P = self._initial_covariance.copy()
        self.initialised = False
        self.last_measurement_time = 0.0

    @property
    def x(self) -> np.ndarray:
        """The state (15,); not to be changed in place."""
        return self.kf.x

    @property
    def P(self) -> np.ndarray:
        """Its covariance (15, 15); not to be changed in place."""
        return self.kf.P

    def set_state(self, x, P):
        """Replace state (15,) and covariance (15, 15)."""
        self.kf.x = np.array(x, dtype=float)
        self.kf.P = np.array(P, dtype=float)

    def predict(self, dt: float):
        """Move the state dt seconds on."""
        kf = self.kf
        kf.dt = dt
        kf.Q = self.process_noise * dt
        kf.predict()
        self._tidy()

    def correct(self, indices, z, R, threshold: float = math.inf) -> bool:
        """Take in a measurement of some of the state's variables.

        Args:
            indices: the k variables measured; z: (k,) their values; R: (k, k) the covariance of z.
            threshold: Mahalanobis distance (in sigmas) from which on the measurement is rejected.

        Values that are not finite are left out; a negative variance counts as its absolute value and none below 1e-9.
        Returns False if nothing was taken in.
        """
        z = np.asarray(z, dtype=float)
        R = np.array(R, dtype=float)
        finite = np.isfinite(z)
        if not finite.all():
            keep = np.flatnonzero(finite)
            indices, z, R = [indices[k] for k in keep], z[keep], R[keep[:, None], keep]
        if len(z) == 0:
            return False
        H, measured, angles = _selection(tuple(indices))
        diagonal = np.einsum('ii->i', R)
        np.maximum(np.abs(diagonal), SMALLEST_VARIANCE, out=diagonal)

        def residual(measurement, expected):
            y = measurement - expected
            for k in angles:
                y[k] = wrap(y[k])
            return y

        kf = self.kf
        if threshold < 1e150:
            y = residual(z, kf.x[measured])
            S = kf.P[measured[:, None], measured] + R
            if y @ np.linalg.inv(S) @ y >= threshold * threshold:
                return False
        x, P = kf.x, kf.P
        try:
            kf.update(z, lambda _: H, lambda state: state[measured], R=R, residual=residual)
        except (ValueError, np.linalg.LinAlgError):
            # S is singular or not finite: such a measurement says nothing that can be used.
            kf.x, kf.P = x, P
            return False
        self._tidy()
        return True

    def process(self, stamp: float, indices, z, R, threshold: float = math.inf) -> bool:
        """Predict to the measurement's stamp (s) and correct with it; an older one only corrects.

        The first measurement ever is not fused: its values and its block of R are copied into state and covariance.
        Returns False if the measurement was rejected.
        """
        if not self.initialised:
            self._begin(indices, z, R)
            self.last_measurement_time = stamp
            return True
        dt = stamp - self.last_measurement_time
        if dt > 0.0:
            self.predict(valid_step(dt))
        taken = self.correct(indices, z, R, threshold)
        if dt >= 0.0:
            self.last_measurement_time = stamp
        return taken

    def predict_to(self, time: float):
        """Move the state to the time (s), which becomes the time of the state."""
        dt = valid_step(time - self.last_measurement_time)
        self.predict(dt)
        self.last_measurement_time += dt

    def _begin(self, indices, z, R):
        z = np.asarray(z, dtype=float)
        R = np.asarray(R, dtype=float)
        keep = np.flatnonzero(np.isfinite(z))
        measured = np.asarray(indices, dtype=int)[keep]
        self.kf.x[measured] = z[keep]
        self.kf.P[measured[:, None], measured] = R[keep[:, None], keep]
        self.initialised = True

    def _tidy(self):
        """Angles back to [-pi, pi], and the covariance symmetric to the last digit."""
        x = self.kf.x
        for i in range(ROLL, YAW + 1):
            if not -math.pi <= x[i] <= math.pi:
                x[i] = wrap(x[i])
        P = self.kf.P
        self.kf.P = 0.5 * (P + P.T)


def valid_step(dt: float) -> float:
    """dt, or 0.01 s where it can only come from a clock that was set."""
    return STEP_INSTEAD if dt > LONGEST_STEP else dt
