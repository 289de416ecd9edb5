"""How something moved, from its poses over time: speed, turn rate, acceleration and jerk along and across the heading.

Derivatives are those of cubics fitted to a moving window (Savitzky and Golay, Analytical Chemistry 36, 1964): WINDOW_S
for acceleration and jerk, RATE_WINDOW_S for speed and turn rate. A window this long takes the grain off poses that come
every 10 or 20 ms; a step of jerk shorter than it is blurred. Along and across are meant of the heading, which is the
tangent of a chair that does not slip sideways, and known at rest too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from sara_common.repeatable import cos_sin
from sara_nav.planners.planning import distances_along

WINDOW_S, RATE_WINDOW_S = 0.5, 0.2  # s
ORDER = 3
MOVING_V, MOVING_W = 0.02, 0.03  # m/s, rad/s: faster than either is moving


@dataclass(frozen=True)
class Motion:
    """`t`: (n,) s, evenly spaced by `dt`. `pose`: (n, 3) x, y (m), yaw (rad, unwrapped). `v`: m/s along the heading,
    `w`: rad/s.
    """

    t: np.ndarray
    dt: float
    pose: np.ndarray
    v: np.ndarray
    w: np.ndarray

    @classmethod
    def of(cls, t: np.ndarray, pose: np.ndarray) -> Motion:
        """The motion of poses (n, 3) at times (n,); spaced unevenly, they are read off straight lines between them."""
        dt = float(np.median(np.diff(t)))
        pose = np.column_stack([pose[:, :2], np.unwrap(pose[:, 2])])
        if np.abs(np.diff(t) - dt).max() > 0.01 * dt:
            even = np.arange(t[0], t[-1] + 1e-9, dt)
            pose = np.column_stack([np.interp(even, t, column) for column in pose.T])
            t = even
        c, s = cos_sin(pose[:, 2])
        x, y, w = (_derivative(column, dt, 1, RATE_WINDOW_S) for column in pose.T)
        return cls(t, dt, pose, c * x + s * y, w)

    @property
    def yaw(self) -> np.ndarray:
        """(n,) rad, unwrapped."""
        return self.pose[:, 2]

    @property
    def moving(self) -> np.ndarray:
        """(n,) bool."""
        return (np.abs(self.v) > MOVING_V) | (np.abs(self.w) > MOVING_W)

    @cached_property
    def driven(self) -> np.ndarray:
        """(n,) m, way driven until each time."""
        return distances_along(self.pose)

    def way(self, chosen: np.ndarray) -> float:
        """m driven in the steps whose both ends are chosen (n bool)."""
        return float(np.diff(self.driven)[chosen[1:] & chosen[:-1]].sum())

    @cached_property
    def _second(self):
        return self._along_and_across(2)

    @cached_property
    def _third(self):
        return self._along_and_across(3)

    def _along_and_across(self, order):
        x, y = (_derivative(self.pose[:, k], self.dt, order, WINDOW_S) for k in (0, 1))
        c, s = cos_sin(self.yaw)
        return c * x + s * y, c * y - s * x

    @property
    def acceleration_tangential(self) -> np.ndarray:
        """(n,) m/s2."""
        return self._second[0]

    @property
    def acceleration_normal(self) -> np.ndarray:
        """(n,) m/s2, to the left; v w on a circle."""
        return self._second[1]

    @property
    def jerk_tangential(self) -> np.ndarray:
        """(n,) m/s3: the derivative of the acceleration vector, along the heading (-v w^2 on a circle)."""
        return self._third[0]

    @property
    def jerk_normal(self) -> np.ndarray:
        """(n,) m/s3, to the left."""
        return self._third[1]


def _derivative(values, dt, order, window):
    """The derivative of that order; zeros where there are fewer values than a cubic and a bit need."""
    size = max(2 * round(0.5 * window / dt) + 1, ORDER + 2)
    if len(values) < size:
        size = len(values) - 1 + len(values) % 2
    if size <= ORDER:
        return np.gradient(values, dt) if order == 1 and len(values) > 1 else np.zeros(len(values))
    fit, half = _fit(size), size // 2
    middle = np.convolve(values, math.factorial(order) * fit[order][::-1], 'valid')
    # The first and the last half window are read off the first and the last cubic.
    ends = [
        np.polynomial.polynomial.polyval(at, np.polynomial.polynomial.polyder(fit @ piece, order))
        for at, piece in ((np.arange(-half, 0), values[:size]), (np.arange(1, half + 1), values[-size:]))
    ]
    return np.concatenate([ends[0], middle, ends[1]]) / dt**order


@cache
def _fit(size):
    """(ORDER + 1, size): a window's values to the coefficients of the cubic that fits them best, its middle at 0."""
    return np.linalg.pinv(np.vander(np.arange(size) - size // 2, ORDER + 1, increasing=True).astype(float))


def reversals(w: np.ndarray, threshold: float) -> int:
    """How often a rate (n,) that exceeds the threshold on one side next exceeds it on the other."""
    side = np.sign(w[np.abs(w) > threshold])
    return int(np.count_nonzero(np.diff(side)))
