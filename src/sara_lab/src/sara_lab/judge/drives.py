"""A recorded drive as something to judge."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sara_lab.judge.judgement import Goal, Track

if TYPE_CHECKING:
    from sara_bringup.missions.drive import Drive


def track_of(drive: Drive) -> Track:
    """The Track of a Drive: straight legs from the start and from corner to corner; the true path where it is known
    throughout, else the fused one.

    Raises ValueError where the goals' times, or all poses, are missing.
    """
    t, true, fused, _ = drive.arrays()
    source = 'true' if np.isfinite(true).all() else 'fused'
    froms = [drive.start] + [corner.asked for corner in drive.corners[:-1]]
    if any(math.isnan(corner.given + corner.ended) for corner in drive.corners):
        raise ValueError('when the goals were given and ended is not known')
    goals = tuple(
        Goal(
            tuple(corner.asked),
            corner.given,
            corner.ended,
            corner.reached,
            corner.text,
            corner.judged,
            tuple(begin[:2]),
            math.dist(begin[:2], corner.asked[:2]),
        )
        for begin, corner in zip(froms, drive.corners)
    )
    return Track(t, true if source == 'true' else fused, source, goals, contacts=drive.contacts)
