"""What is published, as the master last said: asked in a thread of its own, for a busy master lets one wait."""

from __future__ import annotations

import threading
from collections.abc import Callable

Published = list[tuple[str, str]]
"""[(topic, type), ...]"""


class TopicWatch:
    """`ask` asks the master, and may take as long as it likes: whoever wants to know gets what was said the last time.

    Args:
        ask: returns [(topic, type), ...].
        period: s between two questions.
    """

    def __init__(self, ask: Callable[[], Published], period: float):
        self._ask, self._period = ask, period
        self._answer: Published | None = None
        self._asked_at: float | None = None
        self._asking: threading.Thread | None = None

    def published(self, now: float) -> Published | None:
        """What the master last said, None before its first answer; asks it anew where that was long ago. Never waits.

        now: s.
        """
        due = self._asked_at is None or not 0.0 <= now - self._asked_at < self._period
        if due and not (self._asking and self._asking.is_alive()):
            self._asked_at = now
            self._asking = threading.Thread(target=self._fetch, daemon=True)
            self._asking.start()
        return self._answer

    def _fetch(self) -> None:
        self._answer = self._ask()
