"""How long the local planner takes for a move: what is near slows it as it slows RotateThenPursue (speed_ahead.py).

The room ahead is that of a cone, as range sensors see it; here it is found on the distance field, by circles that fit
into the cone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.lattice.body import COARSE, blindness, gap, move, place, room_at, unhindered
from sara_nav.lattice.world import World, example_world
from sara_nav.pursuit.speed_ahead import Regulation, ahead_cap, gap_cap

FARTHEST = 2.0
"""m before the body that are looked at."""
CLOSEST = 0.05
"""m of a drive, and of the way ahead, between two looks at least."""


class Driving(NamedTuple):
    """What a body's drives are timed by."""

    regulation: Regulation
    front: float
    """m of the leading edge before the origin, ahead."""
    rear: float
    """The same astern."""
    span: float
    """m to each side over which one looks straight ahead."""


@kernel
def room_ahead(world: World, driving: Driving, pose: Pose2D, sense: float) -> float:
    """Return how far (m, at most FARTHEST) a circle as wide as the cone can go before the edge that leads (sense 1.0
    ahead, -1.0 astern) of a body at a Pose2D: to what stands beside the cone, and half-way to what stands straight
    ahead, for the safety function behind slows earlier in bends than on straights.
    """
    c, s = sense * math.cos(pose.yaw), sense * math.sin(pose.yaw)
    edge, at = driving.front if sense > 0.0 else driving.rear, 0.0
    while at < FARTHEST:
        wide = driving.span + driving.regulation.slope * at
        spare = room_at(world, pose.x + c * (edge + at), pose.y + s * (edge + at)) - wide
        if spare < 0.0:
            return max(at + spare, 0.0)
        at += max(0.5 * spare, CLOSEST)
    return FARTHEST


@kernel
def pace(world: World, driving: Driving, pose: Pose2D, sense: float, here: float) -> float:
    """Return the s/m that what is near makes of a drive at a Pose2D; here: the gap (m)."""
    law, fastest = driving.regulation, world.rules.speed
    beside = gap_cap(max(here, 0.0), law.narrow_vel, fastest, law.wide_gap)
    ahead = room_ahead(world, driving, pose, sense)
    before = ahead_cap(ahead, law.stop_distance, law.reaction_time, law.braking)
    return 1.0 / min(beside, max(before, law.narrow_vel))


@kernel
def seconds_of(
    world: World, driving: Driving, pose: Pose2D, run: tuple[float, float], limit: float, most: float
) -> float:
    """Return the seconds of a move, ``run`` (m, rad), from a Pose2D; inf where the body does not fit with the gap
    ``limit`` (m), or as soon as they are more than ``most``. What is near counts twice for turns in place (body.move),
    so that others are preferred.
    """
    length, turn = run
    if length == 0.0:
        return 2.0 * move(world, pose, length, turn, limit)[0] - unhindered(world.rules, length, turn)
    rules, sense = world.rules, math.copysign(1.0, length)
    path, least = abs(length) + rules.radius * abs(turn), unhindered(rules, abs(length), turn) / abs(length)
    scale = abs(length) * (rules.reverse_factor if length < 0.0 else 1.0)
    total, done, before, step = 0.0, 0.0, -1.0, 0.0
    while True:
        there = place(pose, length, turn, done)
        here = gap(world, there, limit)
        if here < limit:
            return np.inf
        now = max(pace(world, driving, there, sense, here), least)
        if turn != 0.0:
            now *= blindness(world, there, here, False)
        if before >= 0.0:
            total += 0.5 * (before + now) * step
            if scale * (total + least * (1.0 - done)) > most:
                return np.inf
        if done >= 1.0:
            break
        before, step = now, min(max(here - rules.hard_margin, CLOSEST), COARSE) / path
        step = min(step, 1.0 - done) if done + step < 1.0 - 1e-9 else 1.0 - done
        done = min(done + step, 1.0)
    return scale * total


def example_driving() -> Driving:
    """A Driving of the types that kernels are compiled for."""
    return Driving(Regulation(*[0.5] * 6), 1.0, 1.0, 0.5)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    world, pose = example_world(), Pose2D(1.0, 1.0, 0.0)
    seconds_of(world, example_driving(), pose, (0.1, 0.1), 0.0, np.inf)
