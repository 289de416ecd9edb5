"""Time stamps as float seconds that remember their nanoseconds.

A float holds seconds since 1970 in steps of 0.24 us. That is enough for the filter, but not for a transform between two
samples 20 ms and some metres apart (a robot that was set to another place), where it is worth micrometres.
"""

from __future__ import annotations

import math


class Stamp(float):
    """Seconds as a float, with `nanoseconds` (int) beside it. Sums and differences are plain floats."""

    __slots__ = ('nanoseconds',)

    def __new__(cls, seconds: int, nanoseconds: int = 0):
        stamp = float.__new__(cls, seconds + 1e-9 * nanoseconds)
        stamp.nanoseconds = seconds * 10**9 + nanoseconds
        return stamp

    def __reduce__(self):
        return Stamp, divmod(self.nanoseconds, 10**9)


def nanoseconds(time: float) -> int:
    """The nanoseconds of a Stamp, those nearest to a plain float (s)."""
    if type(time) is Stamp:
        return time.nanoseconds
    whole = math.floor(time)
    return whole * 10**9 + round((time - whole) * 1e9)


def later(time: float, seconds: float) -> Stamp:
    """The time `seconds` (s) after `time` (s), exact to the nanosecond."""
    return Stamp(*divmod(nanoseconds(time) + round(seconds * 1e9), 10**9))
