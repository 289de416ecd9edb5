"""How near an oriented outline comes to obstacles, standing and moving, and how long a move takes by that.

The gap of a pose is the least distance to an obstacle along the outline. The distance changes by no more than the path
walked (it is 1-Lipschitz), so a point far from everything clears its neighbours along the outline: the walk round it
takes steps as long as the distances that it reads allow (sphere tracing; Hart 1996), and in the open one look at the
centre is enough.

A move has one curvature: straight, an arc, or a turn in place. It is sampled as finely as its gap asks for. Lengths in
m, times in s.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_common.planar import Pose2D
from sara_nav.lattice.field import distance_at
from sara_nav.lattice.world import Rules, World, example_world

FINE = 0.045
"""m that any point of the body moves between two samples where it is tight; a quarter of that where it has less than
the margin.
"""
COARSE = 0.2
"""m between samples where nothing is near."""
ROUGH = 0.02
"""m by which a gap may be overestimated where it is well above what is allowed."""
TOUCHING = 0.002
"""m; the gap allowed about a start or a goal that itself has less than the margin."""
BEND = 0.35
"""rad; a lesser turn costs only its share of the beginning of a turn."""


@kernel
def room_at(world: World, x: float, y: float) -> float:
    """Return the distance (m) from a point (m, map frame) to the nearest obstacle."""
    rules = world.rules
    return distance_at(
        world.distances, (x - rules.origin_x) / rules.resolution, (y - rules.origin_y) / rules.resolution
    )


@kernel
def gap(world: World, pose: Pose2D, limit: float) -> float:
    """Return the least distance (m) of the outline at a Pose2D to an obstacle, at most rules.greatest_gap.

    Between the outline's points, half a spacing may be missed. With a positive limit the result may be ROUGH too great
    where it is above the limit. Where it is less than ``limit`` the walk ends, and something less than that is
    returned. With a negative limit, of a body in contact, contacts are counted: the result is minus the number of
    points of the body on obstacles where there are any.
    """
    rules, outline, inside, field = world.rules, world.outline, world.inside, world.distances
    scale = 1.0 / rules.resolution
    u0, v0 = (pose.x - rules.origin_x) * scale, (pose.y - rules.origin_y) * scale
    least = rules.greatest_gap
    if distance_at(field, u0, v0) - rules.radius >= least:
        return least
    c, s = math.cos(pose.yaw) * scale, math.sin(pose.yaw) * scale
    if limit < 0.0:
        count = 0
        for k in range(len(inside)):
            a, b = inside[k, 0], inside[k, 1]
            if distance_at(field, u0 + c * a - s * b, v0 + s * a + c * b) <= 0.0:
                count += 1
        if count > 0:
            return -1.0 * count
    k, n, spacing = 0, len(outline), rules.spacing
    while k < n:
        a, b = outline[k, 0], outline[k, 1]
        d = distance_at(field, u0 + c * a - s * b, v0 + s * a + c * b)
        if d < least:
            least = d
            if d < limit:
                return d
        k += max(1, int((min(d - limit, d - least + ROUGH) if limit > 0.0 else d - least) / spacing))
    return least


@kernel
def margin_at(here: float) -> float:
    """Return the gap to be kept near where a path begins or ends with the gap ``here`` (m): TOUCHING, or no more
    contacts than there are.

    A body that stands along a wall cannot leave it but by swinging its tail a little nearer first. Where it is flush
    with something, no contact is counted, but none may come either.
    """
    return min(here, TOUCHING) if here > 0.0 else min(here, -0.5)


@kernel
def slowness(rules: Rules, least: float) -> float:
    """Return by what factor a gap (m) makes a drive take longer."""
    if least >= rules.clearance:
        return 1.0
    share = (rules.clearance - max(least, 0.0)) / rules.clearance
    return 1.0 + rules.clearance_weight * share * share * share * share


@kernel
def slowness_about(world: World, x: float, y: float) -> float:
    """Return by what factor the room about a place (m) makes a turn there take longer.

    It goes by the circle that turning about sweeps, not by what this turn sweeps of it: sensors that measure how far
    something is, but hardly where, make a robot as careful.
    """
    rules = world.rules
    spare = room_at(world, x, y) - rules.radius
    share = min(max(0.0, 1.0 - spare / rules.turning_room), 2.0)
    return 1.0 + rules.turning_room_weight * share * share


@kernel
def blindness(world: World, pose: Pose2D, here: float, in_place: bool) -> float:
    """Return by what factor what is near either end of the body at a Pose2D makes a turn, in place or on an arc, take
    longer, the nearer the more: a safety function behind, which cannot measure how near it is, does not let the body
    turn there; nor in place where it is beside it. here: the gap (m).
    """
    rules, ends = world.rules, world.ends
    if max(here, 0.0) >= rules.blind:
        return 1.0
    if in_place and here < rules.beside:
        return 1.0 + rules.blind_weight
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    least = reach = 0.55 * rules.blind
    for k in range(len(ends)):
        a, b = ends[k, 0], ends[k, 1]
        least = min(least, room_at(world, pose.x + c * a - s * b, pose.y + s * a + c * b))
    return 1.0 + rules.blind_weight * (1.0 - max(least, 0.0) / reach)


@kernel
def place(pose: Pose2D, length: float, turn: float, share: float) -> Pose2D:
    """Return the Pose2D after a share of a move (m, rad) from a Pose2D; its yaw is not wrapped."""
    heading, dyaw = pose.yaw + 0.5 * share * turn, share * turn
    chord = share * length
    if abs(dyaw) > 1e-9:
        chord *= math.sin(0.5 * dyaw) / (0.5 * dyaw)
    return Pose2D(pose.x + chord * math.cos(heading), pose.y + chord * math.sin(heading), pose.yaw + dyaw)


@kernel
def unhindered(rules: Rules, length: float, turn: float) -> float:
    """Return the seconds of a move where nothing is near."""
    across = math.sqrt(abs(length * turn) / rules.lateral)
    seconds = max(abs(length) / rules.speed, abs(turn) / rules.turn_rate, across)
    return seconds * rules.reverse_factor if length * rules.sense < 0.0 else seconds


@kernel
def run_up_lacking(rules: Rules, path: float, first: float, last: float) -> float:
    """Return the seconds that a straight leg of ``path`` m costs more because narrow places, between the shares
    ``first`` and ``last`` of it, are near its ends.
    """
    before, after = first * path / rules.run_up, (1.0 - last) * path / rules.run_up
    return rules.run_up_cost * (max(0.0, 1.0 - before) + max(0.0, 1.0 - after))


@kernel
def move(world: World, pose: Pose2D, length: float, turn: float, limit: float) -> tuple[float, float]:
    """Return (seconds, limit) of a move from a Pose2D; seconds is inf where the body may not go.

    length: m along the path, negative astern. turn: rad. limit: the least gap allowed (m). Where that is below the hard
    margin, because the body stands so near to something, the gap gets no less than it is, and the limit is the margin
    again once the gap is. Contacts only get fewer.
    """
    rules = world.rules
    path = abs(length) + rules.radius * abs(turn)
    in_place = length == 0.0
    hard = rules.hard_margin
    here = gap(world, pose, limit)
    if here < limit:
        return np.inf, limit
    if path <= 0.0:
        return 0.0, limit
    about = slowness_about(world, pose.x, pose.y) if in_place else 1.0
    slow = about if in_place else slowness(rules, here)
    if turn != 0.0:
        slow *= blindness(world, pose, here, in_place)
    total, done = 0.0, 0.0
    first, last = (0.0, 0.0) if here < rules.narrow else (2.0, -1.0)  # shares of the path between which it is narrow
    while done < 1.0:
        step = min(max(here - hard, 0.25 * FINE if 0.0 < limit < hard else FINE), COARSE) / path
        if done + step > 1.0 - 1e-9:
            step = 1.0 - done
            done = 1.0
        else:
            done += step
        there = place(pose, length, turn, done)
        here = gap(world, there, limit)
        if here < limit:
            return np.inf, limit
        if limit < hard:
            limit = hard if here >= hard else max(limit, margin_at(here))
        then = about if in_place else slowness(rules, here)
        if turn != 0.0:
            then *= blindness(world, there, here, in_place)
        total += 0.5 * (slow + then) * step
        slow = then
        if here < rules.narrow:
            first, last = min(first, done), done
    seconds = unhindered(rules, length, turn) * total
    if turn == 0.0 and rules.run_up_cost > 0.0 and first <= 1.0:
        seconds += run_up_lacking(rules, path, first, last)
    return seconds, limit


@kernel
def arrive(world: World, pose: Pose2D, length: float, turn: float, limit: float) -> float:
    """Return the seconds of the move that ends at a Pose2D where the gap may be as little as ``limit`` (m): the move
    away from there, backwards in time, so that the gap only gets as small as it must.
    """
    seconds, _ = move(world, pose, -length, -turn, limit)
    if length > 0.0:
        return seconds / world.rules.reverse_factor
    return seconds * world.rules.reverse_factor if length < 0.0 else seconds


@kernel
def turn_to(world: World, pose: Pose2D, target: float, limit: float) -> tuple[float, float, float]:
    """Return (seconds, turn, limit) of turning in place from a Pose2D to ``target`` (rad): the short way round, the
    long one where that is blocked. Arguments and ``limit`` as of ``move``.
    """
    turn = wrap(target - pose.yaw)
    if abs(turn) < 1e-6:
        return 0.0, 0.0, limit
    seconds, after = move(world, pose, 0.0, turn, limit)
    if seconds == np.inf:
        about = turn - math.copysign(2.0 * math.pi, turn)
        seconds, after = move(world, pose, 0.0, about, limit)
        turn = about if seconds < np.inf else turn
    return seconds + world.rules.turn_cost * min(1.0, abs(turn) / BEND), turn, after


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    world, pose = example_world(), Pose2D(1.0, 1.0, 0.0)
    turn_to(world, pose, 1.0, 0.0)
    move(world, pose, 1.0, 0.0, 0.0)
    arrive(world, pose, 1.0, 0.0, 0.0)
    gap(world, pose, 1.0)
    margin_at(0.1)
    place(pose, 1.0, 0.0, 1.0)
