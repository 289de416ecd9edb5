"""How near a drive came to what stands about, in time and in space: time to collision, and intrusions of a zone about
the body.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sara_common.planar import advanced
from sara_lab.judge import gaps
from sara_lab.judge.judge import GAP_STEP_S
from sara_lab.judge.judgement import Track
from sara_lab.judge.motion import Motion
from sara_lab.judge.runs import runs

if TYPE_CHECKING:
    from sara_sim.world.world import World

ZONE = 0.05  # m about the body
HORIZON, STEP = 5.0, 0.1  # s: how far ahead a collision is looked for, and between two looks
EVERY = 0.2  # s between two moments that are looked at


class Clearance(NamedTuple):
    """`ttc_min`: s, the least time to collision, HORIZON where it never was less. `intrusions`: how often something
    came into the zone, `intruded`: s that it was there.
    """

    ttc_min: float
    intrusions: int
    intruded: float


def clearance(track: Track, world: World, body: Sequence[float]) -> Clearance:
    """The Clearance of a Track among what stands still. `body`: length, width, m."""
    gap = gaps.along(world, track.t, track.pose, tuple(body), GAP_STEP_S)
    spacing = (track.t[-1] - track.t[0]) / max(len(gap) - 1, 1)
    inside = gap < ZONE
    return Clearance(
        float(times_to_collision(track, world, body).min(initial=HORIZON)),
        len(runs(inside)),
        float(spacing * np.count_nonzero(inside)),
    )


def times_to_collision(track: Track, world: World, body: Sequence[float]) -> np.ndarray:
    """(n,) s until the body would touch something if it went on with its speed and turn rate; HORIZON at most; one
    each EVERY s.
    """
    motion = Motion.of(track.t, track.pose)
    chosen = np.arange(0, len(motion.t), max(1, round(EVERY / motion.dt)))
    return np.array(
        [
            _time_to_collision(world, motion.pose[k].tolist(), float(motion.v[k]), float(motion.w[k]), body)
            for k in chosen
            if motion.moving[k]
        ]
    )


def _time_to_collision(world, pose, v, w, body):
    for k in range(1, round(HORIZON / STEP) + 1):
        pose = advanced(*pose, v, w, STEP)
        if not world.has_room(*pose, *body):
            return k * STEP
    return HORIZON
