"""What a part of the campaign is, and how its figures are shown."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Figures = dict[str, Any]
"""Plain data for the JSON: numbers, spreads, or figures of a group."""


@dataclass(frozen=True)
class Part:
    """`cases`: {name: function without arguments that gives a dict with `faults`}. `summary`: (results) -> (lines,
    figures). `verdict`: (figures) -> sentences: what does not hold of all cases together.
    """

    cases: dict[str, Callable[[], dict]]
    summary: Callable[[Sequence[dict]], tuple[list[str], Figures]]
    verdict: Callable[[Figures], list[str]] = lambda figures: []


def spread(values: Iterable[float]) -> dict[str, float]:
    """{median, p95, worst} of numbers."""
    return {'median': float(np.median(values)), 'p95': float(np.percentile(values, 95)), 'worst': float(np.max(values))}


def mean(values: Sequence[float]) -> float:
    """The mean; NaN where there is nothing."""
    return float(np.mean(values)) if values else math.nan


def lines_of(figures: Figures) -> list[str]:
    """A line for each figure."""
    return [
        f'{name:26} '
        + (
            ', '.join(f'{key} {number:.3f}' for key, number in value.items())
            if isinstance(value, dict)
            else f'{value:g}'
        )
        for name, value in figures.items()
    ]
