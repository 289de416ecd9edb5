"""Tells what did not come from what has come and was not handled yet, because this process stood still."""

from __future__ import annotations

import math

CYCLES = 2.5  # between two; after more the process has stood still
LONGEST_PAUSE = 0.5  # s; after more the wheels have stopped by themselves, and the robot must not go on at once
CATCH_UP = 0.25  # s for which messages may then wait to be handled


class Backlog:
    """After a pause of this process a simulated clock may be handled before the messages that came with it, or after
    them, whose stamps then lie ahead. Times are of a steady wall clock, s. period: from cycle to cycle.
    """

    def __init__(self, period: float) -> None:
        self._shortest = CYCLES * period
        self._cycle_at = math.inf
        self._paused_at = -math.inf
        self._late_since: float | None = None

    def explains(self, now: float, late: bool) -> bool:
        """Whether what is late in the cycle at `now` may only not be handled yet. To be called in every cycle. What
        stays late is so for CATCH_UP s at most, however often the process pauses.
        """
        pause, self._cycle_at = now - self._cycle_at, now
        if pause > self._shortest:
            self._paused_at = now if pause <= LONGEST_PAUSE else -math.inf
        if not late:
            self._late_since = None
            return False
        if self._late_since is None:
            self._late_since = now
        return max(now - self._paused_at, now - self._late_since) < CATCH_UP
