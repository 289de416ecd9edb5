"""A compass held against the track of a GPS: how far the way by heading and wheels is turned from the way by fixes.

The robot's own drive calibrates the magnetometer, if it turned all round: by the ellipse of its fields. Then heading
and speed give a way; a window of it is laid on the window's fixes by a turn and a shift (least squares, the closed form
of Umeyama 1991 without scale), and the turn is the heading's error there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from canserial.calibration.iron import fitted_ellipse

WINDOW, STEP = 10.0, 1.0
"""s."""
FEWEST, SHORTEST = 8, 3.0
"""Fixes in a window, and m that it must be long."""


class Agreement(NamedTuple):
    """windows: (n, 2) middle s, rad that the track is turned from the heading, left positive. whole: rad, of the whole
    drive. residual: m r.m.s. of the whole drive's fixes. ratio: of the ellipse's axes. rate: rad/s, the mean.
    """

    windows: np.ndarray
    whole: float
    residual: float
    ratio: float
    rate: float

    def interval(self, share: float) -> tuple[float, float]:
        """rad between which this share of the windows' turns is, about the whole drive's."""
        away = np.angle(np.exp(1j * (self.windows[:, 1] - self.whole)))
        low, high = np.quantile(away, (0.5 - 0.5 * share, 0.5 + 0.5 * share))
        return float(self.whole + low), float(self.whole + high)


def headings(fields: np.ndarray) -> tuple[np.ndarray, float]:
    """Yaw (n,) rad, 0 facing magnetic east, of level fields (n, 2) along the robot's axes of a drive all round; the
    ellipse's ratio. Raises IronError.
    """
    ellipse = fitted_ellipse(fields)
    x, y = ((fields - ellipse.centre) @ ellipse.matrix.T).T
    return np.unwrap(0.5 * math.pi - np.arctan2(y, x)), ellipse.ratio


def reckoned(yaws: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """(n, 3) s, x, y, m: the way by headings (m, 2) s, rad and forward speeds (n, 2) s, m/s."""
    times, speed = speeds.T
    yaw = np.interp(times, *yaws.T)
    step = np.diff(times, prepend=times[0]) * speed
    return np.column_stack((times, np.cumsum(step * np.cos(yaw)), np.cumsum(step * np.sin(yaw))))


def turned(way: np.ndarray, fixes: np.ndarray) -> tuple[float, float]:
    """(rad, m r.m.s.) by which a way (n, 2) is to be turned about the middle to lie best on fixes (n, 2)."""
    a, b = (points - points.mean(axis=0) for points in (way, fixes))
    angle = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    c, s = math.cos(angle), math.sin(angle)
    left = b - a @ np.array(((c, s), (-s, c)))
    return angle, float(np.sqrt((left**2).sum(axis=1).mean()))


def agreement(fields: np.ndarray, speeds: np.ndarray, fixes: np.ndarray) -> Agreement:
    """fields: (n, 3) s, x, y along the robot's axes; speeds: (m, 2) s, m/s; fixes: (k, 3) s, east, north, m; by time.
    Raises IronError, ValueError with a sentence for a drive too short.
    """
    yaw, ratio = headings(fields[:, 1:])
    way = reckoned(np.column_stack((fields[:, 0], yaw)), speeds)
    inside = (fixes[:, 0] >= way[0, 0]) & (fixes[:, 0] <= way[-1, 0])
    fixes = fixes[inside]
    if len(fixes) < FEWEST:
        raise ValueError(f'{len(fixes)} fixes lie within the time of fields and speeds, {FEWEST} are needed')
    times = fixes[:, 0]
    places = np.column_stack([np.interp(times, way[:, 0], way[:, axis]) for axis in (1, 2)])
    whole, residual = turned(places, fixes[:, 1:])
    windows = []
    for start in np.arange(times[0], times[-1] - WINDOW + 1e-6, STEP):
        of = (times >= start) & (times <= start + WINDOW)
        part = places[of]
        if of.sum() >= FEWEST and np.hypot(*np.diff(part, axis=0).T).sum() >= SHORTEST:
            windows.append((start + 0.5 * WINDOW, turned(part, fixes[of, 1:])[0]))
    if not windows:
        raise ValueError(f'no window of {WINDOW:g} s holds {FEWEST} fixes and {SHORTEST:g} m of way')
    rate = (yaw[-1] - yaw[0]) / (fields[-1, 0] - fields[0, 0])
    return Agreement(np.array(windows), whole, residual, ratio, float(rate))
