"""Random scans, where scanners sit, and maps: what drivers and users get wrong."""

from __future__ import annotations

import math

import numpy as np

from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.ranges.range_data import RangeMap

WEIRD = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-320, 1e-30, 1e15, -1e15, 1e300, -1e300, -1.0)
FRAMES = ('laser', 'rear', '')


def number(rng: np.random.Generator, size: float, weird: float = 0.02) -> float:
    """A number of about that size; some are WEIRD."""
    return float(WEIRD[rng.integers(len(WEIRD))]) if rng.random() < weird else float(rng.normal() * size)


def random_sweep(rng: np.random.Generator) -> Sweep:
    """A scan of up to 60 rays; some have odd ranges, or limits that are none."""
    n = int(rng.choice([0, 1, 2, 3, 17, 60]))
    ranges = rng.uniform(0.0, 4.0, n)
    odd = rng.random(n) < rng.choice([0.0, 0.1, 1.0])
    ranges[odd] = rng.choice(WEIRD, np.count_nonzero(odd))
    increment = 0.1
    values = [1.0, -3.0, -3.0 + increment * (n - 1), increment, 0.0, 0.1, 3.9]
    if rng.random() < 0.1:
        values[rng.integers(len(values))] = WEIRD[rng.integers(len(WEIRD))]
    return Sweep(*values, ranges)


def random_mount(rng: np.random.Generator) -> Transform:
    """Where a scanner sits on the robot; some lean."""
    return Transform() if rng.random() < 0.5 else random_transform(rng, 0.3)


def random_transform(rng: np.random.Generator, size: float) -> Transform:
    """A pose about so many metres off; some are tilted, or none."""
    x, y, z = (number(rng, size, 0.005) for _ in range(3))
    tilt = rng.normal(size=2) * (0.05 if rng.random() < 0.9 else 2.0)
    return Transform.from_xyz_rpy(x, y, z, *tilt.tolist(), number(rng, 2.0, 0.002) % 1e3)


def random_map(rng: np.random.Generator) -> RangeMap | None:
    """A map of up to 60 x 60 cells, hardly like a house; None where what came is none."""
    rows, columns = rng.choice([0, 1, 2, 7, 40, 60], 2)
    cells = rng.choice(np.array([0, 0, 0, 0, 100, -1, 50, 101, -128], np.int8), (rows, columns))
    if rng.random() < 0.2:
        cells[:] = rng.choice([0, 100, -1])
    resolution = 0.1 if rng.random() < 0.9 else WEIRD[rng.integers(len(WEIRD))]
    try:
        return RangeMap.from_occupancy(cells, resolution, tuple(number(rng, 2.0, 0.01) for _ in range(3)), 65)
    except ValueError:
        return None
