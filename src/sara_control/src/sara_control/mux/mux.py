"""Who drives: several sources of commands, one of which is listened to, in the manner of twist_mux.

topics: each has a name, a topic, a timeout and a priority; the one of the highest priority that has spoken within its
timeout drives (of equals the first). locks: a lock that says true, or has a timeout and was silent for longer, silences
all sources of a lower priority. So far twist_mux. Beyond it: a source that falls silent while it drives is followed by
one command of zero; one that is driven out by another, by a lock or by the robot's own joystick, is not heard again
until it has said zero or been
silent for its timeout: what the user has interrupted does not go on by itself.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sara_common.config import ConfigError

NOBODY = 'nobody'
ROBOT = 'the joystick of the chair'
AHEAD = 0.1  # s: older commands have a stamp before now; a command from the future was given on another clock
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
    def from_params(cls, params):
        """From twist_mux's lists `topics` and `locks`. Raises ConfigError with every fault."""
        faults = []
        topics = _read(params.get('topics', []), 'topics', faults)
        locks = _read(params.get('locks', []), 'locks', faults)
        for source in topics:
            if source.timeout == 0.0:
                faults.append(
                    f'topics: timeout of {source.name} is 0, allowed are numbers above 0: a command that never grows old '
                    f'would drive for ever'
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
class _Heard:
    """What a source said last, and whether it is listened to."""

    v: float = 0.0
    w: float = 0.0
    stamp: float = -math.inf
    barred: bool = False


class Said(NamedTuple):
    """A command (v m/s, w rad/s) to pass on and who gave it."""

    v: float
    w: float
    source: str


class Mux:
    """config: MuxConfig. `driver`: name of the source that drives, NOBODY or ROBOT. `dropped`: {source: commands not
    finite}.
    """

    def __init__(self, config):
        self.config = config
        self.driver = NOBODY
        self.dropped = {}
        self._heard = {source.name: _Heard() for source in config.topics}
        self._sources = {source.name: source for source in config.topics}
        self._all = [(source, self._heard[source.name]) for source in config.topics]
        self._locks = {lock.name: (False, -math.inf) for lock in config.locks}
        self._taken = False
        self._driven_out = ()

    def take_driven_out(self):
        """Names of the sources that wanted to drive and are not heard any more, since the last call: their goals are to
        be dropped.
        """
        names, self._driven_out = self._driven_out, ()
        return names

    def on_command(self, t, name, v, w):
        """Source `name` commands (v, w) at t (s). Returns what to pass on now, Said or None."""
        if not (math.isfinite(v) and math.isfinite(w)):
            self.dropped[name] = self.dropped.get(name, 0) + 1
            return None
        heard = self._heard[name]
        if heard.barred and (v == w == 0.0 or _silent(t, self._sources[name], heard)):
            heard.barred = False
        heard.v, heard.w, heard.stamp = v, w, t
        said = self._decide(t)
        if said is not None or self.driver != name:
            return said
        return Said(v, w, name)

    def on_lock(self, t, name, locked):
        """Lock `name` says at t (s) whether it locks. Returns Said or None."""
        self._locks[name] = (bool(locked), t)
        return self._decide(t)

    def on_robot(self, t, taken):
        """taken: the robot's own joystick drives, past this multiplexer. Returns Said or None."""
        self._taken = bool(taken)
        return self._decide(t)

    def update(self, t):
        """To be called often: what falls silent is noticed here. Returns Said or None."""
        return self._decide(t)

    def locked(self, t):
        """The priority below which nobody is heard at t (s)."""
        least = 0
        for lock in self.config.locks:
            if lock.priority > least and self._is_locked(t, lock):
                least = lock.priority
        return least

    def _is_locked(self, t, lock):
        locked, stamp = self._locks[lock.name]
        return locked or (lock.timeout > 0.0 and not t - stamp <= lock.timeout)

    def _driver(self, speaking, least):
        """Who may drive, of those that speak and whose priority is at least so much."""
        if self._taken:
            return ROBOT
        driver, highest = NOBODY, -1
        for source, heard in speaking:
            if source.priority >= least and source.priority > highest and not heard.barred:
                driver, highest = source.name, source.priority
        return driver

    def _decide(self, t):
        """Changes of the driver; returns what they say to the wheels, or None."""
        least = self.locked(t)
        speaking = [pair for pair in self._all if not _silent(t, *pair)]
        before, self.driver = self.driver, self._driver(speaking, least)
        self._bar(speaking, least)
        if self.driver == before:
            return None
        if self.driver in (NOBODY, ROBOT):
            return Said(0.0, 0.0, self.driver)
        heard = self._heard[self.driver]
        return Said(heard.v, heard.w, self.driver)

    def _bar(self, speaking, least):
        """Whoever wants to move and is not heard, for a driver or a lock of a higher priority, must come anew."""
        if self.driver in self._sources:
            least = max(least, self._sources[self.driver].priority)
        for source, heard in speaking:
            if (self._taken or source.priority < least) and (heard.v != 0.0 or heard.w != 0.0) and not heard.barred:
                heard.barred = True
                self._driven_out += (source.name,)


def _silent(t, source, heard):
    """Whether what a Source said last is too old at t (s), or from the future."""
    return not -AHEAD <= t - heard.stamp <= source.timeout
