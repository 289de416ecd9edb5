"""Faults of a configuration: one sentence each, "NAME is VALUE, allowed are ...", all of them reported at once."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from typing import Any


class ConfigError(ValueError):
    """A configuration that cannot be used.

    faults: one sentence for each reason, or one as a string. warnings: sentences about what is doubtful besides. Both
    are kept as tuples; the error's text is the faults, joined by '; '.
    """

    def __init__(self, faults: str | Iterable[str], warnings: Iterable[str] = ()) -> None:
        self.faults = (faults,) if isinstance(faults, str) else tuple(faults)
        self.warnings = tuple(warnings)
        super().__init__('; '.join(self.faults))


def filled(cls: type, params: object) -> Any:
    """An object of a dataclass `cls` from a mapping of its fields, in which a list stands for a tuple. Raises
    ConfigError with every fault: names that it does not have, and what its own checks find.
    """
    if not isinstance(params, dict):
        raise ConfigError(f'{params!r} is given where a mapping of parameters is allowed')
    known = cls.__dataclass_fields__
    unknown = [f'{name} is {params[name]!r}, but there is no such parameter' for name in params if name not in known]
    try:
        made = cls(
            **{
                name: tuple(value) if isinstance(value, list) else value
                for name, value in params.items()
                if name in known
            }
        )
    except ConfigError as error:
        raise ConfigError([*unknown, *error.faults]) from None
    if unknown:
        raise ConfigError(unknown)
    return made


def is_number(value: object) -> bool:
    """Whether a value is a finite number that a float can hold; true and false are none, though Python counts with
    them.
    """
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def is_whole(value: object, low: float = -math.inf, high: float = math.inf) -> bool:
    """Whether a value is a whole number from `low` to `high`, both included; true and false are none."""
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def finite_numbers(text: str | None, count: int) -> list[float] | None:
    """Return the numbers of a text, such as an XML attribute; None where they are not `count` finite ones."""
    try:
        values = [float(word) for word in (text or '').split()]
    except ValueError:
        return None
    return values if len(values) == count and all(map(math.isfinite, values)) else None


def fault(config: object, name: str, allowed: str, prefix: str = '') -> str:
    """The sentence about the attribute `name` of `config`. allowed: 'are numbers above 0', 'is one name'."""
    return f'{prefix}{name} is {getattr(config, name)!r}, allowed {allowed}'


def number_faults(
    config: object, above_0: Iterable[str] = (), from_0: Iterable[str] = (), prefix: str = ''
) -> list[str]:
    """One sentence for each of these attributes that is not a number above 0, or not one of 0 or more. prefix: of the
    names in the sentences.
    """
    faults = [
        fault(config, name, 'are numbers above 0', prefix)
        for name in above_0
        if not (is_number(getattr(config, name)) and getattr(config, name) > 0)
    ]
    return faults + [
        fault(config, name, 'are numbers of 0 or more', prefix)
        for name in from_0
        if not (is_number(getattr(config, name)) and getattr(config, name) >= 0)
    ]


def range_faults(config: object, ranges: Mapping[str, tuple], prefix: str = '') -> list[str]:
    """One sentence for each attribute that is outside its range.

    ranges: {name: (low, high)}, both included, or {name: (low, high, True)}, where low itself is not allowed.
    """
    faults = []
    for name, (low, high, *open_below) in ranges.items():
        value, above = getattr(config, name), bool(open_below and open_below[0])
        if not (is_number(value) and low <= value <= high and not (above and value == low)):
            least = f'above {low:g}' if above else f'from {low:g}'
            faults.append(fault(config, name, f'are numbers {least} to {high:g}', prefix))
    return faults
