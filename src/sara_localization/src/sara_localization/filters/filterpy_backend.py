"""The same two filters by filterpy: `backend: filterpy`. The form to compare with the textbook, and with the compiled
one.

filterpy (R. Labbe, "Kalman and Bayesian Filters in Python") does the algebra of prediction and correction. What is not
the textbook's is Estimator's: time, the first measurement, Q per second, the gate, control, the repair of a covariance.
filterpy is imported with this module only; it brings scipy along.
"""

from __future__ import annotations

import math

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

from sara_localization.filters import covariance, kernel, motion_model
from sara_localization.filters.estimator import Estimator, observation
from sara_localization.filters.motion_model import advance, linearise
from sara_localization.filters.residual import Measured
from sara_localization.filters.sigma_points import UNSURE_ANGLE


class _Filterpy(Estimator):
    """What both share: the correction, with filterpy's filter in `_book`, whose x and P are set before each step."""

    def take(self, m: Measured) -> bool:
        """As `correct`."""
        keep = np.flatnonzero(np.isfinite(m.z) & np.isfinite(m.R.diagonal()))
        if not len(keep):
            return False
        z, R = m.z[keep], np.where(np.isfinite(m.R), m.R, 0.0)[keep[:, None], keep]
        R = kernel.floored(z, R)[1]
        R = 0.5 * (R + R.T)
        m = Measured(m.indices[keep], m.extra[keep], z, R, m.gate)
        H, y = observation(m, self.n), kernel.innovation(self.x, m)
        try:
            nis = float(y @ np.linalg.solve(H @ self.P @ H.T + R, y))
        except np.linalg.LinAlgError:
            return False
        self.nis = nis
        if not nis < m.gate * m.gate:
            return False
        # A measured angle is moved by whole turns to lie beside the state's: no residual has to be wrapped.
        if not self._update(H @ self.x + y, H, R):
            return False
        self._take_over()
        return True

    def _update(self, z, H, R) -> bool:
        """Let filterpy correct by z (k,), H (k, n), R (k, k); returns whether it could."""
        raise NotImplementedError

    def _take_over(self):
        """Take x and P from filterpy's filter."""
        self.x, self.P = self._book.x.copy(), 0.5 * (self._book.P + self._book.P.T)
        kernel.wrap_angles(self.x)
        self._keep_positive(covariance.bound(self.P))


class _BookEkf(ExtendedKalmanFilter):
    """filterpy's filter with a non-linear model of motion: x of `moved`, and F."""

    def predict_x(self, u=0):
        """x at the end of the step, instead of F x."""
        self.x = self.moved


class FilterpyEkf(_Filterpy):
    """Ekf by filterpy's ExtendedKalmanFilter; see Estimator."""

    def __init__(self, *args, **kwargs):
        motion_model.warm()
        super().__init__(*args, **kwargs)
        self._book = _BookEkf(self.n, self.n)

    def _propagate(self, dt, time):
        book, Q, before = self._book, self._noise(self.x), self.x.copy()
        if self.control is not None:
            self.control.apply(self.x, time, dt)
        book.F = np.eye(self.n)
        linearise(before, dt, book.F)
        advance(self.x, dt)
        book.moved, book.P, book.Q = self.x, self.P, Q * dt
        book.predict()
        self._take_over()

    def _update(self, z, H, R):
        self._book.x, self._book.P = self.x, self.P
        self._book.update(z, lambda _: H, lambda x: H @ x, R)
        return True


def _last_to_first(P):
    """The square root of P from its last variable to the first, as sigma_points.unscented_predict takes it."""
    return np.linalg.cholesky(P[::-1, ::-1]).T[:, ::-1]


def _moved(point, dt):
    point = point.copy()
    advance(point, dt)
    return point


class FilterpyUkf(_Filterpy):
    """Ukf by filterpy's UnscentedKalmanFilter; see Ukf.

    Its weights are of the order of 1/alpha2: with the default alpha of 0.001 they cost it six digits of sixteen.
    """

    def __init__(self, *args, alpha: float = 0.001, beta: float = 2.0, kappa: float = 0.0, **kwargs):
        motion_model.warm()
        super().__init__(*args, **kwargs)
        sure = MerweScaledSigmaPoints(self.n, float(alpha), float(beta), float(kappa))
        wide = max(sure.alpha, math.sqrt(3.0 / (self.n + sure.kappa)))
        unsure = MerweScaledSigmaPoints(self.n, wide, float(beta), float(kappa), sqrt_method=_last_to_first)
        self._sure, self._unsure = (
            UnscentedKalmanFilter(self.n, self.n, 0.0, None, _moved, points) for points in (sure, unsure)
        )
        self._book = self._sure

    def _propagate(self, dt, time):
        if self.control is not None:
            self.control.apply(self.x, time, dt)
        self._book = self._unsure if self.P.diagonal()[3:6].max() > UNSURE_ANGLE else self._sure
        self._book.Q = self._noise(_moved(self.x, dt)) * dt
        self._with_points(lambda: self._book.predict(dt))
        self._take_over()

    def _update(self, z, H, R):
        def update():
            self._book.sigmas_f = self._book.points_fn.sigma_points(self.x, self.P)
            self._book.update(z, R, hx=lambda x: H @ x)

        self._book = self._sure
        return self._with_points(update)

    def _with_points(self, step) -> bool:
        """Do a step that needs the square root of P, which is repaired where it has none. Returns whether it was
        done.
        """
        for _ in range(2):
            self._book.x, self._book.P = self.x, self.P
            try:
                step()
            except (np.linalg.LinAlgError, ValueError):
                if self._book.P is self.P:
                    self.repairs += 1
                    covariance.repair(self.P)
                    continue
                # The step was done; what has no square root is the P that came out, and that is for _take_over.
            return True
        return False
