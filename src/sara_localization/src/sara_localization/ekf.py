"""The extended Kalman filter over the 15 variables of robot_localization (and biases behind them).

    predict:  x <- f(x, dt),  P <- F P F' + Q dt

Method: T. Moore, D. Stouch, 2014 (motion_model.py); filterpy's ExtendedKalmanFilter is the oracle of its tests.
"""
from __future__ import annotations

from . import kernel
from .estimator import STEP_INSTEAD, Estimator, valid_step

__all__ = ['Ekf', 'STEP_INSTEAD', 'valid_step']


class Ekf(Estimator):
    """See Estimator."""

    def _propagate(self, dt, time):
        Q, before = self._noise(self.x), self.x
        if self.control is not None:
            # As in robot_localization, F is that of the state before the command.
            before = self.x.copy()
            self.control.apply(self.x, time, dt)
        self._keep_positive(kernel.predict(self.x, self.P, Q, dt, before))
