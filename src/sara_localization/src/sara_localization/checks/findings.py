"""Something to be mended in a configuration or in data, told in one sentence with its remedy."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from sara_common.config import ConfigError
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


def of_parameters(
    read: Callable[[dict[str, object]], Any],
    params: dict[str, object],
    doubtful: Callable[[Any], Iterable[tuple[bool, str, str]]],
) -> list[Finding]:
    """Everything found in a node's parameters. read: makes a configuration with `warnings` of them, or raises
    ConfigError; doubtful: (whether it applies, key, sentence) of what is probably not meant in it.
    """
    try:
        config = read(params)
    except ConfigError as refused:
        found = [error('configuration', sentence.rstrip('.') + '.') for sentence in refused.faults]
        return found + [warning('parameters', sentence) for sentence in refused.warnings]
    found = [warning('parameters', sentence) for sentence in config.warnings]
    return found + [warning(key, sentence) for applies, key, sentence in doubtful(config) if applies]


def sorted_findings(findings: list[Finding]) -> list[Finding]:
    """Errors first, each sentence once, in the order they were found."""
    unique = list(dict.fromkeys(findings))
    return sorted(unique, key=lambda finding: -finding.level)
