"""A recorded drive: wheel angles and a gyroscope's turn rate, cut where the robot stood still.

A gyroscope and encoders are sampled at their own times and late by their own lag. Cut from rest to rest neither
matters: how far the wheels turned and how far the robot turned in between are both exact, whatever the clocks did on
the way.
"""

from dataclasses import dataclass

import numpy as np

STILL = 0.002  # m/s at the rim
LONGEST_GYRO_GAP = 1.0  # s


class LogError(ValueError):
    """One sentence on what a recording lacks."""


@dataclass(frozen=True)
class DriveLog:
    """wheel_times (n,) s, left, right (n,) rad; gyro_times (m,) s, rates (m,) rad/s, each the mean since the sample
    before it.

    truth: (n, 3) x, y (m), yaw (rad) at the wheel times, if it was measured. Raises LogError for what cannot be
    used.
    """

    wheel_times: np.ndarray
    left: np.ndarray
    right: np.ndarray
    gyro_times: np.ndarray
    rates: np.ndarray
    truth: np.ndarray = None

    def __post_init__(self):
        for names in (('wheel_times', 'left', 'right'), ('gyro_times', 'rates')):
            arrays = [np.asarray(getattr(self, name), dtype=float) for name in names]
            if any(array.ndim != 1 or array.shape != arrays[0].shape for array in arrays) or len(arrays[0]) < 2:
                raise LogError(f'{", ".join(names)} must be arrays of one length, at least 2')
            if not all(np.isfinite(array).all() for array in arrays):
                raise LogError(f'{", ".join(names)} must be finite')
            if (np.diff(arrays[0]) <= 0.0).any():
                raise LogError(f'{names[0]} must rise')
            for name, array in zip(names, arrays):
                object.__setattr__(self, name, array)
        if self.truth is not None and np.shape(self.truth) != (len(self.wheel_times), 3):
            raise LogError('truth must be (x, y, yaw) for every wheel time')

    def turned(self, times: np.ndarray) -> np.ndarray:
        """Angle the gyroscope turned since its first sample, at these times (rad), its bias in it."""
        steps = np.diff(self.gyro_times) * self.rates[1:]
        return np.interp(times, self.gyro_times, np.concatenate(([0.0], np.cumsum(steps))))

    def gyro_gap(self, start: float, end: float) -> float:
        """The longest time without a gyroscope sample between two times, s."""
        inside = self.gyro_times[(self.gyro_times > start) & (self.gyro_times < end)]
        return float(np.diff(np.concatenate(([start], inside, [end]))).max())

    def rests(self, radius: float, shortest: float) -> list:
        """[(first index, last index)] into the wheel times: where both wheels stood still for `shortest` s or more."""
        dt = np.diff(self.wheel_times)
        still = np.maximum(abs(np.diff(self.left)), abs(np.diff(self.right))) * radius < STILL * dt
        edges = np.flatnonzero(np.diff(np.concatenate(([False], still, [False])).astype(int)))
        return [
            (begin, end)
            for begin, end in zip(edges[::2], edges[1::2])
            if self.wheel_times[end] - self.wheel_times[begin] >= shortest
        ]


@dataclass(frozen=True)
class Stretch:
    """A piece of the drive from one rest to the next, or a rest. Angles in rad, time in s."""

    start: float
    end: float
    left: float
    right: float
    gyro: float

    @property
    def seconds(self) -> float:
        """Its length."""
        return self.end - self.start


def stretches(log: DriveLog, radius: float, shortest: float = 0.5) -> list:
    """(moves, rests): Stretches; a move reaches from the middle of a rest to the middle of the next. Gyroscope gaps are
    left out.

    Raises LogError where there are fewer than two rests.
    """
    rests = log.rests(radius, shortest)
    if len(rests) < 2:
        raise LogError(
            f'the recording has {len(rests)} rests of {shortest:g} s or more, at least 2 are needed: '
            'stand still for a second before, between and after the moves'
        )
    first, last = log.gyro_times[0], log.gyro_times[-1]

    def stretch(begin, end):
        start, stop = log.wheel_times[begin], log.wheel_times[end]
        if start < first or stop > last or log.gyro_gap(start, stop) > LONGEST_GYRO_GAP:
            return None
        turned = log.turned(np.array([start, stop]))
        return Stretch(
            start,
            stop,
            log.left[end] - log.left[begin],
            log.right[end] - log.right[begin],
            float(turned[1] - turned[0]),
        )

    middles = [(begin + end) // 2 for begin, end in rests]
    moves = [stretch(a, b) for a, b in zip(middles, middles[1:])]
    # Inside a rest the gyroscope may still see the body settle: leave its first part out.
    quiet = [stretch(begin + (end - begin) // 4, end) for begin, end in rests]
    return [m for m in moves if m is not None], [q for q in quiet if q is not None]
