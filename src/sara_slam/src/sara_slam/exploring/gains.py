"""How many metres of border a robot would hear where it stands and on the way there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D

BLOCK = 3
"""Cells, each way, that count once, from wherever they are heard."""
DIRECTIONS, SPACING, FARTHEST = 32, 0.25, 4.0
"""Of straight ways from where the robot is; m between places on them that it listens at, and to the last of these."""
STRAIGHT = 1.1
"""Times the distance, and a SPACING, that a way measures at most if it is a straight one."""


class Gains:
    """What is expected, as a figure of each cell (float32 (rows, columns), 0 to 1), in metres. resolution: m."""

    def __init__(self, expected: np.ndarray, resolution: float) -> None:
        rows, columns = expected.shape
        self._columns, self._across = columns, -(-columns // BLOCK)
        padded = np.zeros((-(-rows // BLOCK) * BLOCK, self._across * BLOCK), np.float32)
        padded[:rows, :columns] = expected
        most = padded.reshape(-1, BLOCK, self._across, BLOCK).max((1, 3)).ravel()
        self._metres = np.append(most * np.float32(BLOCK * resolution), np.float32(0.0))  # the last one: of no cell

    def of_each(self, places: np.ndarray) -> np.ndarray:
        """(n,) m that are heard from each of n poses; places (n, m): flat indices of cells, -1 for none."""
        found = np.sort(self._blocks(places), axis=1)
        metres = self._metres[found]
        metres[:, 1:][found[:, 1:] == found[:, :-1]] = 0.0
        return metres.sum(1)

    def as_it_goes(self, places: np.ndarray) -> np.ndarray:
        """(n,) m that are heard from the first, from the first two, ... of n poses one after the other; places as of
        of_each.
        """
        numbers, first = np.unique(self._blocks(places), return_index=True)
        return np.bincount(first // places.shape[1], self._metres[numbers], len(places)).cumsum()

    def _blocks(self, places):
        rows, columns = np.divmod(places, self._columns)
        return np.where(places >= 0, rows // BLOCK * self._across + columns // BLOCK, len(self._metres) - 1)


class Offer(NamedTuple):
    """What the stand of a number offers: m/s by what that is worth, m of border, and flat indices of its cells."""

    rate: float
    gain: float
    cells: np.ndarray
    stand: int


class Listening:
    """What is heard at stands (n, 3), and on the ways (n,), m, to them from the pose `start`, as far as they are
    straight. heard: of poses (k, 3) the flat indices of cells that are heard from each, (k, m), -1 for none.
    """

    def __init__(
        self, start: Pose2D, stands: np.ndarray, ways: np.ndarray, heard: Callable[[np.ndarray], np.ndarray]
    ) -> None:
        turns = np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS)
        far = np.arange(round(FARTHEST / SPACING) + 1) * SPACING
        x, y = start.x + far * np.cos(turns)[:, None], start.y + far * np.sin(turns)[:, None]
        yaws = np.broadcast_to(turns[:, None], x.shape)
        self._there = heard(stands)
        self._on_the_way = heard(np.stack((x, y, yaws), -1).reshape(-1, 3)).reshape(*x.shape, -1)
        x, y = stands[:, 0] - start.x, stands[:, 1] - start.y
        off = np.hypot(x, y)
        self._directions = np.round(np.arctan2(y, x) / turns[1]).astype(int) % DIRECTIONS
        straight = (off >= SPACING) & (ways <= STRAIGHT * off + SPACING)
        self._places = np.where(straight, np.minimum((off / SPACING).astype(int), len(far) - 1) + 1, 0)  # on the way

    def at_most(self, gains: Gains) -> np.ndarray:
        """(n,) m of each stand: what is heard from there and on the way counts twice."""
        along = np.array([[0.0, *gains.as_it_goes(places)] for places in self._on_the_way])
        return gains.of_each(self._there) + along[self._directions, self._places]

    def offers(self, numbers: Iterable[int], worth: Gains, of_any: Gains, seconds: np.ndarray) -> list[Offer]:
        """What the stands of some numbers offer, each cell counted once, the best first. seconds: (n,) to each."""
        found = []
        for k in numbers:
            on_the_way = self._on_the_way[self._directions[k], : self._places[k]]
            cells = np.unique(np.concatenate((self._there[k], on_the_way.ravel())))
            cells = cells[cells >= 0]
            value, gain = (float(gains.of_each(cells[None])[0]) for gains in (worth, of_any))
            found.append(Offer(value / float(seconds[k]), gain, cells, k))
        return sorted(found, key=lambda offer: -offer.rate)
