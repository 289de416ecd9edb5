"""Streams of random numbers, one for each source of chance: a change in one leaves the luck of the others alone."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, source: str, *numbers: int) -> np.random.Generator:
    """The stream of a seed for a source of chance by name, and by number where there are several."""
    return np.random.default_rng(np.random.SeedSequence([seed, zlib.crc32(source.encode()), *numbers]))
