"""Odometry made worse by noise that the distance and the turn of each step scale, from a seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse
from sara_slam.logs.records import Record


class OdometryNoise(NamedTuple):
    """Standard deviations after 1 m or 1 rad of even motion: along: m after 1 m; sideways: m after 1 m; turn: rad after
    1 rad; drift: rad after 1 m. The variance grows with the way, so it does not depend on how often the log has a line.
    """

    along: float = 0.05
    sideways: float = 0.02
    turn: float = 0.05
    drift: float = 0.02


def noisy(records: Sequence[Record], noise: OdometryNoise, seed: int) -> list[Record]:
    """The records with their odometry made worse; the first pose stays."""
    rng, result = np.random.default_rng(seed), list(records[:1])
    pose = records[0].pose
    for before, record in zip(records, records[1:]):
        x, y, turn = compose(inverse(before.pose), record.pose)
        way = math.sqrt(math.hypot(x, y))
        along, sideways, drift = rng.normal(0.0, 1.0, 3)
        step = (
            x + along * noise.along * way,
            y + sideways * noise.sideways * way,
            turn + drift * math.hypot(noise.turn * math.sqrt(abs(turn)), noise.drift * way),
        )
        pose = compose(pose, step)
        result.append(record._replace(pose=pose))
    return result
