"""What became of the messages of each input: counted, said once per kind, and put into one line for the user."""

from __future__ import annotations

import math
from collections import Counter

from sara_localization.inputs.outliers import Outliers

NIS_MEMORY = 100


class InputStatus:
    """The account of one input (odom0 on its topic)."""

    def __init__(self, name: str, topic: str):
        self.name, self.topic = name, topic
        self.received = self.used = self.rejected = 0
        self.problems = Counter()
        self.missing: str | None = None
        self.missing_since = 0.0
        self.last_stamp: float | None = None
        self.nis = self.dof = 0.0
        self.outliers = Outliers(f'{name} ({topic})')
        self._said = set()

    def lacks(self, sentence: str, stamp: float) -> str | None:
        """A transform is missing; returns the sentence the first time this one is."""
        self.problems['no_transform'] += 1
        if self.missing != sentence:
            self.missing, self.missing_since = sentence, stamp
        return self._once('no_transform ' + sentence, f'{self.name}: data dropped, {sentence}')

    def has_problem(self, kind: str, sentence: str) -> str | None:
        """Something was wrong with a message; returns a sentence the first time this kind of thing is."""
        self.problems[kind] += 1
        return self._once(kind, f'{self.name} ({self.topic}): {sentence}')

    def took(self, taken: bool, nis: float, dof: int) -> None:
        """A measurement of `dof` variables was used or rejected by the gate, at the squared Mahalanobis distance
        nis.
        """
        if taken:
            self.used += 1
        else:
            self.rejected += 1
        weight = 1.0 / min(self.used + self.rejected, NIS_MEMORY)
        self.nis += (nis - self.nis) * weight
        self.dof += (dof - self.dof) * weight

    @property
    def consistency(self) -> float:
        """Mean NIS per measured variable over the last hundred or so: about 1 where the variances are honest, larger
        where the input (or the filter) claims to know more than it does, NaN before any.
        """
        return self.nis / self.dof if self.dof else math.nan

    def _once(self, key, sentence):
        if key in self._said:
            return None
        self._said.add(key)
        return sentence

    @property
    def healthy(self) -> bool:
        return self.used > 0 and self.missing is None

    def line(self, now: float) -> str:
        """E.g. "imu0 (/imu/data): 0 used, 213 dropped: no transform imu_link -> base_link for 4.2 s"."""
        if not self.received:
            return f'{self.name}: nothing received on {self.topic} yet'
        text = f'{self.name} ({self.topic}): {self.used} used'
        if self.rejected:
            text += f', {self.rejected} rejected by the gate ({self.outliers.account(now)})'
        dropped = [f'{count} {kind}' for kind, count in sorted(self.problems.items()) if kind != 'no_transform']
        if dropped:
            text += ', problems: ' + ', '.join(dropped)
        if self.problems['no_transform']:
            text += f', {self.problems["no_transform"]} dropped: '
            text += (
                f'{self.missing} for {max(0.0, now - self.missing_since):.1f} s'
                if self.missing
                else 'a transform was missing before'
            )
        return text
