"""What a scan saw of surfaces: places on them and their normals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel

JOINED = 0.5
"""m between two neighbouring echoes up to which one surface joins them."""
SPACING = 0.05
"""m between places on the line that joins two echoes."""
ABOUT = 0.15
"""m to each side of an echo over which its surface's direction is taken."""
UNEVEN = 0.03
"""m off that direction, r.m.s., from which on an echo has no normal: it lies at a corner."""


def placed(points: np.ndarray, pose: Sequence[float]) -> np.ndarray:
    """(n, 2) points in a frame of points (n, 2) in the frame that has the pose (x, y, yaw) there."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return points @ np.array([[c, s], [-s, c]]) + np.array(pose[:2])


class Surfaces(NamedTuple):
    """points (n, 2), m; normals (n, 2) of unit length, 0 0 where a place has none; to which side they point means
    nothing before `seen_from`.
    """

    points: np.ndarray
    normals: np.ndarray

    def placed(self, pose: tuple[float, float, float]) -> Surfaces:
        """In a frame of which this one's pose is (x, y, yaw)."""
        return Surfaces(placed(self.points, pose), placed(self.normals, (0.0, 0.0, pose[2])))

    def seen_from(self, viewer: Sequence[float]) -> Surfaces:
        """With normals that point to the side on which a viewer (x, y) is."""
        away = self._before(viewer) < 0.0
        return Surfaces(self.points, np.where(away[:, None], -self.normals, self.normals))

    def facing(self, viewer: Sequence[float], margin: float) -> np.ndarray:
        """(n,) bool: which of them a viewer (x, y) may see who is off by up to a margin (m): not the backs of walls,
        which are thin, and would be taken for their fronts.
        """
        return self._before(viewer) >= -margin

    def _before(self, viewer):
        """(n,) m from each surface to the viewer, along its normal; 0 without one."""
        return ((np.array(viewer, float) - self.points) * self.normals).sum(1)


def surfaces_of(echoes: np.ndarray) -> Surfaces:
    """Of echoes (n, 2) in the order of their rays: each moved onto the line that fits it and its neighbours, and places
    SPACING apart between those that are joined.

    Of echoes as they are, the same rays of two scans would fit best without any motion along a smooth wall, and among
    the noise of many scans there would always be one that is near.
    """
    echoes, own = fitted(np.ascontiguousarray(echoes, float))
    gaps = np.hypot(*np.diff(echoes, axis=0).T) if len(echoes) > 1 else np.zeros(0)
    joined = np.flatnonzero((gaps > SPACING) & (gaps <= JOINED))
    counts = (gaps[joined] / SPACING).astype(int)
    begin = np.repeat(joined, counts)
    rank = np.arange(len(begin)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    share = (rank / (np.repeat(counts, counts) + 1.0))[:, None]
    step = echoes[begin + 1] - echoes[begin] if len(begin) else np.zeros((0, 2))
    across = np.stack((-step[:, 1], step[:, 0]), 1) / np.maximum(np.hypot(step[:, 0], step[:, 1]), 1e-12)[:, None]
    between = echoes[begin] + share * step
    return Surfaces(np.concatenate((echoes, between)), np.concatenate((own, across)))


@kernel
def fitted(echoes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of echoes (n, 2) the places (n, 2) on the line that fits best those that are joined to each within ABOUT, and its
    normals (n, 2).
    """
    count = len(echoes)
    places, result = echoes.copy(), np.zeros((count, 2))
    for k in range(count):
        first, last = _reach(echoes, k, -1), _reach(echoes, k, 1)
        if first == last:
            continue
        n = last - first + 1
        mx, my = echoes[first : last + 1, 0].sum() / n, echoes[first : last + 1, 1].sum() / n
        xx = xy = yy = 0.0
        for m in range(first, last + 1):
            dx, dy = echoes[m, 0] - mx, echoes[m, 1] - my
            xx += dx * dx
            xy += dx * dy
            yy += dy * dy
        angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
        nx, ny = -math.sin(angle), math.cos(angle)
        if nx * nx * xx + 2.0 * nx * ny * xy + ny * ny * yy <= n * UNEVEN * UNEVEN:
            result[k, 0], result[k, 1] = nx, ny
            off = nx * (echoes[k, 0] - mx) + ny * (echoes[k, 1] - my)
            places[k, 0] -= off * nx
            places[k, 1] -= off * ny
    return places, result


@kernel
def _reach(echoes, k, step):
    """Index of the last echo that is joined to k one way and within ABOUT; the next one at least, if it is joined."""
    last = k
    while 0 <= last + step < len(echoes):
        after = last + step
        gap = math.hypot(echoes[after, 0] - echoes[last, 0], echoes[after, 1] - echoes[last, 1])
        off = math.hypot(echoes[after, 0] - echoes[k, 0], echoes[after, 1] - echoes[k, 1])
        if gap > JOINED or (off > ABOUT and last != k):
            break
        last = after
    return last


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    fitted(np.zeros((2, 2)))
