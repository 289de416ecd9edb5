"""Sums, angles and their cosines whose every digit depends on the numbers alone.

Where an array lies in memory decides how numpy takes the sine of a column, and how BLAS multiplies by a vector.
Their last digits differ, and what goes by them is not the same from one run to the next.
"""

from __future__ import annotations

import numpy as np


def cos_sin(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cosines and the sines of angles (rad, of any shape)."""
    angles = np.asarray(angles, order='C')
    return np.cos(angles), np.sin(angles)


def directions(steps: np.ndarray) -> np.ndarray:
    """(n,) the directions (rad) of steps (n, 2)."""
    x, y = np.ascontiguousarray(np.asarray(steps, float).T)
    return np.arctan2(y, x)


def weighted_sum(weights: np.ndarray, values: np.ndarray) -> float:
    """The sum of weights (n,) times values (n,)."""
    return float((weights * values).sum())


def times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """(n,) the product of a matrix (n, m) and a vector (m,)."""
    return (matrix * vector).sum(axis=1)
