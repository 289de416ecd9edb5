"""Something to be mended in a configuration or in data, told in one sentence with its remedy."""

from __future__ import annotations

from typing import NamedTuple

from sara_common.diagnostics import ERROR, WARN


class Finding(NamedTuple):
    """Something to be mended: its level (diagnostics.WARN or ERROR), what it is about, and a sentence with the
    remedy.
    """

    level: int
    key: str
    sentence: str


def warning(key: str, sentence: str) -> Finding:
    """A finding that does not keep the filter from its work."""
    return Finding(WARN, key, sentence)


def error(key: str, sentence: str) -> Finding:
    """A finding with which the filter does not do its work."""
    return Finding(ERROR, key, sentence)


def sorted_findings(findings: list[Finding]) -> list[Finding]:
    """Errors first, each sentence once, in the order they were found."""
    unique = list(dict.fromkeys(findings))
    return sorted(unique, key=lambda finding: -finding.level)
