"""Who misleads about turning: the sources of yaw of one drive compared with each other, window by window.

Every source (an IMU's heading, its gyro, the wheels, a pose) gives a yaw over time; over windows of ten seconds each
says how far the robot turned. Two that agree and a third that does not: the third misleads. The median over the windows
decides, so that a few seconds of slip accuse nobody. A constant error of a gyro shows at standstill, where the wheels
say so.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

WINDOW = 10.0
FEWEST_WINDOWS = 3
LONGEST_DRIVE = 1e6  # s; beyond that it is no drive but a clock that was set
# A source is accused when it is this many times farther from all others than the best two are from each other, and
# at least SMALLEST off in a window.
RATIO = 2.5
SMALLEST = np.radians(1.0)
SLOWEST_TURN = np.radians(20.0)
STILL_SPEED, STILL_RATE = 2e-3, 2e-3
STILL_MARGIN, STILL_LENGTH = 0.5, 1.5


@dataclass(frozen=True)
class Source:
    """Yaw over time of one source: `what` for the user ("imu0's gyro"); t, yaw: (n,) s and rad, not wrapped."""

    what: str
    t: np.ndarray
    yaw: np.ndarray


@dataclass(frozen=True)
class Comparison:
    """median[a, b]: rad per window by which two sources disagree; scale[a, b]: how far a turns for 1 rad of b."""

    windows: int
    median: dict[tuple[str, str], float]
    scale: dict[tuple[str, str], float]

    def between(self, a: str, b: str) -> float:
        return self.median[(a, b)] if (a, b) in self.median else self.median[(b, a)]


def integrated(t: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Yaw (n,) from rates (n,) at times t, by trapezoids."""
    t, rate = np.asarray(t, dtype=float), np.asarray(rate, dtype=float)
    return np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))))


def compare(sources: list[Source], window: float = WINDOW) -> Comparison | None:
    """How far the sources disagree, over the time that all of them cover; None where that is too short or none
    turns.
    """
    if len(sources) < 2:
        return None
    begin, end = max(s.t[0] for s in sources), min(s.t[-1] for s in sources)
    if not FEWEST_WINDOWS * window < end - begin < LONGEST_DRIVE:
        return None
    edges = np.arange(begin, end, window)
    turned = {s.what: np.diff(np.interp(edges, s.t, s.yaw)) for s in sources}
    if max(np.abs(steps).sum() for steps in turned.values()) < SLOWEST_TURN:
        return None
    median, scale = {}, {}
    for a, b in itertools.combinations(turned, 2):
        median[a, b] = float(np.median(np.abs(turned[a] - turned[b])))
        for one, other in ((a, b), (b, a)):
            square = float(turned[other] @ turned[other])
            scale[one, other] = float(turned[one] @ turned[other]) / square if square > 0.0 else 0.0
    return Comparison(len(edges) - 1, median, scale)


def misleading(comparison: Comparison | None) -> list[str]:
    """The sources that stand against all others while two of the others agree; nobody with fewer than three."""
    if comparison is None or len(comparison.median) < 3:
        return []
    names = list(dict.fromkeys(name for pair in comparison.median for name in pair))
    best = min(comparison.median, key=comparison.median.get)
    agreed = comparison.median[best]
    accused = []
    for name in names:
        nearest = min(comparison.between(name, other) for other in names if other != name)
        if name not in best and nearest > SMALLEST and nearest > RATIO * agreed:
            accused.append(name)
    return accused


def at_rest(t: np.ndarray, wheels_t: np.ndarray, speed: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """(n,) bool: at which of the times t (s) the wheels have stood for a while and go on standing.

    wheels_t (m,) rising, speed (m,) m/s, rate (m,) rad/s: what the wheels say. Where they say nothing they may move.
    """
    t, wheels_t = np.asarray(t, dtype=float), np.asarray(wheels_t, dtype=float)
    if len(wheels_t) < 2:
        return np.zeros(len(t), dtype=bool)
    silent = np.diff(wheels_t) > STILL_MARGIN
    turning = (np.abs(speed) > STILL_SPEED) | (np.abs(rate) > STILL_RATE)
    turning[:-1] |= silent
    turning[1:] |= silent
    following = np.clip(np.searchsorted(wheels_t, t), 1, len(wheels_t) - 1)
    inside = (t >= wheels_t[0]) & (t <= wheels_t[-1]) & ~silent[following - 1]
    moving = wheels_t[turning]
    if not len(moving):
        return inside
    after = np.searchsorted(moving, t)
    since = t - np.where(after > 0, moving[np.maximum(after - 1, 0)], -np.inf)
    until = np.where(after < len(moving), moving[np.minimum(after, len(moving) - 1)], np.inf) - t
    return inside & (since > STILL_MARGIN) & (until > STILL_MARGIN) & (since + until > STILL_LENGTH)


def standstill_bias(t: np.ndarray, rates: np.ndarray, still: np.ndarray) -> tuple[float, float] | None:
    """(mean, standard error) of a gyro's rates (n,) where `still` (n,) bool; None with too few samples."""
    values = np.asarray(rates, dtype=float)[still]
    if len(values) < 20:
        return None
    return float(values.mean()), float(values.std() / np.sqrt(len(values)))
