"""Taking parameters one by one out of a dictionary, typed and checked; what is wrong is collected, what is left over is
known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sara_common.config import ConfigError
from sara_localization.filters.state import NAMES, SIZE


def as_number(value: object) -> float | None:
    """A float from a number or from a string such as '1e-9' (YAML 1.1 takes 1e-9 for a string), else None."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    try:
        return float(value)
    except ValueError:
        return None


def as_bool(value: object) -> bool | None:
    """True or False from a bool, 0 or 1, or those words in a string, else None."""
    if isinstance(value, str):
        return {'true': True, 'false': False}.get(value.lower())
    return bool(value) if value in (0, 1) and isinstance(value, (bool, int)) else None


def as_numbers(value: object) -> list[float] | None:
    """A list of finite floats from a list (of lists) of numbers, else None."""
    if not isinstance(value, (list, tuple)):
        return None
    if value and all(isinstance(row, (list, tuple)) for row in value):
        value = [number for row in value for number in row]
    numbers = [as_number(v) for v in value]
    return numbers if all(n is not None and math.isfinite(n) for n in numbers) else None


def load(path: str | Path) -> dict[str, object]:
    """The parameters of a YAML file; one level of a node's name around them is taken off. Raises ConfigError."""
    try:
        params = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        raise ConfigError(f'{path} cannot be read: {error}') from error
    if isinstance(params, dict) and len(params) == 1 and isinstance(next(iter(params.values())), dict):
        params = next(iter(params.values()))
    if not isinstance(params, dict):
        raise ConfigError(f'{path} must hold parameters by name')
    return params


