"""Selects one of several sources of velocity commands, as twist_mux does.

topics: each source has a name, a topic, a timeout and a priority. The source of the highest priority that has sent a
command within its timeout drives (of equals the first). locks: a lock that is true, or that has a timeout and has sent
nothing for longer, blocks all sources of a lower priority. So far twist_mux.

Beyond it, a driving source that times out is followed by one command of zero. A source that is preempted by another, by
a lock or by the robot's own joystick is ignored until it sends zero or pauses for its timeout: what the user has
interrupted does not resume by itself. One that waits, with commands of zero, while another moves the robot away counts
as preempted, too: its goal is not to go on from there. Who goes on commanding all the same is told again every second:
it may be about another goal by now.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sara_common.config import ConfigError

NO_DRIVER = 'nobody'
ROBOT = 'the joystick of the chair'
AHEAD = 0.1  # s: older commands have a stamp before now; a command from the future was given on another clock
OWN_PAUSE = 0.5  # of a source's timeout: who was not asked for so long was held up, or the clock was set forward
AGAIN = 1.0  # s until a source that goes on although it was told that it is preempted is told again
KEYS = ('name', 'topic', 'timeout', 'priority')


@dataclass(frozen=True)
class Source:
    """A topic or a lock. timeout: s. priority: 0..255, higher wins."""

    name: str
    topic: str
    timeout: float
    priority: int


@dataclass(frozen=True)
class MuxConfig:
    """topics and locks: tuples of Source."""

    topics: tuple
    locks: tuple = ()

    @classmethod
    def from_params(cls, params: dict) -> 'MuxConfig':
        """From twist_mux's lists `topics` and `locks`. Raises ConfigError with every fault."""
        faults = []
        topics = _read(params.get('topics', []), 'topics', faults)
        locks = _read(params.get('locks', []), 'locks', faults)
        for source in topics:
            if source.timeout == 0.0:
                faults.append(
                    f'topics: timeout of {source.name} is 0, allowed are numbers above 0: '
                    'a command that never grows old would drive for ever'
                )
        if not topics and not faults:
            faults.append('topics is empty, allowed is a list with one entry or more')
        for kind, sources in (('topics', topics), ('locks', locks)):
            for key in ('name', 'topic'):
                held = [getattr(source, key) for source in sources]
                faults += [
                    f'{kind}: {key} is {value!r} more than once, allowed is once'
                    for value in sorted(set(held))
                    if held.count(value) > 1
                ]
        if faults:
            raise ConfigError(faults)
        return cls(tuple(topics), tuple(locks))


def _read(entries, kind, faults):
    if not isinstance(entries, list):
        faults.append(f'{kind} is {entries!r}, allowed is a list')
        return []
    sources = []
    for number, entry in enumerate(entries):
        if not isinstance(entry, dict):
            faults.append(f'{kind}[{number}] is {entry!r}, allowed is a mapping with {", ".join(KEYS)}')
            continue
        found = []
        for key in ('name', 'topic'):
            if not isinstance(entry.get(key), str) or not entry[key]:
                found.append(f'{kind}[{number}]: {key} is {entry.get(key)!r}, allowed is a name')
        timeout, priority = entry.get('timeout'), entry.get('priority')
        if not isinstance(timeout, (int, float)) or isinstance(timeout, bool) or not 0.0 <= timeout < math.inf:
            found.append(f'{kind}[{number}]: timeout is {timeout!r}, allowed are numbers of 0 or more')
        if not isinstance(priority, int) or isinstance(priority, bool) or not 0 <= priority <= 255:
            found.append(f'{kind}[{number}]: priority is {priority!r}, allowed are whole numbers from 0 to 255')
        found += [
            f'{kind}[{number}]: {key} is {entry[key]!r}, but there is no such parameter'
            for key in entry
            if key not in KEYS
        ]
        faults += found
        if not found:
            sources.append(Source(entry['name'], entry['topic'], float(timeout), priority))
    return sources


@dataclass
class _Input:
    """The latest command of a source. blocked: it was preempted, and is ignored for now. told: when (s) it was told
    that it is preempted, -inf where it is not.
    """

    v: float = 0.0
    w: float = 0.0
    stamp: float = -math.inf
    blocked: bool = False
    told: float = -math.inf

    @property
    def moves(self) -> bool:
        """Whether it commands a motion."""
        return self.v != 0.0 or self.w != 0.0


class SelectedCommand(NamedTuple):
    """A command (v m/s, w rad/s) to pass on, and the source that gave it."""

    v: float
    w: float
    source: str


