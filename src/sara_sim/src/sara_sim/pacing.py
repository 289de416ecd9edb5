"""Keeps a simulation's steps in step with a clock that runs on its own."""

from __future__ import annotations

# Further behind than this, lost time is given up instead of being caught up in a burst, s of the wall clock.
MAX_LAG_S = 0.25


class Pacer:
    """Times are seconds of any steady clock. `slips`: how often time was given up; `lost`: how much (s)."""

    def __init__(self, period: float, now: float):
        """`period`: wall seconds per step. `now`: the clock's reading at the start."""
        self.period = period
        self.slips = 0
        self.lost = 0.0
        self._due = now + period

    def wait(self, now: float) -> float:
        """Seconds until the next step is due; 0 when it is, and then call `stepped`."""
        return max(self._due - now, 0.0)

    def stepped(self, now: float) -> None:
        """A step was made at `now`."""
        self._due += self.period
        behind = now - self._due
        if behind > MAX_LAG_S:
            self.slips += 1
            self.lost += behind
            self._due = now
