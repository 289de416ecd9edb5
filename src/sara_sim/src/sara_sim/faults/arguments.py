"""The arguments of faults: what each of them may be, as fields of a dataclass."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import MISSING, field
from typing import Any

from sara_common.config import is_number


class FaultError(ValueError):
    """A fault that does not exist or whose arguments are not allowed; one sentence for each."""


def argument(allowed: str, check: Callable[[Any], bool], default: Any = MISSING) -> Any:
    """A field of a fault. `check`: whether a value is allowed; `allowed`: which are, in words."""
    return field(default=default, metadata={'allowed': allowed, 'check': check})


def between(low: float, high: float, what: str, default: Any = MISSING) -> Any:
    """A number; `what`: its unit."""
    return argument(
        f'a number from {low:g} to {high:g} ({what})', lambda value: is_number(value) and low <= value <= high, default
    )


def one_of(names: Sequence[str], default: Any = MISSING) -> Any:
    """One of these."""
    return argument('one of ' + ', '.join(names), lambda value: value in names, default)


def seconds(default: float = math.inf) -> Any:
    """A duration."""
    return argument(
        'seconds, more than 0 (none: until cleared)',
        lambda value: isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0,
        default,
    )


def whole(low: int, high: int, what: str, default: Any = MISSING) -> Any:
    """A whole number."""
    return argument(
        f'a whole number from {low} to {high} ({what})',
        lambda value: isinstance(value, int) and not isinstance(value, bool) and low <= value <= high,
        default,
    )
