"""The unscented Kalman filter over the same state, motion model and measurements.

Merwe's scaled sigma points of x and P go through the motion model, which leaves their angles unwrapped, so that the
differences to the central point are true ones however unsure an angle is; Q dt is added to their covariance. Method:
R. van der Merwe, "Sigma-Point Kalman Filters", 2004; filterpy's UnscentedKalmanFilter is the oracle of its tests.
"""
from __future__ import annotations

import numpy as np

from . import kernel
from .estimator import Estimator


class Ukf(Estimator):
    """See Estimator; alpha, beta, kappa: the spread and weights of the sigma points."""

    def __init__(self, *args, alpha: float = 0.001, beta: float = 2.0, kappa: float = 0.0, **kwargs):
        self.alpha, self.beta, self.kappa = float(alpha), float(beta), float(kappa)
        super().__init__(*args, **kwargs)

    def _propagate(self, dt, time):
        if self.control is not None:
            self.control.apply(self.x, time, dt)
        if not kernel.unscented_predict(self.x, self.P, dt, self.alpha, self.beta, self.kappa):
            self.repairs += 1
            kernel.repair(self.P)
            kernel.unscented_predict(self.x, self.P, dt, self.alpha, self.beta, self.kappa)
        self.P += self._noise(self.x) * dt
        self._keep_positive(kernel.positive_definite(self.P))
