"""How much somebody works at a stick."""

from __future__ import annotations

import numpy as np
from scipy import signal

CUT_OFF_HZ, ORDER = 0.6, 2  # of the low-pass filter
GAP = 0.1  # of full deflection
TURNED = 0.05  # of full deflection: the stick's dead band; less is no turning


def sign_changes(left: np.ndarray) -> int:
    """How often a stick's turning (n,), -1..1, goes from one side to the other."""
    side = np.sign(left[np.abs(left) > TURNED])
    return int(np.count_nonzero(np.diff(side)))


def reversals(left: np.ndarray, dt: float, gap: float = GAP) -> int:
    """Steering reversals of a stick's turning (n,), -1..1, read every dt (s): how often its way turns back by `gap` or
    more, after a low-pass filter that takes tremor off (G. Markkula and J. Engstrom, "A steering wheel reversal rate
    metric for assessing effects of visual and cognitive secondary task load", ITS World Congress 2006: Butterworth of
    the second order at 0.6 Hz, both up and down counted).
    """
    if len(left) < 3 * ORDER * 3:
        return 0
    smooth = signal.filtfilt(*signal.butter(ORDER, CUT_OFF_HZ, fs=1.0 / dt), left)
    count, direction, extreme = 0, 0, smooth[0]
    for value in smooth:
        if direction * (value - extreme) >= 0.0 and direction != 0:
            extreme = value
        elif abs(value - extreme) >= gap:
            count += direction != 0
            direction, extreme = int(np.sign(value - extreme)), value
    return count


def reversal_rate(left: np.ndarray, dt: float) -> float:
    """Steering reversals per minute."""
    return reversals(left, dt) / (len(left) * dt / 60.0) if len(left) else 0.0
