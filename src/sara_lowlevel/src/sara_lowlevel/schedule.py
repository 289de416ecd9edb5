"""Periodic duties of a node that is called every few milliseconds with the time."""

# Times are sums of binary fractions: a duty due at 0.3 s must not slip to the next call for a rounding error.
TIME_TOLERANCE_S = 1e-6


class Every:
    """Says when a duty with a fixed period is due, starting at the first call."""

    def __init__(self, period: float):
        """`period`: seconds, positive."""
        self.period = period
        self._next: float | None = None

    def due(self, t: float) -> bool:
        """True once per period. `t`: seconds. After a gap longer than a period the missed turns are dropped."""
        if self._next is None:
            self._next = t
        if t < self._next - TIME_TOLERANCE_S:
            return False
        self._next += self.period
        if self._next <= t:
            self._next = t + self.period
        return True
