"""A fixed amount of work, by which times of different machines, and of different moments of one, are compared.

Small matrix products called from Python, a sort of a million doubles, a sum in plain Python. What takes n yardsticks
here took n there.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock

TIMES = 3


def work() -> int:
    """The yardstick once."""
    random = np.random.default_rng(0)
    step, matrix = random.standard_normal((15, 15)), np.eye(15)
    for _ in range(20_000):
        matrix = step @ matrix
        matrix /= 1.0 + abs(matrix[0, 0])
    np.sort(random.standard_normal(1_000_000))
    return sum(number * number for number in range(400_000))


def measure(times: int = TIMES, clock: Clock = time.process_time) -> float:
    """Median of so many, ms of the process's own time."""
    taken = []
    for _ in range(times):
        begin = clock()
        work()
        taken.append(1e3 * (clock() - begin))
    return float(np.median(taken))
