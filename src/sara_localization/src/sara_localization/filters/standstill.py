"""Parked or not, and what a parked robot tells about its sensors: the bias of the gyro and the drift of an integrated
yaw.

A robot counts as parked while, over the last `time` seconds, the wheels have reported no motion AND the deviation of
every gyro was below `gyro_deviation` (or twice what it claims itself), its mean within `gyro_limit` of the bias known
so far, and the deviation of the accelerometer below `acceleration_deviation`: a dead encoder alone parks nobody, and a
robot that is turned by hand with its wheels still is not parked. What a sample says is used only when it leaves the
window, when it is known that the robot stood still for as long as the window after it: the first moments of a motion
never count as bias.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from sara_common.planar import wrap_exact

# A bias is the mean of this many seconds at the most; later ones are averaged with exponential forgetting.
MEMORY = 60.0
# A yaw that jumps by more than this (rad) beyond what the gyro turned has been set, not drifted.
YAW_JUMP = 0.05
# However noisy a gyro says that it is: with more than this deviation (rad/s) nothing is parked.
NOISIEST_GYRO = 0.05
# Before a bias is known its size is not known either (rad/s): the data sheets of cheap gyros allow more than this.
UNKNOWN_BIAS = 0.1


@dataclass(frozen=True)
class StandstillConfig:
    """update: hold the robot while parked. time: s; velocities of the wheels: m/s, rad/s; gyro: rad/s; accelerometer:
    m/s2;
    variance: of the zero velocities that are taken in while parked, (m/s)2 and (rad/s)2.
    """

    update: bool = False
    time: float = 1.0
    linear_velocity: float = 0.01
    angular_velocity: float = 0.02
    gyro_deviation: float = 0.01
    gyro_limit: float = 0.01
    acceleration_deviation: float = 0.5
    variance: float = 1e-8


@dataclass
class _Sample:
    stamp: float
    rates: np.ndarray
    acceleration: np.ndarray | None
    yaw: float | None
    sigma: float


class Gyro:
    """One IMU: the window of its last samples, its bias (3,) rad/s in the sensor's frame, how fast its yaw drifts
    (rad/s).

    follow_drift: the yaw goes on drifting while the robot moves (it is integrated from the biased rate).
    """

    def __init__(self, config: StandstillConfig, follow_drift: bool = False):
        self.config, self.follow_drift = config, follow_drift
        self.bias, self.seconds, self.yaw_drift = np.zeros(3), 0.0, 0.0
        self._window, self._last_out = deque(), None
        self._offset, self._offset_stamp = 0.0, None

    def yaw_offset(self, stamp: float) -> float:
        """What the yaw of the IMU has drifted by the time `stamp` (rad)."""
        if not self.follow_drift or self._offset_stamp is None:
            return self._offset
        return self._offset + self.yaw_drift * (stamp - self._offset_stamp)

    def forget_yaw(self) -> None:
        """The robot's heading was set: what had drifted is of no more use."""
        self._offset, self._offset_stamp, self._last_out = 0.0, None, None
        self._window.clear()

    def add(
        self, stamp: float, rates: np.ndarray, acceleration: np.ndarray | None, yaw: float | None, sigma: float
    ) -> list:
        """The rates (3,), acceleration (3,) or None, yaw or None of a message, and the deviation that it claims for its
        rates.

        Returns those samples that left the window.
        """
        window, left = self._window, []
        if window and stamp == window[-1].stamp:  # a clock that stands: the window would never end
            return left
        if window and not 0.0 <= stamp - window[-1].stamp <= self.config.time:
            window.clear()
            self._last_out = None
        if window and yaw is not None and window[-1].yaw is not None:
            turned = (rates[2] - self.bias[2]) * (stamp - window[-1].stamp)
            if abs(wrap_exact(yaw - window[-1].yaw - turned)) > YAW_JUMP:
                self.forget_yaw()
        window.append(_Sample(stamp, rates, acceleration, yaw, sigma))
        while stamp - window[0].stamp > self.config.time:
            left.append(window.popleft())
        return left

    def quiet(self, now: float) -> bool:
        """The whole window, which reaches up to now, was without motion."""
        c, window = self.config, self._window
        if len(window) < 3 or window[-1].stamp - window[0].stamp < 0.6 * c.time or now - window[-1].stamp > c.time:
            return False
        rates = np.array([s.rates for s in window])
        mean = rates.mean(axis=0)
        limit = c.gyro_limit if self.seconds >= c.time else UNKNOWN_BIAS
        noise = min(NOISIEST_GYRO, max(c.gyro_deviation, 2.0 * window[-1].sigma))
        if rates.std(axis=0).max() > noise or np.abs(mean - self.bias).max() > limit:
            return False
        accelerations = [s.acceleration for s in window if s.acceleration is not None]
        if len(accelerations) < 3:
            return True
        return float(np.std(accelerations, axis=0).max()) <= c.acceleration_deviation

    def learn(self, sample: _Sample) -> None:
        """A sample from which on the robot is known to have been parked for a window's time."""
        before, self._last_out = self._last_out, sample
        if before is None or sample.stamp <= before.stamp:
            self._offset, self._offset_stamp = self.yaw_offset(sample.stamp), sample.stamp
            return
        dt = sample.stamp - before.stamp
        self.seconds = min(MEMORY, self.seconds + dt)
        weight = min(1.0, dt / self.seconds)
        self.bias = self.bias + (sample.rates - self.bias) * weight
        if sample.yaw is not None and before.yaw is not None:
            step = wrap_exact(sample.yaw - before.yaw)
            self.yaw_drift += (step / dt - self.yaw_drift) * weight
            self._offset, self._offset_stamp = wrap_exact(self._offset + step), sample.stamp

    def moved(self) -> None:
        """The robot is not parked: the next parking starts anew."""
        self._last_out = None


