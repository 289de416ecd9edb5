"""What has been done, so that a late measurement can be put in its place: states, measurements and commands of the last
seconds.

The rule is robot_localization's: go back to the newest state that is older than the late measurement (to the oldest
there is, where none is old enough) and do again all that was measured after it.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from sara_localization.filters.control import Control
from sara_localization.inputs.raw_measurement import Measurement

# A late measurement of the very stamp of a state goes before it.
_EPSILON = 1e-9
# Commands that are kept: without measurements none of them expires.
MOST_COMMANDS = 10_000


class History:
    """length: how many seconds are kept."""

    def __init__(self, length: float):
        self.length = length
        self._states, self._measurements, self._commands = deque(), deque(), deque(maxlen=MOST_COMMANDS)

    def clear(self) -> None:
        """Nothing of what was done may be done again."""
        self._states.clear()
        self._measurements.clear()

    def forget(self) -> None:
        """As if nothing had ever come in."""
        self.clear()
        self._commands.clear()

    def done(self, entry: tuple[int, str, Measurement]) -> None:
        """A measurement was taken; entry: what the queue held."""
        self._measurements.append(entry)

    def keep(self, snapshot: tuple) -> None:
        """The state after all measurements of one stamp; snapshot: (time, ...)."""
        self._states.append(snapshot)

    def go_back(self, stamp: float) -> tuple[tuple | None, list[tuple], bool]:
        """For a measurement of `stamp` (s): the snapshot to restore (or None), the entries to do again, and whether the
        history reaches back far enough."""
        time, oldest = stamp - _EPSILON, None
        while self._states and self._states[-1][0] > time:
            oldest = self._states.pop()
        enough = bool(self._states)
        snapshot = self._states[-1] if enough else oldest
        again = []
        if snapshot is not None:
            while self._measurements and self._measurements[-1][-1].stamp > time:
                entry = self._measurements.pop()
                if entry[-1].stamp >= snapshot[0]:
                    again.append(entry)
        return snapshot, again, enough

    def commanded(self, stamp: float, command: np.ndarray) -> None:
        """A command (6,) was given at a time (s)."""
        self._commands.append((stamp, command))

    def recall(self, control: Control, stamp: float) -> None:
        """Give a Control the command that held at a time (s), for a measurement that is done again."""
        for at, command in reversed(self._commands):
            if at <= stamp:
                control.set(command, at)
                return

    def expire(self, now: float) -> float:
        """Forget what is older than `length` before now, but for the command that held then; returns that time (s)."""
        limit = now - self.length
        while self._measurements and self._measurements[0][-1].stamp < limit:
            self._measurements.popleft()
        while self._states and self._states[0][0] < limit:
            self._states.popleft()
        commands = self._commands
        while len(commands) > 1 and commands[0][0] < limit and commands[1][0] <= limit:
            commands.popleft()
        return limit
