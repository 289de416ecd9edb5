"""The chair's own voice: espeak-ng, where it is installed."""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Sequence

MOST = 4
"""Sentences that wait."""


class Speaker:
    """Speaks one sentence at a time. command: the program and what it is told besides."""

    def __init__(self, command: Sequence[str] = ('espeak-ng',)) -> None:
        self._command = command
        self._speaking: subprocess.Popen | None = None
        self._waiting: list[tuple[str, str]] = []
        self._lock = threading.Lock()

    @property
    def busy(self) -> bool:
        """Whether a sentence is not over yet."""
        return self._speaking is not None and self._speaking.poll() is None

    def say(self, language: str, sentence: str, asked: bool = False) -> bool:
        """Begin to say it, unless another sentence is not over yet: by then it would be old, and only what somebody has
        `asked` for is said afterwards. False where the program is not there.
        """
        with self._lock:
            if not (self.busy or self._waiting):
                return self._begin(language, sentence)
            if asked and (language, sentence) not in self._waiting and len(self._waiting) < MOST:
                self._waiting.append((language, sentence))
                if len(self._waiting) == 1:
                    threading.Thread(target=self._go_on, daemon=True).start()
            return True

    def _begin(self, language, sentence):
        """The sentence goes by the program's input: whatever is in it, it is no option."""
        command = [*self._command, '-v', language, '--stdin']
        try:
            self._speaking = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
        except FileNotFoundError:
            return False
        with self._speaking.stdin as words:
            words.write(sentence.encode())
        return True

    def _go_on(self):
        """Say what waits, one after the other."""
        while True:
            self._speaking.wait()
            with self._lock:
                self._begin(*self._waiting.pop(0))
                if not self._waiting:
                    return
