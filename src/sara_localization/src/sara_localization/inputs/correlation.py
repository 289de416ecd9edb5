"""Measurements whose errors persist from one to the next: how much less each of them says than its variance claims.

A GPS receiver's error wanders over a minute, a compass's with the way it faces. Taken as independent, ten fixes a
second apart would count as ten. With errors of the correlation a = exp(-dt / T) between neighbours (first-order
Gauss-Markov) n measurements of a constant say together what

    1 + (n - 1) (1 - a) / (1 + a)

independent ones would (the best linear unbiased estimate; Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with
Applications to Tracking and Navigation", 2001, sec. 8.2 on coloured measurement noise, has the way by a further state
that this approximates). So the first counts in full, and each further one has its variance times (1 + a) / (1 - a).
The approximation is good where the state drifts little within T.
"""

from __future__ import annotations

import math

LARGEST = 1e6
"""Of the factor: for measurements of the same time."""


class Correlation:
    """Of one source. correlation_time: T, s."""

    def __init__(self, correlation_time: float):
        self._time = correlation_time
        self._last: float | None = None

    def inflation(self, stamp: float) -> float:
        """By what the variance of the measurement at a time (s) is multiplied, given those that came before."""
        before, self._last = self._last, stamp if self._last is None else max(stamp, self._last)
        if before is None:
            return 1.0
        half = 0.5 * abs(stamp - before) / self._time  # (1 + a) / (1 - a) = 1 / tanh(dt / 2 T)
        return min(1.0 / math.tanh(half), LARGEST) if half > 0.5 / LARGEST else LARGEST

    def forget(self) -> None:
        """The state no longer rests on what came before: the next measurement counts in full."""
        self._last = None
