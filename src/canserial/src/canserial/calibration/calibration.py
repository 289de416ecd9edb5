"""The gyroscope's offset, measured at rest before anything is published (thesis 4.2.3.1: it cuts the drift by 75 %).

Rest is tested, not assumed: an excursion from the mean, a mean that wanders, or a wheel that turns starts the
measurement over. The excursion is judged on means of 0.2 s, whatever the period of the frames, so that one limit serves
the normal and the fast mode. With the sigmas of the thesis's table 4.5 (0.097 deg/s at most over 0.2 s) the limits of
0.8 and 0.12 deg/s lie 5.8 and
6.2 sigma off: fewer than one calibration in a million starts over for noise alone.
"""

from __future__ import annotations

BLOCK = 0.2  # s; the excursion from the mean is judged on means over this time
JITTER = 0.05  # s; a block may be so much shorter
ROUNDING = 5e-4  # s; stamps are sums of rounded periods
HALF = 10.0  # s; still_drift holds for halves of this length, shorter ones are noisier
MIN_FRAMES = 4  # fewer have no two halves
MAX_OFFSET = 20.0  # deg/s: the MPU6050's product specification promises no worse zero-rate output


class GyroCalibration:
    """Mean of the rates over `duration` s at rest.

    still_step, still_drift: deg/s, the largest excursion from the mean and the largest change of the mean that count as
    rest.
    max_gap: s without frames after which it is unknown whether it was at rest. persistent: start over when it was not;
    otherwise give up. add() returns True when it ended: `offset` then holds three rates in deg/s, or None if it was
    given up.
    `sigma`: standard deviations of the samples. `restarts` counts the starts over, `reason` says why the last one
    happened.
    """

    def __init__(
        self, duration: float, still_step: float, still_drift: float, max_gap: float = 1.0, persistent: bool = True
    ) -> None:
        self.duration = duration
        self.still_step = still_step
        self.still_drift = still_drift
        self.max_gap = max_gap
        self.persistent = persistent
        self.offset = None
        self.sigma = None
        self.frames = 0
        self.restarts = 0
        self.reason = ''
        self.gave_up = False
        self._clear()

    @property
    def done(self) -> bool:
        """Whether the offset is known."""
        return self.offset is not None

    @property
    def ended(self) -> bool:
        """Whether it takes no more samples."""
        return self.offset is not None or self.gave_up

    @property
    def elapsed(self) -> float:
        """Seconds of rest so far."""
        return self.duration if self.done else min(self.duration, self._last - self._first) if self._samples else 0.0

    def add(self, stamp: float, sample: tuple[float, float, float]) -> bool:
        """Take a sample (x, y, z) in deg/s of the time stamp (s); True once the measurement ended."""
        if self.ended:
            return True
        if self._samples:
            if stamp <= self._last and stamp > self._last - self.max_gap:
                return False
            if not 0.0 < stamp - self._last <= self.max_gap:
                self.start_over('IMU frames were missing')
                if self.gave_up:
                    return True
        if not self._samples:
            self._first = self._block_start = stamp
        self._last = stamp
        self._samples.append(tuple(sample))
        self.frames = len(self._samples)
        if stamp - self._block_start >= BLOCK - JITTER:
            self._end_block(stamp)
        if self._samples and stamp - self._first >= self.duration - ROUNDING and self.frames >= MIN_FRAMES:
            self._finish()
        return self.ended

    def start_over(self, reason: str) -> None:
        """Forget the samples of an unfinished measurement (or give it up, if it is not persistent)."""
        if self.ended or (not self._samples and self.persistent):
            return
        self.reason = reason
        self.gave_up = not self.persistent
        self.restarts += self.persistent
        self._clear()

    def _clear(self):
        self._samples, self._taken = [], 0
        self._sums = [0.0, 0.0, 0.0]
        self._first = self._last = self._block_start = 0.0

    def _end_block(self, stamp):
        block = self._samples[self._taken :]
        if self._taken and any(
            abs(value - total / self._taken) > self.still_step for value, total in zip(_mean(block), self._sums)
        ):
            self.start_over('the gyroscope moved')
            return
        self._sums = [total + sum(axis) for total, axis in zip(self._sums, zip(*block))]
        self._taken = len(self._samples)
        self._block_start = stamp

    def _finish(self):
        half = len(self._samples) // 2
        first, second = _mean(self._samples[:half]), _mean(self._samples[half:])
        mean = _mean(self._samples)
        drift_limit = self.still_drift * max(1.0, (2.0 * HALF / self.duration) ** 0.5)
        if any(abs(a - b) > drift_limit for a, b in zip(first, second)):
            self.start_over('the mean of the gyroscope changed')
        elif any(abs(value) > MAX_OFFSET for value in mean):
            self.start_over('the chair turns or the gyroscope is faulty')
        else:
            self.offset = mean
            count = len(self._samples)
            self.sigma = tuple(
                (sum((s[axis] - mean[axis]) ** 2 for s in self._samples) / (count - 1)) ** 0.5 for axis in range(3)
            )
            self._samples = []


def _mean(samples):
    return tuple(sum(axis) / len(samples) for axis in zip(*samples))
