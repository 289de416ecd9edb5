"""The extended Kalman filter over the 15 variables of robot_localization (and biases behind them).

    predict:  x <- f(x, dt),  P <- F P F' + Q dt

Method: T. Moore, D. Stouch, 2014 (motion_model.py); filterpy's ExtendedKalmanFilter is the oracle of its tests.
"""

from __future__ import annotations

from sara_localization.filters import kernel
from sara_localization.filters.estimator import Estimator


class Ekf(Estimator):
    """See Estimator."""

    def _propagate(self, dt, time):
        Q, before = self._noise(self.x), self.x
        if self.control is not None:
            # As in robot_localization, F is that of the state before the command.
            before = self.x.copy()
            self.control.apply(self.x, time, dt)
        self._keep_positive(kernel.predict(self.x, self.P, Q, dt, before))

    def _predict_and_correct(self, dt, stamp, m):
        """In one call of the compiled code, where nothing has to be looked at between."""
        if self.control is not None or self.dynamic_process_noise or not len(m.z):
            return super()._predict_and_correct(dt, stamp, m)
        result, nis, positive = kernel.predict_and_take(self.x, self.P, self.process_noise, dt, m)
        if result == kernel.PREDICTED_BADLY:
            self._keep_positive(False)
        if result in (kernel.PREDICTED_BADLY, kernel.NOT_FINITE, kernel.CORRELATED_BADLY):
            return self.take(m)  # the measurement is still to be taken
        self.nis = nis
        self._keep_positive(positive)
        return result == kernel.TAKEN
