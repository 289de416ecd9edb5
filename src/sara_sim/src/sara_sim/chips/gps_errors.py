"""How a GPS receiver errs: slowly (Gauss-Markov), by multipath, and by having no fix at all.

The slow error is e' = a e + s sqrt(1 - a2) w with a = exp(-dt / T), w white: its standard deviation is s at any time,
its correlation exp(-lag / T) (A. Gelb, "Applied Optimal Estimation", 1974, sec. 2.2). T = 60 s is what PX4's simulated
receivers have, and where the measured autocorrelation of a Garmin 12XL bends (D. L. Wilson's GPS accuracy pages).

The velocity is measured by the carriers' Doppler shifts, not by differences of places, and errs on its own: by 0.05 m/s
half of the time by the data sheet of a NEO-M8 (0.1 m/s by that of a NEO-6). With a standard deviation of 0.05 m/s along
each axis and a correlation of 1 s a mean over 10 s is 0.02 m/s off; a SiRF III's was within 0.05 m/s in 99.9 % (T.
Chalko, "Estimating accuracy of GPS Doppler speed measurement using SDOP", 2009). A reflection is Doppler-shifted by up
to twice the receiver's own speed, so that multipath throws velocities, too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_sim.chips.gps_config import GpsConfig
from sara_sim.world import luck


class GpsError(NamedTuple):
    """east, north, up: m; has_fix; jumped: whether it is multipath's, of which the receiver knows nothing; velocity:
    east, north, m/s.
    """

    east: float
    north: float
    up: float
    has_fix: bool
    jumped: bool
    velocity: tuple[float, float]


class _GaussMarkov:
    """n values of this deviation and correlation time (s; 0: white), `rate` a second."""

    def __init__(self, sigma: float, time: float, rate: float, n: int, random: np.random.Generator):
        self._sigma, self._n, self._random = sigma, n, random
        self._kept = math.exp(-1.0 / (rate * time)) if time else 0.0
        self._last: np.ndarray | None = None

    def step(self) -> np.ndarray:
        """(n,) The next values."""
        fresh = self._sigma * self._random.standard_normal(self._n)
        if self._last is None:
            self._last = fresh
        else:
            self._last = self._kept * self._last + math.sqrt(1.0 - self._kept**2) * fresh
        return self._last.copy()


def _direction(random):
    way = random.uniform(-math.pi, math.pi)
    return np.array((math.cos(way), math.sin(way)))


class GpsErrors:
    """The errors of one receiver, fix by fix. Places, velocities and multipath have a stream of chance each."""

    def __init__(self, config: GpsConfig, seed: int):
        self.config = config
        self._luck, self._speeds = luck.stream(seed, 'gps_multipath'), luck.stream(seed, 'gps_speed')
        self._place = _GaussMarkov(config.sigma, config.correlation_time, config.rate, 3, luck.stream(seed, 'gps'))
        self._velocity = _GaussMarkov(config.speed_sigma, config.speed_correlation_time, config.rate, 2, self._speeds)
        self._offset = self._speed_offset = np.zeros(2)
        self._jump_from = self._next(config.jump_interval)
        self._jump_until = -math.inf
        self._number = 0

    def _next(self, mean):
        return self._luck.exponential(mean) if mean else math.inf

    def step(self) -> GpsError:
        """The error of the next fix."""
        config, time = self.config, self._number / self.config.rate
        error, velocity = self._place.step(), self._velocity.step()
        self._number += 1
        if time >= self._jump_from:
            self._offset = config.jump * _direction(self._luck)
            self._speed_offset = config.jump_speed * _direction(self._speeds)
            self._jump_until = time + self._luck.exponential(config.jump_duration)
            self._jump_from = self._jump_until + self._next(config.jump_interval)
        jumped = time < self._jump_until
        if jumped:
            error[:2] += self._offset
            velocity += self._speed_offset
        east, north, up = error.tolist()
        return GpsError(east, north, 2.0 * up, not self._out(time), jumped, tuple(velocity.tolist()))

    def _out(self, time):
        """Whether an outage is going on."""
        interval, duration = self.config.outage_interval, self.config.outage_duration
        return bool(interval) and time % (interval + duration) >= interval
