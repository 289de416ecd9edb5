"""Which way the walls of a building face whose walls are square to each other."""

from __future__ import annotations

import math

import numpy as np


def heading_of(directions: np.ndarray, weights: np.ndarray | float = 1.0) -> complex:
    """The sum of weights along four times the directions (n,), rad: quarter turns are the same to it."""
    return complex((weights * np.exp(4j * directions)).sum())


def squared(angles: np.ndarray | float, heading: complex) -> np.ndarray | float:
    """Angles (rad) turned, by 45 deg at most, to along or across a heading_of walls; as they are where that is 0."""
    return angles + 0.25 * np.angle(heading * np.exp(-4j * angles))


def square_off(angle: float | np.ndarray) -> float | np.ndarray:
    """rad off the nearest multiple of a right angle."""
    return angle - 0.5 * math.pi * np.round(angle / (0.5 * math.pi))
