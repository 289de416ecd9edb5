"""What a bench says (Timed), and what it means once the yardstick stands beside it (Row).

A figure that depends on how fast the machine is ("scaled") is compared in yardsticks of its own moment: at the peers'
speed it is ours / our yardstick x theirs, and the ratio to a peer is that by the peer's figure (for a rate, the other
way round), so that 1 is as good as the peer and 0.5 twice as good.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Clock = Callable[[], float]
"""Seconds, as time.process_time gives them."""

PEERS_YARDSTICK_MS = 121.0
"""The yardstick on the machine where the C++ peers were timed (data/peers_speed.json)."""


@dataclass(frozen=True)
class Limit:
    """A bound that a figure is to keep. of: "ratio", "median", "p99" or "memory" (MB); a rate ("median") has to reach
    it, all else not to exceed it.
    """

    of: str
    bound: float


@dataclass(frozen=True)
class Timed:
    """One figure: its unit, median and 99th percentile over `runs`.

    rate: more is better. scaled: it depends on how fast the machine is. peer: the C++ peer's figure. limit: a Limit.
    memory: MB at the most, of the process that was measured. text: what else there is to say; instead of figures where
    median is None (`skipped`).
    """

    name: str
    unit: str = ''
    median: float = None
    p99: float = None
    runs: int = 0
    rate: bool = False
    scaled: bool = True
    peer: float = None
    limit: Limit = None
    memory: float = None
    text: str = ''

    @property
    def skipped(self) -> bool:
        """Whether it could not be measured; `text` says why."""
        return self.median is None


def timed(name: str, unit: str, samples: np.ndarray | Sequence[float], **more) -> Timed:
    """A Timed of samples (n,)."""
    samples = np.asarray(samples, float)
    return Timed(
        name,
        unit,
        float(np.median(samples)),
        float(np.percentile(samples, 1.0 if more.get('rate') else 99.0)),
        len(samples),
        **more,
    )


@dataclass(frozen=True)
class Row(Timed):
    """A Timed with the yardstick (ms) `before` and `after` it in the same run; `bench`: the name that asks for it."""

    bench: str = ''
    before: float = PEERS_YARDSTICK_MS
    after: float = PEERS_YARDSTICK_MS

    @classmethod
    def of(cls, figure: Timed, bench: str, before: float, after: float) -> Row:
        """The Row of a Timed."""
        return cls(**vars(figure), bench=bench, before=before, after=after)

    @property
    def yardstick(self) -> float:
        """ms, of this moment."""
        return 0.5 * (self.before + self.after)

    def at_peers_speed(self, value: float | None) -> float | None:
        """A figure of this row on a machine as fast as the peers'."""
        if value is None or not self.scaled:
            return value
        factor = PEERS_YARDSTICK_MS / self.yardstick
        return value / factor if self.rate else value * factor

    @property
    def ratio(self) -> float | None:
        """To the peer; None without one."""
        if self.skipped or not self.peer:
            return None
        ours = self.at_peers_speed(self.median)
        return self.peer / ours if self.rate else ours / self.peer

    @property
    def met(self) -> bool | None:
        """Whether the limit is kept; None where there is none, or no figure."""
        if self.limit is None or self.skipped:
            return None
        value = {'ratio': self.ratio, 'memory': self.memory}.get(self.limit.of)
        if self.limit.of in ('median', 'p99'):
            value = self.at_peers_speed(getattr(self, self.limit.of))
        if value is None:
            return None
        return value >= self.limit.bound if self.rate and self.limit.of == 'median' else value <= self.limit.bound

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **vars(self),
            'limit': self.limit and vars(self.limit),
            'at_peers_speed': self.at_peers_speed(self.median),
            'ratio': self.ratio,
            'met': self.met,
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Row:
        """Of to_json()."""
        fields = {name: data.get(name) for name in cls.__dataclass_fields__ if name in data}
        return replace(cls(**fields), limit=Limit(**data['limit']) if data.get('limit') else None)
