"""The ideal time: the fastest motion of the body from a pose to a pose, at rest at both, that the map and a profile's
limits allow, with a perfect pose and no sensors.

A search (search.py) finds a path, Bellman's recursion (shorten.py) makes it faster, and the least time in which it can
be driven is found exactly (timing.py); of several candidates the fastest counts. The body keeps MARGIN from what the
map says is occupied, to the nearest cell and one of HEADINGS headings: the margin that journeys are drawn with. The
result is the least time to the resolution of this lattice only: a faster motion may exist, by a few per cent where the
way is free. Jerk is not limited.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt

from sara_common.planar import wrap
from sara_control.gate.comfort import Profile
from sara_lab.ideal.moves import Limits, Space, after
from sara_lab.ideal.search import FAR, search, seconds_left
from sara_lab.ideal.shorten import shorten
from sara_lab.ideal.timing import seconds_along
from sara_lab.judge.body_space import BodySpace
from sara_nav.lattice.shortcuts import cut

HEADINGS, MARGIN = 64, 0.03  # -, m
CANDIDATES = ((1.0, 1.3), (0.6, 1.3))  # share of what stops are charged with, and the search's greed
ROUNDS = ((0.4, 0.4), (0.27, 0.3), (0.45, 0.5))  # m, rad: pieces that paths are cut into to make them faster


class Ideal(NamedTuple):
    """`seconds` (NaN: there is no way, or a pose is not on the map), and the `moves` (n, 2) that take so long: length
    (m, astern negative), turn (rad).
    """

    seconds: float
    moves: np.ndarray

    def poses(self, start: Sequence[float], piece: float = 0.05) -> np.ndarray:
        """(n, 3) poses (m, rad) along the path from its start, about `piece` (m) apart."""
        found = [tuple(start)]
        for length, turn in cut(self.moves, piece, 2.0 * piece):
            found.append(after(*found[-1], length, turn))
        return np.array(found)


def limits_of(profile: Profile) -> Limits:
    """The Limits of a rider's profile."""
    return Limits(
        profile.max_forward,
        profile.max_reverse,
        profile.max_turn,
        profile.max_lateral,
        profile.acceleration,
        profile.braking,
        profile.turn_acceleration,
    )


def space_of(
    occupied: np.ndarray, size: float, origin: Sequence[float], body: tuple[float, float], margin: float = MARGIN
) -> Space:
    """The Space of a map (rows, columns) bool, row 0 lowest; size, origin, body (length, width), margin: m."""
    free = BodySpace(occupied, size, tuple(origin), body, margin, headings=HEADINGS).free
    room = size * distance_transform_edt(np.pad(~occupied, 1))[1:-1, 1:-1] - 0.5 * size
    return Space(free, room.astype(np.float32), float(size), float(origin[0]), float(origin[1]))


def ideal(space: Space, limits: Limits, start: Sequence[float], goal: Sequence[float], radius: float) -> Ideal:
    """The Ideal from a pose (x, y, yaw; m, rad) to a pose. radius: m, of the circle that fits into the body."""
    nothing = Ideal(math.nan, np.empty((0, 2)))
    ends = np.array([start, goal], float)
    if not (np.isfinite(ends).all() and on_map(space, ends)):
        return nothing
    ends[1, 2] = ends[0, 2] + wrap(ends[1, 2] - ends[0, 2])
    left = seconds_left(space, ends[1, 0], ends[1, 1], limits.ahead, radius)
    if left[int((ends[0, 1] - space.y) / space.size), int((ends[0, 0] - space.x) / space.size)] >= FAR:
        return nothing
    best = nothing
    for charge, greed in CANDIDATES:
        moves = search(space, limits, ends, left, charge, greed)
        if not len(moves):
            continue
        for piece, twist in ROUNDS:
            moves = shorten(space, limits, ends[0], cut(moves, piece, twist), charge)
            found = merged(moves)
            seconds = float(seconds_along(found, limits))
            if not seconds >= best.seconds:
                best = Ideal(seconds, found)
    return best


def on_map(space: Space, poses: np.ndarray) -> bool:
    """Whether all poses (n, 3) lie on the map."""
    rows, columns = space.room.shape
    cells = np.floor((poses[:, :2] - (space.x, space.y)) / space.size)
    return bool(((cells >= 0) & (cells < (columns, rows))).all())


def merged(moves: np.ndarray) -> np.ndarray:
    """Moves (n, 2) without those that are none."""
    return moves[(np.abs(moves[:, 0]) > 1e-6) | (np.abs(moves[:, 1]) > 1e-6) & (moves[:, 0] == 0.0)]
