"""What nodes say of themselves on /diagnostics, as plain data (sara_common.ros.diagnostics publishes it)."""

from __future__ import annotations

from typing import NamedTuple

OK, WARN, ERROR = 0, 1, 2
"""Levels, as of diagnostic_msgs/DiagnosticStatus."""


class Status(NamedTuple):
    """One diagnostic_msgs/DiagnosticStatus without ROS. level: OK, WARN or ERROR. values: (key, value) pairs."""

    name: str
    level: int
    message: str
    values: tuple[tuple[str, str], ...]