class Standstill:
    """The detector over all inputs; it is fed by the preprocessor in the order of arrival."""

    def __init__(self, config: StandstillConfig, gyros: dict[str, bool]):
        """gyros: the names of the IMUs, and whether the drift of their yaw is to be followed in motion."""
        self.config = config
        self.gyros: dict[str, Gyro] = {name: Gyro(config, follow) for name, follow in gyros.items()}
        self.forget()

    def forget(self) -> None:
        """The clock has begun anew: what was heard is past; what is known of biases stays."""
        self._wheels_seen = self._wheels_moved = -math.inf
        self.parked = False
        self.forget_yaw()

    def forget_yaw(self) -> None:
        """After set_pose."""
        for gyro in self.gyros.values():
            gyro.forget_yaw()

    def wheels(self, stamp: float, linear: np.ndarray, angular: np.ndarray) -> None:
        """Velocities of the wheels: linear (3,) m/s, angular (3,) rad/s; what is not a number counts as motion."""
        c = self.config
        self._wheels_seen = max(self._wheels_seen, stamp)
        still = all(abs(v) <= c.linear_velocity for v in linear) and all(abs(w) <= c.angular_velocity for w in angular)
        if not still:
            self._wheels_moved = max(self._wheels_moved, stamp)
            self._unpark()

    def gyro(
        self,
        name: str,
        stamp: float,
        rates: np.ndarray,
        acceleration: np.ndarray | None = None,
        yaw: float | None = None,
        sigma: float = 0.0,
    ) -> Gyro:
        """A message of the IMU `name`; what is not finite is given as None (rates: the message is not used)."""
        gyro, c = self.gyros[name], self.config
        if rates is None:
            return gyro
        left = gyro.add(stamp, rates, acceleration, yaw, sigma)
        wheels_still = stamp - self._wheels_seen <= c.time and stamp - self._wheels_moved > c.time
        self.parked = wheels_still and all(each.quiet(stamp) for each in self.gyros.values())
        if not self.parked:
            self._unpark()
        else:
            for sample in left:
                gyro.learn(sample)
        return gyro

    def _unpark(self):
        self.parked = False
        for gyro in self.gyros.values():
            gyro.moved()
