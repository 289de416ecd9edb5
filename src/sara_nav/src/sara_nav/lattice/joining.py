"""Whether one place sees another, and the analytic path between two poses: turn, straight, turn."""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.lattice.body import move, turn_to
from sara_nav.lattice.field import distance_at
from sara_nav.lattice.moves import AHEAD, ASTERN
from sara_nav.lattice.world import World, example_world


@kernel
def sees(world: World, x0: float, y0: float, x1: float, y1: float, radius: float) -> bool:
    """True when a circle of ``radius`` (m) can move straight from one point (m) to the other."""
    rules = world.rules
    length = math.hypot(x1 - x0, y1 - y0)
    if length < 1e-9:
        return True
    scale, done = 1.0 / rules.resolution, 0.0
    while done < length:
        x, y = x0 + (x1 - x0) * done / length, y0 + (y1 - y0) * done / length
        d = distance_at(world.distances, (x - rules.origin_x) * scale, (y - rules.origin_y) * scale) - radius
        if d < 0.0:
            return False
        done += max(d, 0.5 * rules.resolution)
    return True


@kernel
def join(
    world: World, pose: Pose2D, last: int, limit: float, goal: Pose2D, sense: float
) -> tuple[float, float, float, float]:
    """Return (seconds, first turn, length, second turn) from a Pose2D to the Pose2D ``goal`` by turn, straight, turn;
    seconds is inf where that is not free.

    sense: 1 ahead, -1 astern. last: the kind of the move before, for the cost of changing gear. limit: the gap allowed
    at the beginning (m), see body.move.
    """
    length = math.hypot(goal.x - pose.x, goal.y - pose.y)
    if length < 1e-3:
        seconds, turn, _ = turn_to(world, pose, goal.yaw, limit)
        return seconds, turn, 0.0, 0.0
    heading = math.atan2(goal.y - pose.y, goal.x - pose.x) + (0.0 if sense > 0 else math.pi)
    first, turn, limit = turn_to(world, pose, heading, limit)
    if first == np.inf:
        return np.inf, 0.0, 0.0, 0.0
    straight, limit = move(world, Pose2D(pose.x, pose.y, heading), sense * length, 0.0, limit)
    if straight == np.inf:
        return np.inf, 0.0, 0.0, 0.0
    second, back, _ = turn_to(world, Pose2D(goal.x, goal.y, heading), goal.yaw, limit)
    if (sense > 0 and last == ASTERN) or (sense < 0 and last == AHEAD):
        second += world.rules.gear_cost
    return first + straight + second, turn, sense * length, back


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    world, pose = example_world(), Pose2D(1.0, 1.0, 0.0)
    sees(world, 1.0, 1.0, 1.0, 1.5, 0.1)
    join(world, pose, 0, 0.0, Pose2D(1.0, 1.5, 0.0), 1)
