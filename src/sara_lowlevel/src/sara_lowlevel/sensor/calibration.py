"""The average of the IMU at rest, with a test that it was at rest (thesis 2.5.4: the mean of 200 measurements before
eq. 2.1, 2.2).

Noise of single samples is larger than a slow start of the chair, so rest is judged by means of 0.2 s: all of them must
stay within a band. A chair that turned evenly all the time cannot be told from a biased gyroscope this way; the caller
limits the bias.
"""

from __future__ import annotations

BLOCK = 20


class StillAverage:
    """Add samples until `done`; then `accel` and `gyro` are the means. `moved` says that it was not at rest: start a
    new one.
    """

    def __init__(self, samples: int, accel_band: float, gyro_band: float) -> None:
        """`samples`: how many to average. `accel_band`, `gyro_band`: counts, the widest spread of the means of 20
        samples on an axis.
        """
        self.samples = max(samples, 1)
        self.count = 0
        self.moved = False
        self._bands = (accel_band,) * 3 + (gyro_band,) * 3
        self._sums = [0] * 6
        self._block = [0] * 6
        self._low: list[float] | None = None
        self._high: list[float] | None = None

    def add(self, sample: tuple[int, int, int, int, int, int]) -> None:
        """`sample`: counts ax, ay, az, gx, gy, gz."""
        self._sums = [total + value for total, value in zip(self._sums, sample)]
        self._block = [total + value for total, value in zip(self._block, sample)]
        self.count += 1
        if self.count % BLOCK == 0:
            means = [total / BLOCK for total in self._block]
            self._block = [0] * 6
            self._low = means if self._low is None else list(map(min, self._low, means))
            self._high = means if self._high is None else list(map(max, self._high, means))
            self.moved = self.moved or any(
                high - low > band for high, low, band in zip(self._high, self._low, self._bands)
            )

    @property
    def done(self) -> bool:
        """Whether there are as many samples as were asked for."""
        return self.count >= self.samples

    @property
    def accel(self) -> tuple[float, float, float]:
        """Mean counts of the accelerometer."""
        return tuple(total / self.count for total in self._sums[:3])

    @property
    def gyro(self) -> tuple[float, float, float]:
        """Mean counts of the gyroscope."""
        return tuple(total / self.count for total in self._sums[3:])
