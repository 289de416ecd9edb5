"""The driver's newest command, as long as it is fresh, and then exactly one zero.

The server sends numbered beats. A command carries the newest beat that its page has received, so the time since that
beat was sent is an upper bound of the command's age, on one clock. Nothing that was queued, delayed or meant for
another connection is younger than its beat.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple

from sara_hmi.config.config import FreshnessConfig

LATE, USED, LIFT = 'error.drive_late', 'error.drive_used', 'error.drive_lift'
ZERO = (0.0, 0.0)


class Command(NamedTuple):
    """v and w: -1 to 1. came: when (s). void: from when on (s) it is not published any more."""

    v: float
    w: float
    came: float
    void: float


class Freshness:
    """One driver's beats and commands. `first`: the first beat's number, larger than any that was ever sent before."""

    def __init__(self, config: FreshnessConfig, first: int = 1) -> None:
        self._config = config
        self._next = first
        self._sent: OrderedDict[int, float] = OrderedDict()
        self._beat_due: float | None = None
        self._seq = -1
        self._command: Command | None = None
        self._repeat_due = 0.0
        self._silent_since: float | None = None

    @property
    def next_beat(self) -> int:
        """The number of the next beat."""
        return self._next

    @property
    def moving(self) -> bool:
        """Whether the last publication was a motion."""
        return self._command is not None

    def beat(self, t: float) -> int | None:
        """The number to send at t (s), or None where none is due."""
        if self._beat_due is not None and t < self._beat_due:
            return None
        late = self._beat_due is None or t >= self._beat_due + self._config.beat_s
        self._beat_due = (t if late else self._beat_due) + self._config.beat_s
        number, self._next = self._next, self._next + 1
        self._sent[number] = t
        while next(iter(self._sent.values())) + self._config.oldest_s < t:
            self._sent.popitem(last=False)
        return number

    def drive(
        self, t: float, seq: int, beat: int, motion: tuple[float, float]
    ) -> tuple[tuple[float, float] | None, str]:
        """A command came at t (s): (what to publish now or None, the reason it is refused or "").

        seq: the sender's number, growing with each command. motion: (v, w), each from -1 to 1. A motion of (0, 0) is
        `halt`, and is never refused for its age.
        """
        if seq <= self._seq:
            return None, USED
        self._seq = seq
        if motion == ZERO:
            return self.stop(), ''
        sent = self._sent.get(beat)
        if sent is None or not sent <= t <= sent + self._config.oldest_s:
            return None, LATE
        if self._silent_since is not None and t - self._silent_since > self._config.lift_s:
            return None, LIFT
        self._silent_since = None
        self._command = Command(*motion, t, min(t + self._config.hold_s, sent + self._config.oldest_s))
        self._repeat_due = t + self._config.repeat_s
        return motion, ''

    def halt(self, seq: int) -> tuple[float, float] | None:
        """The finger is lifted: the zero to publish now, None where the chair was not driven.

        Always obeyed; commands up to this number are void.
        """
        self._seq = max(self._seq, seq)
        return self.stop()

    def stop(self) -> tuple[float, float] | None:
        """The driving ends: the zero to publish now, None where the chair was not driven."""
        self._silent_since = None
        was, self._command = self._command, None
        return None if was is None else ZERO

    def step(self, t: float) -> tuple[float, float] | None:
        """What to publish at t (s), or None. To be called when `due` says, or earlier."""
        command = self._command
        if command is None:
            return None
        if not command.came <= t < command.void:
            self._command, self._silent_since = None, t
            return ZERO
        if t < self._repeat_due:
            return None
        self._repeat_due = t + self._config.repeat_s
        return command.v, command.w

    def due(self, t: float) -> float:
        """When `beat` or `step` has something to do next (s), t at the earliest."""
        times = [t if self._beat_due is None else self._beat_due]
        if self._command is not None:
            times += [self._command.void, self._repeat_due]
        return max(t, min(times))
