"""Measurements that the gate rejects: rows of them are told in words when they begin and when they are over, the last
one of all, were it single, by `account`.
"""

from __future__ import annotations

import math
from collections import Counter

from sara_localization.inputs.raw_measurement import Measurement

FEWEST = 2
"""In a row, until that is told: chance alone makes single ones."""


class Outliers:
    """Of one input. what: how it is called in a sentence. `told`: how many rows have been told."""

    def __init__(self, what: str):
        self._what = what
        self._rows: Counter[str] = Counter()  # of each part of the input's messages
        self._since: dict[str, float] = {}
        self._last: tuple[float, float] | None = None  # stamp (s) and distance (sigmas)
        self.told = 0

    @property
    def now(self) -> int:
        """How many have been rejected in a row until now."""
        return max(self._rows.values(), default=0)

    def account(self, now: float) -> str:
        """Of the last one, at the time `now` (s): "the last 3.2 s ago, 5.1 sigmas off"; '' before any."""
        if self._last is None:
            return ''
        stamp, distance = self._last
        row = f', {self.now} in a row until now' if self.now else ''
        return f'the last {max(0.0, now - stamp):.1f} s ago, {distance:.1f} sigmas off{row}'

    def judged(self, m: Measurement, taken: bool, nis: float) -> str | None:
        """A measurement was taken or rejected at the squared Mahalanobis distance nis; returns what there is to say."""
        if taken:
            row, since = self._rows.pop(m.source, 0), self._since.pop(m.source, m.stamp)
            if row < FEWEST:
                return None
            return f'{self._what}: taken again, after {row} outliers in {m.stamp - since:.1f} s'
        self._rows[m.source] += 1
        self._since.setdefault(m.source, m.stamp)
        distance = math.sqrt(nis) if nis >= 0.0 else math.nan
        self._last = m.stamp, distance
        if self._rows[m.source] != FEWEST:
            return None
        self.told += 1
        return f'{self._what}: outliers are rejected, {distance:.1f} sigmas off (the gate is {m.threshold:g})'