class ParameterReader:
    """`left`: what was not asked for; `known`: all names asked for; `faults`, `warnings`: sentences."""

    def __init__(self, params):
        self.left = dict(params)
        self.known, self.faults, self.warnings = [], [], []

    def take(self, name: str, default: object = None) -> object:
        self.known.append(name)
        return self.left.pop(name, default)

    def number(self, name: str, default: float, low: float | None = None, above: float | None = None) -> float:
        value = self.take(name, default)
        result = as_number(value)
        if result is None or not math.isfinite(result):
            self.faults.append(f'{name} is {value!r}, allowed is a number')
            return default
        if (low is not None and result < low) or (above is not None and result <= above):
            allowed = f'of {low:g} or more' if low is not None else f'above {above:g}'
            self.faults.append(f'{name} is {result:g}, allowed are numbers {allowed}')
            return default
        return result

    def whole(self, name: str, default: int) -> int:
        value = self.number(name, default)
        if value != int(value):
            self.faults.append(f'{name} is {value:g}, allowed are whole numbers')
            return default
        return int(value)

    def by_defaults(
        self, config_class: Any, frames: Sequence[str] = (), apart: Sequence[str] = ()
    ) -> dict[str, object]:
        """{name: value} of a dataclass's fields, by what their defaults are: frames, booleans, whole numbers, numbers.
        apart: names that are read otherwise.
        """
        values: dict[str, object] = {}
        for f in fields(config_class):
            if f.name in apart:
                continue
            if f.name in frames:
                values[f.name] = self.frame(f.name, f.default)
            elif isinstance(f.default, bool):
                values[f.name] = self.boolean(f.name, f.default)
            elif isinstance(f.default, int):
                values[f.name] = self.whole(f.name, f.default)
            elif isinstance(f.default, float):
                values[f.name] = self.number(f.name, f.default)
        return values

    def boolean(self, name: str, default: bool) -> bool:
        value = self.take(name, default)
        result = as_bool(value)
        if result is None:
            self.faults.append(f'{name} is {value!r}, allowed are true and false')
            return default
        return result

    def choice(self, name: str, allowed: tuple[str, ...]) -> str:
        """One of the words in `allowed`, the first by default. YAML's off is False: it stands for the word off."""
        value = self.take(name, allowed[0])
        value = 'off' if value is False and 'off' in allowed else value
        if value not in allowed:
            self.faults.append('{} is {!r}, allowed are {}'.format(name, value, ', '.join(allowed)))
            return allowed[0]
        return value

    def frame(self, name: str, default: str, prefix: str = '') -> str:
        value = self.take(name, default)
        if not isinstance(value, str) or not value.strip('/'):
            self.faults.append(f'{name} is {value!r}, allowed is the name of a frame')
            return default
        value = value.lstrip('/')
        return value if not prefix or value.startswith(prefix + '/') else f'{prefix}/{value}'

    def file(self, name: str, default: str) -> str:
        """The name of a file."""
        value = self.take(name, default)
        if not isinstance(value, str) or not value:
            self.faults.append(f'{name} is {value!r}, allowed is the name of a file')
            return default
        return value

    def topics(self, name: str, least: int = 0) -> tuple[str, ...]:
        """Names of topics, each once; `least`: how many there must be, 0 or 1."""
        value = self.take(name, [])
        if (
            not isinstance(value, (list, tuple))
            or len(value) < least
            or not all(isinstance(topic, str) and topic for topic in value)
            or len(set(value)) < len(value)
        ):
            wanted = 'one topic or more' if least else 'topics'
            self.faults.append(f'{name} is {value!r}, allowed is a list of {wanted}, each once')
            return ()
        return tuple(value)

    def numbers(self, name: str, size: int, default: Sequence[float], low: float | None = None) -> Sequence[float]:
        """A tuple of `size` finite numbers."""
        value = self.take(name)
        if value is None:
            return default
        result = as_numbers(value)
        if result is None or len(result) != size or (low is not None and min(result) < low):
            allowed = '' if low is None else f' of {low:g} or more'
            self.faults.append(f'{name} is {value!r}, allowed is a list of {size} finite numbers{allowed}')
            return default
        return tuple(result)

    def vector(self, name: str, default: np.ndarray) -> np.ndarray:
        value = self.take(name)
        if value is None:
            return np.array(default, dtype=float)
        numbers = as_numbers(value)
        if numbers is None or len(numbers) != SIZE:
            held = f'a list of {len(value)}' if isinstance(value, (list, tuple)) else repr(value)
            self.faults.append(f'{name} is {held}, allowed is a list of 15 finite numbers ({" ".join(NAMES)})')
            return np.array(default, dtype=float)
        return np.array(numbers)

    def covariance(
        self, name: str, size: int, default: np.ndarray | None = None, positive: bool = False
    ) -> np.ndarray | None:
        """A (size, size) covariance from size*size numbers or its diagonal; positive: every variance above 0."""
        value = self.take(name)
        if value is None:
            return default
        numbers = as_numbers(value)
        if numbers is None or len(numbers) not in (size, size * size):
            held = f'a list of {len(value)}' if isinstance(value, (list, tuple)) else repr(value)
            self.faults.append(
                f'{name} is {held}, allowed is a list of {size * size} finite numbers, row by row, or of {size}, its '
                'diagonal'
            )
            return default
        matrix = np.diag(numbers) if len(numbers) == size else np.reshape(numbers, (size, size))
        if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
            self.faults.append(f'{name} is not symmetric')
        elif np.linalg.eigvalsh(matrix).min() < -1e-12 * max(1.0, np.abs(matrix).max()):
            self.faults.append(f'{name} is not positive semidefinite: no noise has such a covariance')
        elif positive and matrix.diagonal().min() <= 0.0:
            self.faults.append(f'{name} holds a variance of {matrix.diagonal().min():g}, allowed are variances above 0')
        return matrix

    def flags(self, name: str, size: int, names: str) -> tuple[bool, ...] | None:
        """A tuple of `size` booleans, None where there is none (and that is a fault)."""
        value = self.take(name)
        if value is None:
            self.faults.append(f'{name} is missing: list for the {size} variables ({names}) which of them to use')
            return None
        flags = [as_bool(v) for v in value] if isinstance(value, (list, tuple)) else [None]
        if len(flags) != size or None in flags:
            self.faults.append(
                f'{name} is a list of {len(flags)}, allowed is a list of {size} times true or false ({names})'
            )
            return None
        return tuple(flags)
