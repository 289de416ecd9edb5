"""What a part of the campaign is, and how its figures are told."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Part:
    """`cases`: {name: function without arguments that gives a dict with `faults`}. `summary`: (results) -> (lines,
    figures).
    `verdict`: (figures) -> sentences: what does not hold of all cases together.
    """

    cases: dict
    summary: object
    verdict: object = lambda figures: []


def spread(values):
    """{median, p95, worst} of numbers."""
    return {'median': float(np.median(values)), 'p95': float(np.percentile(values, 95)), 'worst': float(np.max(values))}


def lines_of(figures):
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
