"""Measurements in a row that the gate rejects: told in words when they begin, and when they are over."""

from __future__ import annotations

import math
from collections import Counter

from sara_localization.inputs.raw_measurement import Measurement

FEWEST = 2
"""In a row, until that is told: single ones are counted only, for chance alone makes some."""


class Outliers:
    """Of one input. what: how it is called in a sentence."""

    def __init__(self, what: str):
        self._what = what
        self._rows: Counter[str] = Counter()  # of each part of the input's messages
        self._since: dict[str, float] = {}

    @property
    def now(self) -> int:
        """How many have been rejected in a row until now."""
        return max(self._rows.values(), default=0)

    def judged(self, m: Measurement, taken: bool, nis: float) -> str | None:
        """A measurement was taken or rejected at the squared Mahalanobis distance nis; returns what there is to say."""
        if taken:
            row, since = self._rows.pop(m.source, 0), self._since.pop(m.source, m.stamp)
            if row < FEWEST:
                return None
            return f'{self._what}: taken again, after {row} outliers in {m.stamp - since:.1f} s'
        self._rows[m.source] += 1
        self._since.setdefault(m.source, m.stamp)
        if self._rows[m.source] != FEWEST:
            return None
        distance = math.sqrt(nis) if nis >= 0.0 else math.nan
        return f'{self._what}: outliers are rejected, {distance:.1f} sigmas off (the gate is {m.threshold:g})'
