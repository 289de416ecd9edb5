"""The last stops, and why."""

from __future__ import annotations

from collections import deque
from typing import Any

GRAVE = ('BRAKING', 'HELD', 'BLOCKED', 'MANUAL', 'FADING')
AGAIN_S = 30.0  # for which the same reason is the same stop


class History:
    """At most `most` entries, the newest last. Times: ms since 1970, as the page shows them."""

    def __init__(self, most: int) -> None:
        self._entries: deque[dict[str, Any]] = deque(maxlen=most)
        self._reason, self._at = '', 0.0

    def on_gate(self, t: float, state: str, reason: str) -> bool:
        """The safety gate's state at t (s since 1970); True where that is a new entry. One stop that is told in several
        states, as braking and then held, is one entry, and so is the same reason again within AGAIN_S.
        """
        if state not in GRAVE:
            return False
        again = reason == self._reason and 0.0 <= t - self._at < AGAIN_S
        self._reason, self._at = reason, t
        if again:
            return False
        self.add(t, f'state.{state}', {'reason': f'reason.{reason}'})
        return True

    def add(self, t: float, key: str, values: dict[str, Any]) -> None:
        """Another entry."""
        self._entries.append({'t': round(1000.0 * t), 'key': key, 'values': values})

    def frame(self) -> dict[str, Any]:
        """As a frame."""
        return {'op': 'history', 'list': list(self._entries)}
