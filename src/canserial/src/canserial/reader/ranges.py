"""Ultrasonic ranges: the median of the last three readings, by the conventions of REP-117."""

from __future__ import annotations

import math
from collections import deque

SILENT = 655.345  # m; from here on a frame says that the sensor does not answer its node (65535 cm)
NAMES = ('SDI', 'SDD', 'SLID', 'SLIT', 'SLDD', 'SLDT', 'STI', 'STD', 'SJO')


def rep117(distance: float, minimum: float, maximum: float) -> float:
    """A raw distance (m, 0 = no echo) as REP-117 says it: -Inf below minimum, +Inf for no echo and beyond maximum."""
    if distance == 0.0 or distance > maximum:
        return math.inf
    return -math.inf if distance < minimum else distance


class RangeFilter:
    """Median of a sensor's last three readings; None until there are three, no two of them more than max_gap apart."""

    def __init__(self, minimum: float, maximum: float, max_gap: float) -> None:
        self.minimum = minimum
        self.maximum = maximum
        self.max_gap = max_gap
        self._last = {name: deque(maxlen=3) for name in NAMES}
        self._stamp = dict.fromkeys(NAMES, -math.inf)

    def add(self, name: str, stamp: float, distance: float) -> float | None:
        """Take a raw distance (m); returns the filtered range or None."""
        last = self._last[name]
        if not 0.0 <= stamp - self._stamp[name] <= self.max_gap:
            last.clear()
        self._stamp[name] = stamp
        last.append(rep117(distance, self.minimum, self.maximum))
        return sorted(last)[1] if len(last) == 3 else None
