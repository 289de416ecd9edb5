"""Frames that wait to be sent: bounded in number and in age, newest first in worth.

On a bus of commands the newest frame is the one that counts: a wheel speed of half a second ago must not be driven. So
a full queue drops its oldest frame, a frame that has waited too long is not sent, and what waits for an adapter that is
lost is discarded.
"""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable

from canserial.frame import Frame


class TransmitQueue:
    """A first-in first-out queue between the threads that ask and the one that sends.

    limit: frames it holds. max_age: s that a frame may wait. `epoch` changes with every discard(): a frame that was
    asked for or taken in an earlier epoch is not to be sent. Counters: `full` (oldest dropped), `too_old`, `discarded`.
    """

    def __init__(self, limit: int, max_age: float) -> None:
        self.limit, self.max_age = limit, max_age
        self.counters = Counter()
        self.epoch = 0
        self._frames = deque()
        self._changed = threading.Condition()

    def __len__(self) -> int:
        return len(self._frames)

    def put(self, frame: Frame, now: float, epoch: int) -> None:
        """Queue a frame of this epoch at the time `now` (s, of a clock that never jumps). A frame of an earlier one is
        discarded.
        """
        with self._changed:
            if epoch != self.epoch:
                self.counters['discarded'] += 1
                return
            if len(self._frames) >= self.limit:
                self._frames.popleft()
                self.counters['full'] += 1
            self._frames.append((now, frame))
            self._changed.notify()

    def take(self, clock: Callable[[], float], timeout: float) -> tuple[Frame | None, int]:
        """(the next frame that is not too old by `clock()` (s), epoch), or (None, epoch) after `timeout` (s)."""
        with self._changed:
            if not self._frames:
                self._changed.wait(timeout)
            while self._frames:
                queued, frame = self._frames.popleft()
                if clock() - queued <= self.max_age:
                    return frame, self.epoch
                self.counters['too_old'] += 1
            return None, self.epoch

    def discard(self) -> None:
        """Begin a new epoch: all that waits is discarded, because it cannot be sent any more."""
        with self._changed:
            self.epoch += 1
            self.counters['discarded'] += len(self._frames)
            self._frames.clear()
            self._changed.notify_all()
