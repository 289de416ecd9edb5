"""The catalogue of sentences, for what the chair speaks itself."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

_VALUE = re.compile(r'\{(\w+)\}')


class Catalogue:
    """{key: sentence} of one language."""

    def __init__(self, sentences: Mapping[str, str]) -> None:
        self._sentences = sentences

    @classmethod
    def load(cls, folder: Path, language: str) -> Catalogue | None:
        """Of folder/LANGUAGE.json; None where there is none."""
        path = folder / f'{language}.json'
        return cls(json.loads(path.read_text(encoding='utf-8'))) if path.is_file() else None

    def __contains__(self, key: str) -> bool:
        return key in self._sentences

    def say(self, key: str, values: Mapping[str, object]) -> str | None:
        """The sentence of a key with its values put in; a value that is itself a key is put in as its sentence. None
        where there is no such key.
        """
        if key not in self._sentences:
            return None

        def put(match: re.Match) -> str:
            value = str(values.get(match.group(1), ''))
            return self._sentences.get(value, value)

        return _VALUE.sub(put, self._sentences[key])
