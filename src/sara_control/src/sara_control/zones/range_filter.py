"""What of a sensor's readings is believed: the range that enough of them in a row bear out."""

from collections import deque


class BelievedRange:
    """`range`: m, +-Inf as in REP-117, None before the first reading. trigger, release: how many readings in a row make
    it nearer, or farther.
    """

    def __init__(self, trigger, release):
        self._trigger, self._release = trigger, release
        self._last = deque(maxlen=max(trigger, release))
        self.range = None

    def at_once(self, distance):
        """Believe a reading (m) without waiting for another."""
        self._last.clear()
        self.range = distance

    def add(self, distance):
        """A reading, m."""
        self._last.append(distance)
        recent = list(self._last)
        nearer, farther = max(recent[-self._trigger :]), min(recent[-self._release :])
        if self.range is None:
            self.range = distance
        elif len(recent) >= self._trigger and nearer < self.range:
            self.range = nearer
        elif len(recent) >= self._release and farther > self.range:
            self.range = farther
