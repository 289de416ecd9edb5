"""How a GPS receiver errs: slowly (Gauss-Markov), by multipath, and by having no fix at all.

The slow error is e' = a e + s sqrt(1 - a2) w with a = exp(-dt / T), w white: its standard deviation is s at any time,
its correlation exp(-lag / T) (A. Gelb, "Applied Optimal Estimation", 1974, sec. 2.2). T = 60 s is what PX4's simulated
receivers have, and where the measured autocorrelation of a Garmin 12XL bends (D. L. Wilson's GPS accuracy pages).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_sim.chips.gps_config import GpsConfig
from sara_sim.world import luck


class GpsError(NamedTuple):
    """east, north, up: m; has_fix; jumped: whether it is multipath's, of which the receiver knows nothing."""

    east: float
    north: float
    up: float
    has_fix: bool
    jumped: bool


class GpsErrors:
    """The errors of one receiver, fix by fix. The slow error, multipath and outages have a stream of chance each."""

    def __init__(self, config: GpsConfig, seed: int):
        self.config = config
        self._wander, self._luck = luck.stream(seed, 'gps'), luck.stream(seed, 'gps_multipath')
        self._error = config.sigma * self._wander.standard_normal(3)
        self._kept = math.exp(-1.0 / (config.rate * config.correlation_time))
        self._fresh = config.sigma * math.sqrt(1.0 - self._kept**2)
        self._offset = np.zeros(2)
        self._jump_from = self._next(config.jump_interval)
        self._jump_until = -math.inf
        self._number = 0

    def _next(self, mean):
        return self._luck.exponential(mean) if mean else math.inf

    def step(self) -> GpsError:
        """The error of the next fix."""
        config, time = self.config, self._number / self.config.rate
        if self._number:
            self._error = self._kept * self._error + self._fresh * self._wander.standard_normal(3)
        self._number += 1
        if time >= self._jump_from:
            way = self._luck.uniform(-math.pi, math.pi)
            self._offset = config.jump * np.array((math.cos(way), math.sin(way)))
            self._jump_until = time + self._luck.exponential(config.jump_duration)
            self._jump_from = self._jump_until + self._next(config.jump_interval)
        jumped = time < self._jump_until
        east, north = self._error[:2] + (self._offset if jumped else 0.0)
        return GpsError(float(east), float(north), 2.0 * float(self._error[2]), not self._out(time), jumped)

    def _out(self, time):
        """Whether an outage is going on."""
        interval, duration = self.config.outage_interval, self.config.outage_duration
        return bool(interval) and time % (interval + duration) >= interval
