"""How far estimated poses are off relations between true ones (Kuemmerle et al. 2009, On measuring the accuracy of SLAM
algorithms).

A relation says where the robot was at one time in the frame of where it was at another. The error of an estimate is the
mean, over the relations, of how far the same relation of the estimated poses is off: in translation and in rotation. So
it does not depend on where the map's origin lies, nor does one error early on count for all that follows.
"""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap
from sara_common.repeatable import cos_sin
from sara_slam.logs.records import LogError

COINCIDENT = 0.006
"""s that a relation may lie outside of a track's time."""
STEPS = 0.05, 0.01, 0.002, 0.0005
"""s in which the offset of the two clocks is searched."""
LONGEST = 1e5
"""s by which relations and log may reach further than each other; more is a time that is damaged."""


class Relations(NamedTuple):
    """first, second: (n,) stamps, s; poses: (n, 3) x, y, yaw of the second in the frame of the first, m and rad."""

    first: np.ndarray
    second: np.ndarray
    poses: np.ndarray


class Track(NamedTuple):
    """Poses (n, 3) x, y, yaw by their stamps (n,), which do not fall."""

    stamps: np.ndarray
    poses: np.ndarray

    @classmethod
    def of(cls, stamps: np.ndarray, poses: np.ndarray) -> Track:
        """From poses in any order; of equal stamps the first stands first."""
        order = np.argsort(stamps, kind='stable')
        return cls(np.asarray(stamps, float)[order], np.asarray(poses, float)[order])

    def at(self, times: np.ndarray) -> np.ndarray:
        """(m, 3) poses at times (m,), evenly between the poses before and after."""
        after = np.searchsorted(self.stamps, times).clip(1, len(self.stamps) - 1)
        gap = self.stamps[after] - self.stamps[after - 1]
        with np.errstate(divide='ignore', invalid='ignore'):
            share = np.where(gap > 0.0, (times - self.stamps[after - 1]) / gap, 0.0).clip(0.0, 1.0)[:, None]
        begin, step = self.poses[after - 1], self.poses[after] - self.poses[after - 1]
        step[:, 2] = wrap(step[:, 2])
        return begin + share * step


class Score(NamedTuple):
    """Mean and standard deviation of the errors over `relations`: of translation (m) and of rotation (deg); offset: s
    that the relations' clock is ahead of the log's.
    """

    translation: float
    translation_sigma: float
    rotation: float
    rotation_sigma: float
    relations: int
    offset: float


def read_relations(path: str | Path) -> Relations:
    """Lines `t1 t2 x y z roll pitch yaw`, plain or gzip. Raises LogError, OSError."""
    with open(path, 'rb') as stream:
        data = stream.read()
    try:
        text = (gzip.decompress(data) if data[:2] == b'\x1f\x8b' else data).decode()
        rows = np.array([[float(word) for word in line.split()] for line in text.splitlines() if line.strip()])
    except (OSError, EOFError, ValueError, zlib.error) as error:
        raise LogError(f'{path} holds no relations: {error}') from None
    if rows.ndim != 2 or rows.shape[1] != 8 or not np.isfinite(rows).all():
        raise LogError(f'{path} holds no relations: each line must be "t1 t2 x y z roll pitch yaw"')
    return Relations(rows[:, 0], rows[:, 1], rows[:, [2, 3, 7]])


def relation_of(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(n, 3) the poses `second` (n, 3) in the frames of the poses `first` (n, 3)."""
    c, s = cos_sin(first[:, 2])
    dx, dy = second[:, 0] - first[:, 0], second[:, 1] - first[:, 1]
    return np.stack((c * dx + s * dy, -s * dx + c * dy, wrap(second[:, 2] - first[:, 2])), 1)


def relations_of(track: Track, reach: float = 20) -> Relations:
    """Relations of a reference: each pose with the next and with the one `reach` poses later."""
    pairs = [(i, j) for i in range(len(track.stamps)) for j in (i + 1, i + int(reach)) if j < len(track.stamps)]
    first, second = np.array(pairs).T
    return Relations(track.stamps[first], track.stamps[second], relation_of(track.poses[first], track.poses[second]))


def clock_offset(relations: Relations, track: Track) -> float:
    """s to take off the relations' times to have the track's: of those with which all relations lie within it, the one
    with the least median error, found in finer and finer STEPS. The relations' clock may have begun at another time.
    Raises LogError where these times cannot be of one drive.
    """
    low = max(relations.first.max(), relations.second.max()) - track.stamps[-1]
    high = min(relations.first.min(), relations.second.min()) - track.stamps[0]
    if abs(high - low) > LONGEST:
        raise LogError(f'relations and log differ by {abs(high - low):.3g} s in how long they are: a time is damaged')
    low, high = min(low, high) - STEPS[0], max(low, high) + STEPS[0]
    for step in STEPS:
        offsets = np.arange(low, high + step, step)
        best = min(offsets, key=lambda offset: _misfit(track, relations, offset))
        low, high = best - step, best + step
    return float(best)


def _misfit(track, relations, offset):
    """Median error of rotation (rad) plus that of translation (m); infinite where a tenth of the relations does not lie
    within the track's time.
    """
    inside, off = _errors(track, relations, offset)
    if inside < 0.9 * len(relations.first):
        return np.inf
    return float(np.median(np.abs(off[:, 2])) + np.median(np.hypot(off[:, 0], off[:, 1])))


def _errors(track, relations, offset):
    """(number of relations within the track's time, (n, 3) how far it is off these)."""
    first, second = relations.first - offset, relations.second - offset
    low, high = track.stamps[0] - COINCIDENT, track.stamps[-1] + COINCIDENT
    inside = (np.minimum(first, second) >= low) & (np.maximum(first, second) <= high)
    found = relation_of(track.at(first[inside]), track.at(second[inside]))
    return int(inside.sum()), relation_of(relations.poses[inside], found)


def score(track: Track, relations: Relations, offset: float | None = None) -> Score:
    """How far a track is off the relations that lie within its time; offset as of `clock_offset`, found where None.

    Raises LogError where no relation lies within.
    """
    offset = clock_offset(relations, track) if offset is None else offset
    inside, off = _errors(track, relations, offset)
    if not inside:
        raise LogError('no relation lies within the time of the log: is it of another log?')
    translation, rotation = np.hypot(off[:, 0], off[:, 1]), np.degrees(np.abs(off[:, 2]))
    return Score(
        float(translation.mean()),
        float(translation.std()),
        float(rotation.mean()),
        float(rotation.std()),
        inside,
        offset,
    )
