"""The last stops, and why."""

from __future__ import annotations

from collections import deque
from typing import Any

GRAVE = ('BRAKING', 'HELD', 'BLOCKED', 'MANUAL', 'FADING')


class History:
    """At most `most` entries, the newest last. Times: ms since 1970, as the page shows them."""

    def __init__(self, most: int) -> None:
        self._entries: deque[dict[str, Any]] = deque(maxlen=most)
        self._reason = ''

    def on_gate(self, t: float, state: str, reason: str) -> bool:
        """The safety gate's state at t (s since 1970); True where that is a new entry. One stop that is told in several
        states, as braking and then held, is one entry.
        """
        if state not in GRAVE:
            if state != 'WAITING':
                self._reason = ''
            return False
        if reason == self._reason:
            return False
        self._reason = reason
        self.add(t, f'state.{state}', {'reason': f'reason.{reason}'})
        return True

    def add(self, t: float, key: str, values: dict[str, Any]) -> None:
        """Another entry."""
        self._entries.append({'t': round(1000.0 * t), 'key': key, 'values': values})

    def frame(self) -> dict[str, Any]:
        """As a frame."""
        return {'op': 'history', 'list': list(self._entries)}
