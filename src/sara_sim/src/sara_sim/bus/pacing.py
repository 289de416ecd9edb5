"""Keeps a simulation's steps in step with a clock that runs on its own."""

from __future__ import annotations

# Further behind than this, lost time is given up instead of being caught up in a burst, s of the wall clock: in a burst
# the programs that live by the simulated clock have no time to do anything, and what watches them would take them for
# dead.
MAX_LAG_S = 0.02
# Simulated time without a command from a PC that has been commanding, s, and how long to wait for it then, s of the
# wall clock.
OVERDUE_S, PATIENCE_S = 0.06, 1.0


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


class Patience:
    """Lets the simulated clock wait for a PC that is late because its machine is busy, not because it has failed.

    A PC that commands does so 50 times a second. If nothing has come for OVERDUE_S of simulated time, time stands still
    until it comes, PATIENCE_S of
    the wall clock at most: then it has failed, and time goes on. `waits`: how often it stood still.
    """

    def __init__(self):
        self.waits = 0
        self.forget()

    def forget(self) -> None:
        """Nobody commands."""
        self._commanded: float | None = None
        self._until: float | None = None

    def commanded(self, simulated: float) -> None:
        """A command came at the simulated time (s)."""
        self._commanded, self._until = simulated, None

    def waiting(self, simulated: float, now: float) -> bool:
        """Whether time is to stand still at `now` (s of the wall clock)."""
        if self._commanded is None or simulated - self._commanded < OVERDUE_S:
            return False
        if self._until is None:
            self._until = now + PATIENCE_S
            self.waits += 1
        return now < self._until
