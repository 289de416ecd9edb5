"""Filters range readings: a nearer or a farther range is accepted after enough consecutive readings confirm it."""

from collections import deque


class RangeFilter:
    """trigger, release: number of consecutive readings that confirm a nearer range, and a farther one.

    `range`: the accepted range, m, +-Inf as in REP-117, None before the first reading.
    """

    def __init__(self, trigger: int, release: int) -> None:
        self._trigger, self._release = trigger, release
        self._last = deque(maxlen=max(trigger, release))
        self.range = None

    def accept(self, distance: float) -> None:
        """Accepts a reading (m) without waiting for another."""
        self._last.clear()
        self.range = distance

    def add(self, distance: float) -> None:
        """Takes a reading, m."""
        self._last.append(distance)
        recent = list(self._last)
        nearer, farther = max(recent[-self._trigger :]), min(recent[-self._release :])
        if self.range is None:
            self.range = distance
        elif len(recent) >= self._trigger and nearer < self.range:
            self.range = nearer
        elif len(recent) >= self._release and farther > self.range:
            self.range = farther
