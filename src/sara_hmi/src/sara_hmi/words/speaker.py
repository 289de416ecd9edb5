"""The chair's own voice: espeak-ng, where it is installed."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence


class Speaker:
    """Speaks one sentence at a time. command: the program and what it is told besides."""

    def __init__(self, command: Sequence[str] = ('espeak-ng',)) -> None:
        self._command = command
        self._speaking: subprocess.Popen | None = None

    @property
    def busy(self) -> bool:
        """Whether a sentence is not over yet."""
        return self._speaking is not None and self._speaking.poll() is None

    def say(self, language: str, sentence: str) -> bool:
        """Begin to say it, unless another sentence is not over yet: by then it would be old. False where the program is
        not there. The sentence goes by the program's input: whatever is in it, it is no option.
        """
        if self.busy:
            return True
        command = [*self._command, '-v', language, '--stdin']
        try:
            self._speaking = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
        except FileNotFoundError:
            return False
        with self._speaking.stdin as words:
            words.write(sentence.encode())
        return True
