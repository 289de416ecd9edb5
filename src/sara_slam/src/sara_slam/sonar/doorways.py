"""Doorways: gaps in a wall that a sensor looked through. A wall is heard a little beyond its end, and drawn on beyond
that, so that a doorway would be drawn too narrow to drive through; no door for wheelchairs is narrower than WIDE.
Where the robot itself has passed, its width tells how wide the doorway is at least.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sara_slam.sonar.forward_model import GLIMPSES, Heard, glances, looked_through
from sara_slam.sonar.sonar_config import SonarConfig

Pose = tuple[float, float, float]
WIDE = 0.80
"""m of the middle of a doorway that stay open."""
ROOM = 0.08
"""m beside the body that the way through a doorway takes: a robot that is a few cm off is to go straight and in the
middle.
"""
NARROWEST, WIDEST = 0.60, 1.30
"""m between the ends of two pieces of a wall that are heard of what is taken for a doorway."""
DEEP = 0.12
"""m about the wall's line in which a doorway's ends are heard."""
POST = 0.5
"""Share of the middle of WIDE in which something that is heard stands, for it is no end of the wall."""
POST_DEEP = 0.3
"""m from the wall's line to which its posts reach: a wall that was heard from one side may be so thick."""
PASSING = 0.25
"""m before and behind a wall's line within which a robot's middle passes it: beside a wall it is farther off."""
SPARE = 0.09
"""m that a doorway is wider than the body on each side, at least: a wall is heard a little beyond its end."""


class Doorways(NamedTuple):
    """middles (n, 2) m; tangents (n, 2) of their walls."""

    middles: np.ndarray
    tangents: np.ndarray

    def ends(self, places: np.ndarray) -> np.ndarray:
        """(k,) whether places (k, 2), m, narrow a doorway."""
        along, across = self._off(places)
        return ((along < 0.5 * WIDE) & (along > 0.5 * POST * WIDE) & (across < DEEP)).any(1)

    def with_post_at(self, place: np.ndarray, toward: np.ndarray) -> Doorways:
        """Those of which a post may stand at a place (2,), m, for a robot that drives toward (2,): before the wall's
        line, or in a wall as thick as most are.
        """
        along, across = self._off(place[None])
        (dx, dy), (ox, oy), (tx, ty) = toward, (self.middles - place).T, self.tangents.T
        deep = np.where((dx * ty - dy * tx) * (ox * ty - oy * tx) > 0.0, POST_DEEP, DEEP)
        posts = ((along > 0.5 * NARROWEST) & (along < 0.5 * WIDEST) & (across < deep))[0]
        return Doorways(self.middles[posts], self.tangents[posts])

    def behind_posts(self, places: np.ndarray, toward: np.ndarray) -> np.ndarray:
        """(k,) whether places (k, 2), m, lie behind the posts of walls as thick as most are, for a robot that drives
        toward (2,).
        """
        (dx, dy), (ox, oy), (tx, ty) = toward, np.moveaxis(places[:, None] - self.middles, -1, 0), self.tangents.T
        return ((ox * ty - oy * tx) * np.sign(dx * ty - dy * tx) > DEEP).all(1)

    def hold(self, places: np.ndarray, body_width: float = 0.0) -> np.ndarray:
        """(k,) whether places (k, 2), m, are in the way through a doorway of a body so wide, m; 0: not known."""
        along, across = self._off(places)
        way = min(body_width + 2.0 * ROOM, WIDE) if body_width else WIDE
        return ((along < 0.5 * way) & (across < DEEP)).any(1)

    def seen_from(self, frame: Pose) -> Doorways:
        """The same in a frame that lies at a pose (x, y, yaw; m, rad)."""
        c, s = math.cos(frame[2]), math.sin(frame[2])
        (x, y), (tx, ty) = (self.middles - frame[:2]).T, self.tangents.T
        return Doorways(
            np.column_stack((c * x + s * y, c * y - s * x)), np.column_stack((c * tx + s * ty, c * ty - s * tx))
        )

    def _off(self, places):
        """(k, n) m each: along the wall and across it from the middles to places (k, 2)."""
        off = places[:, None] - self.middles
        tx, ty = self.tangents.T
        return np.abs(off[..., 0] * tx + off[..., 1] * ty), np.abs(off[..., 1] * tx - off[..., 0] * ty)


NO_DOORWAYS = Doorways(np.empty((0, 2)), np.empty((0, 2)))


def doorways(config: SonarConfig, heard: Heard, walls: Sequence[np.ndarray], spacing: float) -> Doorways:
    """Of walls, each given by its pieces (n, 4), x, y and normal, `spacing` m apart, which hide what is behind them."""
    few, many = math.floor(NARROWEST / spacing), math.ceil(WIDEST / spacing)
    gaps = [gap for pieces in walls for gap in gaps_of(pieces, spacing, few, many)]
    if not gaps:
        return NO_DOORWAYS
    inside = np.concatenate(gaps)
    through = looked_through(config, heard, inside, glances(config, heard, inside), np.concatenate(walls)) > GLIMPSES
    lengths = [len(gap) for gap in gaps]
    seen = [bool(of.any()) for of in np.split(through, np.cumsum(lengths)[:-1])]
    middle = np.array([gap.mean(0) for gap, is_open in zip(gaps, seen) if is_open]).reshape(-1, 4)
    return Doorways(middle[:, :2], np.column_stack((-middle[:, 3], middle[:, 2])))


def in_order(pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The pieces (n, 4), 1 or more, of a wall along its tangent; and (n,) m, where on it each is."""
    along = pieces[:, :2] @ np.array((-pieces[0, 3], pieces[0, 2]))
    order = np.argsort(along, kind='stable')
    return pieces[order], along[order]


def gaps_of(pieces: np.ndarray, spacing: float, few: int, many: int) -> list[np.ndarray]:
    """(k, 4) each: the pieces, from few to many, that are missing between two of a wall's (n, 4), `spacing` m apart."""
    if len(pieces) < 2:
        return []
    ends, along = in_order(pieces)
    missing = np.round(np.diff(along) / spacing).astype(int) - 1
    between = np.flatnonzero((missing >= few) & (missing <= many))
    return [np.linspace(ends[at], ends[at + 1], missing[at] + 2)[1:-1] for at in between.tolist()]


def in_doorway(config: SonarConfig, poses: np.ndarray, pieces: np.ndarray) -> np.ndarray:
    """(n,) whether the robot's middle, at poses (k, 3): x, y, yaw, passed the line of a wall so near to pieces (n, 4)
    of it that no body of that width would have.
    """
    found = np.zeros(len(pieces), bool)
    if not len(pieces):
        return found
    tree, beside = cKDTree(pieces[:, :2]), 0.5 * config.body_width + SPARE
    for place in poses[:, :2]:
        near = np.array(tree.query_ball_point(place, math.hypot(PASSING, beside)), int)
        off, normal = place - pieces[near, :2], pieces[near, 2:]
        across, along = (off * normal).sum(1), off[:, 1] * normal[:, 0] - off[:, 0] * normal[:, 1]
        found[near[(np.abs(across) < PASSING) & (np.abs(along) < beside)]] = True
    return found
