"""The estimate over time as a table: CSV with everything, or TUM's format for trajectory tools (evo).

TUM (J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", 2012): one line per pose,
"timestamp tx ty tz qx qy qz qw", s, m and unit quaternion, separated by blanks.
"""

from __future__ import annotations

import csv
from typing import TextIO

import numpy as np

from sara_localization.filters.state import NAMES, SIZE
from sara_localization.inputs.data import FilterOutput

CSV_HEADER = ('stamp',) + NAMES + tuple('sigma_' + name for name in NAMES)


class CsvWriter:
    """One row per estimate: stamp, the 15 variables, their standard deviations; SI units and rad."""

    def __init__(self, file: TextIO):
        self._writer = csv.writer(file, lineterminator='\n')
        self._writer.writerow(CSV_HEADER)

    def write(self, output: FilterOutput) -> None:
        sigmas = np.sqrt(np.maximum(output.covariance.diagonal()[:SIZE], 0.0))
        self._writer.writerow(
            [f'{output.stamp:.9f}'] + [f'{v:.9g}' for v in output.state[:SIZE]] + [f'{s:.6g}' for s in sigmas]
        )


class TumWriter:
    """One line per pose."""

    def __init__(self, file: TextIO):
        self._file = file

    def write(self, output: FilterOutput) -> None:
        pose = output.pose
        numbers = [f'{v:.9f}' for v in (*pose.translation, *pose.rotation)]
        self._file.write('{:.9f} {}\n'.format(output.stamp, ' '.join(numbers)))


class Track:
    """What a plot needs of the estimate, kept as plain lists: t (s), (x, y, yaw), their standard deviations."""

    def __init__(self):
        self.t: list[float] = []
        self.pose: list[tuple] = []
        self.sigma: list[tuple] = []
        self.speed: list[tuple] = []

    def write(self, output: FilterOutput) -> None:
        x, variances = output.state, np.maximum(output.covariance.diagonal(), 0.0)
        self.t.append(output.stamp)
        self.pose.append((float(x[0]), float(x[1]), float(x[5])))
        self.sigma.append(tuple(np.sqrt(variances[[0, 1, 5]]).tolist()))
        self.speed.append((float(x[6]), float(x[11])))


class InputTrack:
    """The poses that an input gives, in its own frame: t (s), (x, y, yaw)."""

    def __init__(self, name: str):
        self.name = name
        self.t: list[float] = []
        self.pose: list[tuple] = []

    def add(self, stamp: float, x: float, y: float, yaw: float) -> None:
        self.t.append(stamp)
        self.pose.append((x, y, yaw))

    @property
    def array(self) -> np.ndarray | None:
        """(n, 4): t, x, y, yaw (not wrapped); None where nothing came."""
        if not self.t:
            return None
        return np.column_stack([self.t, self.pose])
