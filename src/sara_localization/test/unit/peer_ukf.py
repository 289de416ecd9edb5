"""Our UKF with the defects of robot_localization's put in: that it then agrees shows that the two differ in nothing
else.

In: (1) a posterior that leaves R out, (2) angles averaged by weighted sine and cosine, with weights of either sign, (3)
in a correction the state's differences wrapped at the measurement's place instead of the state's, (4) a control input
without effect, (5) sigma points that lack the process noise in the first correction after a prediction, and stay as
they were after set_pose, before the first prediction and after a rejected measurement.
"""

import numpy as np

from sara_localization.filters.motion_model import advance
from sara_localization.filters.ukf import Ukf

TAU = 2.0 * np.pi


def _wrapped(a):
    return a - TAU * np.round(a / TAU)


class PeerUkf(Ukf):
    def __init__(self, *args, **kwargs):
        kwargs['control'] = None
        super().__init__(*args, **kwargs)
        self.keep_positive = False
        alpha, beta, kappa = self.spread
        scale = alpha**2 * (15 + kappa)
        self.scale = scale
        self.wm = np.full(31, 0.5 / scale)
        self.wm[0] = 1.0 - 15.0 / scale
        self.wc = self.wm.copy()
        self.wc[0] += 1.0 - alpha**2 + beta
        self.points, self.fresh = np.zeros((31, 15)), True

    def _draw(self):
        try:
            L = np.linalg.cholesky(self.scale * self.P)
        except np.linalg.LinAlgError:
            L = np.full((15, 15), np.nan)
        self.points = np.vstack([self.x, self.x + L.T, self.x - L.T])

    def _mean(self, values, angles):
        mean = self.wm @ values
        a = values[:, angles]
        mean[angles] = np.arctan2(self.wm @ np.sin(a), self.wm @ np.cos(a))
        return mean

    def _propagate(self, dt, time):
        self._draw()
        for point in self.points:
            advance(point, dt)
        self.x = self._mean(self.points, [3, 4, 5])
        D = self.points - self.x
        D[:, 3:6] = _wrapped(D[:, 3:6])
        self.P = D.T @ (self.wc[:, None] * D) + self._noise(self.x) * dt
        self.fresh = True

    def take(self, m):
        indices, z, R = m.indices, m.z, m.R
        keep = np.flatnonzero(np.isfinite(z))
        indices, z, R = indices[keep], z[keep], R[np.ix_(keep, keep)]
        np.fill_diagonal(R, np.maximum(np.abs(R.diagonal()), 1e-9))
        if not self.fresh:
            self._draw()
        angles = [j for j, i in enumerate(indices) if 3 <= i <= 5]
        Z = self.points[:, indices]
        expected = self._mean(Z, angles)
        DZ, DX = Z - expected, self.points - self.x
        for j in angles:
            DZ[:, j], DX[:, j] = _wrapped(DZ[:, j]), _wrapped(DX[:, j])
        Pzz, Pxz = DZ.T @ (self.wc[:, None] * DZ), DX.T @ (self.wc[:, None] * DZ)
        inverse = np.linalg.inv(Pzz + R)
        y = z - expected
        y[angles] = _wrapped(y[angles])
        self.nis = float(y @ inverse @ y)
        if self.nis >= min(m.gate, 1e150) ** 2:
            return False
        K = Pxz @ inverse
        self.x = self.x + K @ y
        self.P = self.P - K @ Pzz @ K.T
        self.x[3:6] = _wrapped(self.x[3:6])
        self.fresh = False
        return True
