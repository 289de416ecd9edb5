"""The gyroscope's offset, measured at rest before anything is published (thesis 4.2.3.1: it cuts the drift by 75 %).

Rest is tested, not assumed: a sample off the mean, a mean that wanders, or a wheel that turns starts the measurement over.
"""

MAX_OFFSET = 20.0  # deg/s: the MPU6050's product specification promises no worse zero-rate output


class GyroCalibration:
    """Mean of `frames` samples at rest.

    add() returns True when done; then `offset` holds three rates in the unit of the samples (deg/s). `restarts` counts the
    starts over and `reason` says why the last one happened.
    """

    def __init__(self, frames, still_step, still_drift):
        self.frames = frames
        self.still_step = still_step
        self.still_drift = still_drift
        self.offset = None
        self.restarts = 0
        self.reason = ''
        self._samples = []
        self._sums = [0.0, 0.0, 0.0]

    @property
    def done(self):
        """Whether the offset is known."""
        return self.offset is not None

    @property
    def collected(self):
        """Samples so far."""
        return self.frames if self.done else len(self._samples)

    def add(self, sample):
        """Take a sample (x, y, z) in deg/s; True once the offset is known."""
        if self.done:
            return True
        count = len(self._samples)
        if count and any(abs(value - total / count) > self.still_step for value, total in zip(sample, self._sums)):
            self.start_over('the gyroscope moved')
        self._samples.append(tuple(sample))
        self._sums = [total + value for total, value in zip(self._sums, sample)]
        if len(self._samples) >= self.frames:
            self._finish()
        return self.done

    def start_over(self, reason):
        """Forget the samples of an unfinished measurement."""
        if self.done or not self._samples:
            return
        self.restarts += 1
        self.reason = reason
        self._samples = []
        self._sums = [0.0, 0.0, 0.0]

    def _finish(self):
        half = len(self._samples) // 2
        first, second = _mean(self._samples[:half]), _mean(self._samples[half:])
        mean = _mean(self._samples)
        # Short measurements are noisier: the limit holds for the mean of 50 samples.
        drift_limit = self.still_drift * max(1.0, (50.0 / half) ** 0.5)
        if any(abs(a - b) > drift_limit for a, b in zip(first, second)):
            self.start_over('the mean of the gyroscope changed')
        elif any(abs(value) > MAX_OFFSET for value in mean):
            self.start_over('the chair turns or the gyroscope is faulty')
        else:
            self.offset = mean
            self._samples = []


def _mean(samples):
    return tuple(sum(axis) / len(samples) for axis in zip(*samples))
