"""The unscented Kalman filter over the same state, motion model and measurements.

Merwe's scaled sigma points of x and P go through the motion model, which leaves their angles unwrapped, so that the
differences to the central point are true ones however unsure an angle is; Q dt is added to their covariance. Method:
R. van der Merwe, "Sigma-Point Kalman Filters", 2004; filterpy's UnscentedKalmanFilter is the oracle of its tests.

Points close to the centre (alpha 0.001) see the curvature there and nothing of an angle that comes round: they shorten
a step by 1 - sigma2/2, which beyond sigma2 = 2 rad2 means backwards, ever faster. From there on the points are spread
to sqrt(3) sigma, as in the Gauss-Hermite rule of three points: the shortening is then 2/3 + cos(sqrt(3) sigma)/3, close
to the true exp(-sigma2/2) at first, and however unsure the angle is between 1/3 and 1.
"""

from __future__ import annotations

from sara_localization.filters import covariance
from sara_localization.filters.estimator import Estimator
from sara_localization.filters.sigma_points import Spread, unscented_step


class Ukf(Estimator):
    """See Estimator; alpha, beta, kappa: the spread and weights of the sigma points."""

    def __init__(self, *args, alpha: float = 0.001, beta: float = 2.0, kappa: float = 0.0, **kwargs):
        self.spread = Spread(float(alpha), float(beta), float(kappa))
        super().__init__(*args, **kwargs)

    def _propagate(self, dt, time):
        if self.control is not None:
            self.control.apply(self.x, time, dt)
        for _ in range(2):
            done, positive = unscented_step(
                self.x, self.P, self.process_noise, self.dynamic_process_noise, dt, self.spread
            )
            if done:
                break
            self.repairs += 1
            covariance.repair(self.P)
        self._keep_positive(positive)
