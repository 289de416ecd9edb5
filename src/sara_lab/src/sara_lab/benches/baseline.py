"""What got slower since the baseline (docs/bench.json): compared in yardsticks where a figure depends on the machine's
speed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sara_lab.benches.timed import Row

TOLERANCE = 0.3
"""A figure may be worse by this share before it is named: medians in yardsticks come out within 20 % of each other on a
noisy machine.
"""


@dataclass(frozen=True)
class Slower:
    """A figure that got worse by `factor`; what: "median" or "memory"."""

    name: str
    what: str
    before: float
    now: float
    factor: float

    def __str__(self):
        return (
            f'{self.name}: {self.what} {self.now:.3g}, was {self.before:.3g} ({self.factor:.2f} times; both at the '
            "peers' speed)"
        )


def slower(rows: Iterable[Row], baseline: dict[str, dict], tolerance: float = TOLERANCE) -> list[str]:
    """The Slower of rows against the baseline's rows of the same name."""
    known, found = {row.name: row for row in baseline if not row.skipped}, []
    for row in rows:
        old = known.get(row.name)
        if old is None or row.skipped:
            continue
        before, now = old.at_peers_speed(old.median), row.at_peers_speed(row.median)
        pairs = [('median', before, now, before / now if row.rate else now / before)] if before and now else []
        if old.memory and row.memory:
            pairs.append(('memory', old.memory, row.memory, row.memory / old.memory))
        found += [
            Slower(row.name, what, was, is_, factor) for what, was, is_, factor in pairs if factor > 1.0 + tolerance
        ]
    return found


def missing(rows: Iterable[Row], baseline: dict[str, dict]) -> list[str]:
    """Names that the baseline has and the rows have not, or that are skipped now."""
    measured = {row.name for row in rows if not row.skipped}
    return [row.name for row in baseline if not row.skipped and row.name not in measured]
