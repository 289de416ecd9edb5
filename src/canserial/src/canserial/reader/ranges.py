"""Ultrasonic ranges: the median of the last three readings, by the conventions of REP-117."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable

SILENT = 655.345  # m; from here on a frame says that the sensor does not answer its node (65535 cm)
MEASURED_EVERY = 0.2  # s, by each sensor (thesis, 2.6)


def rep117(distance: float, minimum: float, maximum: float) -> float:
    """A raw distance (m, 0 = no echo) as REP-117 says it: -Inf below minimum, +Inf for no echo and beyond maximum."""
    if distance == 0.0 or distance > maximum:
        return math.inf
    return -math.inf if distance < minimum else distance


class RangeFilter:
    """Median of a sensor's last three readings; None until there are three, no two of them more than max_gap apart."""

    def __init__(self, names: Iterable[str], limits: tuple[float, float], max_gap: float) -> None:
        """`names`: of the sensors. `limits`: least and most that they measure, m. `max_gap`: s."""
        names = tuple(names)
        self.minimum, self.maximum = limits
        self.max_gap = max_gap
        self._last = {name: deque(maxlen=3) for name in names}
        self._stamp = dict.fromkeys(names, -math.inf)
        self._raw = dict.fromkeys(names, math.nan)

    def is_repeat(self, name: str, stamp: float, distance: float) -> bool:
        """Whether a frame only says again what was taken before: a raw distance (m) that has not changed, sooner than a
        sensor measures anew. In the sensor node's fast mode a measurement in RANGE_ACCEL comes in four frames.

        A change is not taken at once either: two measurements 50 ms apart would be an approach at four times the speed.
        """
        since = stamp - self._stamp[name]
        share = 0.875 if distance == self._raw[name] else 0.625  # between the third frame and the fourth, or the second
        return 0.0 <= since < share * MEASURED_EVERY

    def add(self, name: str, stamp: float, distance: float) -> float | None:
        """Take a raw distance (m); returns the filtered range or None."""
        last = self._last[name]
        if not 0.0 <= stamp - self._stamp[name] <= self.max_gap:
            last.clear()
        self._stamp[name], self._raw[name] = stamp, distance
        last.append(rep117(distance, self.minimum, self.maximum))
        return sorted(last)[1] if len(last) == 3 else None
