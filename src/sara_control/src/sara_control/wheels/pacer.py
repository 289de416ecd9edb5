"""When to publish so that the mean rate is what was asked, whatever the rate of what there is to publish."""


class Pacer:
    """rate: Hz; 0: never."""

    EARLY = 0.1  # of a period: stamps jitter

    def __init__(self, rate: float) -> None:
        self.rate = rate
        self._due = None

    def due(self, t: float) -> bool:
        """Whether to publish now, at t (s). The first call starts the clock: one period later it is due."""
        if self.rate <= 0.0:
            return False
        period = 1.0 / self.rate
        # A due time far ahead is a clock that was set back, one far behind a pause: neither is made up for.
        if self._due is None or self._due > t + 2.0 * period:
            self._due = t + period
            return False
        if t < self._due - self.EARLY * period:
            return False
        self._due += period
        if self._due + period < t:
            self._due = t + period
        return True
