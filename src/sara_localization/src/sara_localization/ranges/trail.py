"""Where dead reckoning has had the robot lately, for readings that come late."""

from __future__ import annotations

from collections import deque

from sara_common.planar import wrap_exact

MEMORY_S = 1.5
"""Of dead reckoning that is kept."""


class Trail:
    """Poses (x, y, yaw; m, rad) by their times (s), oldest first; `newest`: (time, pose), None before the first."""

    def __init__(self) -> None:
        self._kept: deque[tuple[float, tuple[float, float, float]]] = deque()

    @property
    def newest(self) -> tuple[float, tuple[float, float, float]] | None:
        """(time, pose) of the last that was added."""
        return self._kept[-1] if self._kept else None

    def add(self, stamp: float, pose: tuple[float, float, float]) -> None:
        """The robot is at a pose at a time later than all before."""
        self._kept.append((stamp, tuple(pose)))
        while self._kept[0][0] < stamp - MEMORY_S:
            self._kept.popleft()

    def clear(self) -> None:
        """Forget all of it."""
        self._kept.clear()

    def is_young(self, stamp: float) -> bool:
        """Whether a time is not remembered because there has not been anything to remember for long."""
        kept = self._kept
        return not kept or (stamp < kept[0][0] and kept[-1][0] - kept[0][0] < 0.9 * MEMORY_S)

    def at(self, stamp: float, tolerance: float) -> tuple[float, float, float] | None:
        """The pose at a time, the newest up to `tolerance` (s) later; None where that is not remembered."""
        kept = self._kept
        if not kept or stamp < kept[0][0] or stamp > kept[-1][0] + tolerance:
            return None
        for later in range(len(kept) - 1, -1, -1):
            if kept[later][0] <= stamp:
                break
        (t0, a) = kept[later]
        if later == len(kept) - 1:
            return a
        t1, b = kept[later + 1]
        share = (stamp - t0) / (t1 - t0)
        return (
            a[0] + share * (b[0] - a[0]),
            a[1] + share * (b[1] - a[1]),
            wrap_exact(a[2] + share * wrap_exact(b[2] - a[2])),
        )