class Mux:
    """config: MuxConfig. `driver`: name of the source that drives, NO_DRIVER or ROBOT. `dropped`: {source: commands not
    finite}.
    """

    def __init__(self, config: MuxConfig) -> None:
        self.config = config
        self.driver = NO_DRIVER
        self.dropped = {}
        self._inputs = {source.name: _Input() for source in config.topics}
        self._sources = {source.name: source for source in config.topics}
        self._all = [(source, self._inputs[source.name]) for source in config.topics]
        self._locks = {lock.name: (False, -math.inf) for lock in config.locks}
        self._taken = False
        self._preempted = ()
        self._now = -math.inf

    def take_preempted(self) -> tuple[str, ...]:
        """Names of the sources that were told since the last call that they are preempted: their goals are to be
        cancelled.
        """
        names, self._preempted = self._preempted, ()
        return names

    def is_blocked(self, name: str) -> bool:
        """Whether what the source commands is ignored for now."""
        return self._inputs[name].blocked

    def on_command(self, t: float, name: str, v: float, w: float) -> SelectedCommand | None:
        """Source `name` commands (v, w) at t (s). Returns the SelectedCommand to pass on now, or None."""
        if not (math.isfinite(v) and math.isfinite(w)):
            self.dropped[name] = self.dropped.get(name, 0) + 1
            return None
        self._follow(t)
        latest = self._inputs[name]
        if latest.blocked and (v == w == 0.0 or _timed_out(t, self._sources[name], latest)):
            latest.blocked = False
        latest.v, latest.w, latest.stamp = v, w, t
        selected = self._decide(t)
        if selected is not None or self.driver != name:
            return selected
        return SelectedCommand(v, w, name)

    def on_lock(self, t: float, name: str, locked: bool) -> SelectedCommand | None:
        """Lock `name` is set or released at t (s). Returns a SelectedCommand or None."""
        self._follow(t)
        self._locks[name] = (bool(locked), t)
        return self._decide(t)

    def on_robot(self, t: float, taken: bool) -> SelectedCommand | None:
        """taken: the robot's own joystick drives, past this multiplexer. Returns a SelectedCommand or None."""
        self._taken = bool(taken)
        return self._decide(t)

    def update(self, t: float) -> SelectedCommand | None:
        """Looks for timeouts at t (s); to be called often. Returns a SelectedCommand or None."""
        return self._decide(t)

    def _follow(self, t):
        """Where the clock was set back, all that was said before is old. Who is blocked has not paused by that, nor by
        a clock that was set forward, nor while nobody asked.
        """
        if t < self._now - AHEAD:
            for latest in self._inputs.values():
                latest.stamp = t if latest.blocked else -math.inf
            self._locks = {name: (locked, -math.inf) for name, (locked, _) in self._locks.items()}
        for source, latest in self._all:
            if latest.blocked and t - self._now > OWN_PAUSE * source.timeout:
                latest.stamp += t - self._now
        self._now = t

    def locked(self, t: float) -> int:
        """The priority below which sources are locked at t (s)."""
        least = 0
        for lock in self.config.locks:
            if lock.priority > least and self._is_locked(t, lock):
                least = lock.priority
        return least

    def _is_locked(self, t, lock):
        locked, stamp = self._locks[lock.name]
        return locked or (lock.timeout > 0.0 and not t - stamp <= lock.timeout)

    def _driver(self, active, least):
        """The driver among the (source, input) pairs that have not timed out, with this priority at least."""
        if self._taken:
            return ROBOT
        driver, highest = NO_DRIVER, -1
        for source, latest in active:
            if source.priority >= least and source.priority > highest and not latest.blocked:
                driver, highest = source.name, source.priority
        return driver

    def _decide(self, t):
        """Chooses the driver; returns the command to pass on if it is another than before, or None."""
        self._follow(t)
        least = self.locked(t)
        active = [pair for pair in self._all if not _timed_out(t, *pair)]
        before, self.driver = self.driver, self._driver(active, least)
        self._block(active, least, t)
        if self.driver == before:
            return None
        if self.driver in (NO_DRIVER, ROBOT):
            return SelectedCommand(0.0, 0.0, self.driver)
        latest = self._inputs[self.driver]
        return SelectedCommand(latest.v, latest.w, self.driver)

    def _block(self, active, least, t):
        """Blocks the sources that command a motion and are preempted by a driver or a lock of a higher priority; tells
        of them, and of those that wait while a driver of a higher priority moves the robot.
        """
        moved = -1  # the priority below which somebody else moves the robot
        if self.driver in self._sources:
            priority = self._sources[self.driver].priority
            least = max(least, priority)
            moved = priority if self._inputs[self.driver].moves else -1
        for source, latest in active:
            preempted = self._taken or source.priority < (least if latest.moves else moved)
            driven_out = preempted and latest.moves and not latest.blocked
            latest.blocked |= driven_out
            if not preempted and not (latest.blocked and latest.moves):
                latest.told = -math.inf
            elif driven_out or not 0.0 <= t - latest.told < AGAIN:
                latest.told = t
                self._preempted += (source.name,)


def _timed_out(t, source, latest):
    """Whether the latest command of a Source is too old at t (s), or from the future."""
    return not -AHEAD <= t - latest.stamp <= source.timeout
