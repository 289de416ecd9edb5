"""How fast simulated time may go: at the asked speed, and no faster than the PC answers.

The simulator knows the PC only by the bytes of the CAN adapter. An answer to the frames so far is a command of the PC,
which it sends 50 times per simulated second, and the reading of the frames that wait in the port.
"""

from __future__ import annotations

from collections import deque

# Steps a simulation may be behind. What is more is given up instead of being caught up in a burst: in a burst the
# programs that live by the simulated clock have no time to do anything.
MAX_LAG_STEPS = 2
# After a command the next one is due, and overdue, after this much simulated time, s.
DUE_S, OVERDUE_S = 0.02, 0.03
# Time goes so slowly that the longest recent delay of an answer is no longer than this in simulated time, s: programs
# that do not answer to the bus, but watch each other's messages, are about as late. Their watchdogs allow 0.15 s.
MARGIN_S = 0.04
# A long delay is forgotten by halves, and counted up to LONGEST_S, s of the wall clock.
HALF_LIFE_S, LONGEST_S = 3.0, 0.4
# How long to wait for an answer, s of the wall clock. A PC that has not answered by then is taken for dead.
PATIENCE_S = 3.0
# A PC that was taken for dead is waited for again after this many commands, none later than PROMPT_S (simulated) after
# the one before.
STEADY, PROMPT_S = 10, 0.065
# Where the speed falls below this share of the asked one, the simulator says so.
KEPT = 0.9


class Pacer:
    """When the next step is due. `slips`: how often time was given up; `lost`: how much, s of the wall clock."""

    def __init__(self, period: float, now: float):
        """`period`: wall seconds per step. `now`: the reading of any steady clock, s."""
        self.period = period
        self.slips = 0
        self.lost = 0.0
        self._due = now + period

    def wait(self, now: float) -> float:
        """Seconds until the next step is due; 0 when it is, and then call `stepped`."""
        return max(self._due - now, 0.0)

    def stepped(self, now: float, slowest: float = 0.0) -> None:
        """A step was made at `now`. `slowest`: the next one is due no sooner than this much later, s."""
        self._due += self.period
        behind = now - self._due
        if behind > MAX_LAG_STEPS * self.period:
            self.slips += 1
            self.lost += behind
            self._due = now
        self._due = max(self._due, now + slowest) if slowest else self._due


class Patience:
    """Keeps the simulated clock with the PC's answers, however slow its machine is.

    The clock stands still while the PC's last command is OVERDUE_S old, or while the PC has not read all that it was
    sent. After PATIENCE_S of wall time in vain the PC has failed, and time goes on, so that the chair notices it.
    `waits`: how often the clock stood still. `waited`: for how long, s of the wall clock. `failed`: the PC commanded,
    and does so no longer, or too seldom to be waited for. Times named `now` are of the wall clock, s.
    """

    def __init__(self):
        self.waits = 0
        self.waited = 0.0
        self.forget()

    def forget(self) -> None:
        """The port is closed: there is nothing to wait for."""
        self.failed = self._unread_for_good = False
        self._commanded: float | None = None
        self._prompt = 0
        self._since: float | None = None
        self._due: float | None = None
        self._delay, self._measured = 0.0, 0.0

    def commanded(self, simulated: float, now: float) -> None:
        """A command came at the simulated time (s)."""
        if self.failed:
            prompt = self._commanded is not None and simulated - self._commanded <= PROMPT_S
            self._prompt = self._prompt + 1 if prompt else 0
            self.failed = self._prompt < STEADY
        elif self._due is not None:
            self._delayed(now - self._due, now)
        self._commanded, self._due = simulated, None

    def stepped(self, simulated: float, now: float) -> None:
        """Simulated time has come to `simulated` (s)."""
        if self._due is None and self._is_old(simulated, DUE_S):
            self._due = now

    def delay(self, now: float) -> float:
        """The longest recent delay of an answer, s of the wall clock."""
        return self._delay * 0.5 ** ((now - self._measured) / HALF_LIFE_S)

    def step_takes(self, step: float, now: float) -> float:
        """The least wall time for a step of `step` s, such that the PC keeps up."""
        # A PC that has failed is not left behind any faster than a real one would be.
        return max(step * self.delay(now) / MARGIN_S, step if self.failed else 0.0)

    def waiting(self, simulated: float, unread: int, now: float) -> bool:
        """Whether time is to stand still. `unread`: bytes the PC was sent and has not read."""
        if not unread:
            self._unread_for_good = False
        overdue = not self.failed and self._is_old(simulated, OVERDUE_S)
        if not (overdue or unread and not self._unread_for_good):
            self._go_on(now)
            return False
        if self._since is None:
            self._since = now
            self.waits += 1
        if now - self._since < PATIENCE_S:
            return True
        self.waited += now - self._since
        self._since = None
        self._unread_for_good = bool(unread)
        if overdue:
            self.failed, self._prompt = True, 0
        return False

    def _is_old(self, simulated: float, age: float) -> bool:
        # Times are multiples of 0.01 s, nearly.
        return self._commanded is not None and simulated - self._commanded >= age - 1e-5

    def _delayed(self, delay: float, now: float) -> None:
        self._delay, self._measured = max(self.delay(now), min(delay, LONGEST_S)), now

    def _go_on(self, now: float) -> None:
        if self._since is not None:
            self._delayed(now - self._since, now)
            self.waited += now - self._since
            self._since = None


class Speedometer:
    """How many simulated seconds passed per wall second, over the last `window` s of the wall clock."""

    def __init__(self, window: float = 5.0):
        self._window = window
        self._marks: deque[tuple[float, float]] = deque()

    def mark(self, simulated: float, now: float) -> None:
        """Simulated time is `simulated` (s) at `now` (s of the wall clock)."""
        self._marks.append((simulated, now))
        while len(self._marks) > 2 and self._marks[1][1] <= now - self._window:
            self._marks.popleft()

    @property
    def full(self) -> bool:
        """Whether a whole window has been measured."""
        return bool(self._marks) and self._marks[-1][1] - self._marks[0][1] >= self._window

    @property
    def speed(self) -> float:
        """Simulated seconds per wall second; 0 before two marks."""
        if len(self._marks) < 2 or self._marks[-1][1] == self._marks[0][1]:
            return 0.0
        (first, began), (last, ended) = self._marks[0], self._marks[-1]
        return (last - first) / (ended - began)
