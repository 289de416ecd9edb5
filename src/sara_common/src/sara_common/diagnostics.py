"""What nodes say of themselves on /diagnostics, as plain data (sara_common.ros.diagnostics publishes it)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

OK, WARN, ERROR = 0, 1, 2
"""Levels, as of diagnostic_msgs/DiagnosticStatus."""


class Status(NamedTuple):
    """One diagnostic_msgs/DiagnosticStatus without ROS. level: OK, WARN or ERROR. values: (key, value) pairs."""

    name: str
    level: int
    message: str
    values: tuple[tuple[str, str], ...]


def new_faults(counts: Mapping[str, int], before: Mapping[str, int], kinds: Iterable[str]) -> str:
    """The sentence on what of `kinds` has been counted since `before`, '' where nothing has."""
    new = [f'{kind} {counts[kind]}' for kind in kinds if counts[kind] > before.get(kind, 0)]
    return 'data are faulty: ' + ', '.join(new) if new else ''
