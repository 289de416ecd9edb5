"""What waits for one client: answers in their order, and of everything else only the newest.

A slow client gets fewer states, never older ones, and holds up nobody.
"""

from __future__ import annotations

from collections import deque
from typing import Any

ORDER = ('driver', 'state', 'places', 'edits', 'history', 'plan', 'ranges', 'map')


class Outbox:
    """At most `urgent` answers, and one frame of each kind in ORDER."""

    def __init__(self, urgent: int) -> None:
        self._most = urgent
        self._urgent: deque[Any] = deque()
        self._newest: dict[str, Any] = {}
        self.dropped = 0

    def answer(self, frame: Any) -> bool:
        """A frame that must arrive; False where too many wait already."""
        if len(self._urgent) >= self._most:
            return False
        self._urgent.append(frame)
        return True

    def put(self, kind: str, frame: Any) -> None:
        """A frame that replaces an older one of its kind."""
        self.dropped += kind in self._newest
        self._newest[kind] = frame

    def take(self, urgent_only: bool = False) -> Any | None:
        """The next frame, None where nothing waits."""
        if self._urgent:
            return self._urgent.popleft()
        if urgent_only:
            return None
        return next((self._newest.pop(kind) for kind in ORDER if kind in self._newest), None)

    def __len__(self) -> int:
        return len(self._urgent) + len(self._newest)
