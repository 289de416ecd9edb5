"""Regulates the speed along a leg: what the places ahead allow, and the next command that keeps to it.

The rules are those of regulated pursuit (Macenski et al. 2023, Regulated pure pursuit), one function each: bends, gaps
to obstacles beside the robot, obstacles before it. The end of the leg and a blocked place ask for rest. Braking for all
of them begins in time (smooth_speed). Compiled, for a cycle asks for dozens of places.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids import clearance, collision
from sara_nav.grids.grid import Grid
from sara_nav.pursuit import path_tracker, smooth_speed
from sara_nav.pursuit.smooth_speed import NO_CAPS, Motion, SpeedLimits

STEP, FINE = 0.1, 0.02
"""Distance (m) between two places ahead that are looked at for speeds, and for what the footprint would touch."""
BEYOND = 0.3
"""Distance (m) that is looked at beyond what braking takes."""
BLOCKED_BEFORE = 0.03
"""The robot rests this far (m) before a place where its footprint would touch something."""
CREEP = 0.02
"""The slowest speed (m/s) towards the end of a leg, which would else be approached for ever."""
SUDDEN = 0.05
"""A cap that would be missed by more than this (m) appeared suddenly: the robot brakes harder for it."""
BEND_SHARE = 0.6
"""Of acc_lim_theta, what a path's change of curvature may ask for: the rest is for braking in bends and for errors."""
REACH = 1.2  # m about the robot in which gaps are looked for
FREE, BEND, NARROW, AHEAD, END, BLOCKED, SLOW = range(7)
"""Why the robot is slow."""


class Limits(NamedTuple):
    """Speeds (m/s), accelerations (m/s2, of rates rad/s2) and turn rate (rad/s), all > 0."""

    highest: float
    """In the leg's sense: max_vel_x, or -min_vel_x in reverse."""
    max_vel_x: float
    comfort: SpeedLimits
    """How it brakes as a rule."""
    hard: SpeedLimits
    """How it brakes for a cap that appeared suddenly."""
    max_vel_theta: float
    acc_lim_theta: float
    max_lateral_acc: float


class Regulation(NamedTuple):
    """How obstacles slow the robot; see RotateThenPursueConfig."""

    wide_gap: float
    narrow_vel: float
    slope: float
    """Tangent of ahead_angle."""
    stop_distance: float
    reaction_time: float
    braking: float


class Driven(NamedTuple):
    """The Motion last commanded; curvature (1/m) driven; turn rate driven over commanded; pose (x, y, yaw) now."""

    motion: Motion
    curvature: float
    turn_gain: float
    pose: tuple[float, float, float]


class Body(NamedTuple):
    """The robot on a costmap: see LocalWorld (corners, cover, shift) and clearance.lead (front, span)."""

    corners: np.ndarray
    cover: collision.Cover
    shift: tuple
    front: float
    span: float


class Caps(NamedTuple):
    """Speeds (m/s) that are not to be exceeded at distances ahead (m), why, and at which place looked at, all (n,)."""

    ahead: np.ndarray
    speed: np.ndarray
    why: np.ndarray
    place: np.ndarray


@kernel
def bend_cap(curvature: float, change: float, turn_gain: float, limits: Limits) -> float:
    """Return the speed (m/s) that a curvature (1/m) and its change (1/m2, >= 0) allow.

    The turn rate is v k, its acceleration v^2 k', the lateral acceleration v^2 k.
    """
    k, change = abs(curvature) + 1e-9, change + 1e-9
    return min(
        0.9 * turn_gain * limits.max_vel_theta / k,
        math.sqrt(BEND_SHARE * turn_gain * limits.acc_lim_theta / change),
        math.sqrt(limits.max_lateral_acc / k),
    )


@kernel
def steering_cap(curvature: float, turn_gain: float, limits: Limits) -> float:
    """Return the speed (m/s) at which the curvature driven now (1/m) keeps the turn rate's limit; CREEP at least."""
    return max(0.9 * turn_gain * limits.max_vel_theta / max(abs(curvature), 1e-6), CREEP)


@kernel
def gap_cap(gap: float, narrow_vel: float, max_vel_x: float, wide_gap: float) -> float:
    """Return the speed (m/s) beside an obstacle: narrow_vel at a gap (m) of 0, linearly to max_vel_x at wide_gap."""
    return narrow_vel + (max_vel_x - narrow_vel) * min(gap / wide_gap, 1.0)


@kernel
def ahead_cap(free: float, stop_distance: float, reaction_time: float, braking: float) -> float:
    """Return the speed (m/s) at which a robot with ``free`` m before it can still react and come to rest: the root of
    v t + v^2 / (2 b) = free - stop_distance.
    """
    distance = max(free - stop_distance, 0.0)
    return braking * (math.sqrt(reaction_time * reaction_time + 2.0 * distance / braking) - reaction_time)


@kernel
def evenly(end: float, step: float) -> np.ndarray:
    """Return the multiples of step (m) from 0 on that are less than ``end``, (n,)."""
    n = int(math.ceil(end / step))
    distances = np.empty(n)
    for i in range(n):
        distances[i] = i * step
    return distances


@kernel
def horizon(motion: Motion, left: float, comfort: SpeedLimits) -> float:
    """Return how far ahead (m) is looked: what reacting and braking take and BEYOND, to the end of the leg."""
    braking = smooth_speed.way_to_slow(motion.speed, max(motion.acceleration, 0.0), 0.0, comfort.braking, comfort.jerk)
    return min(motion.speed * 0.5 + braking + BEYOND, max(left, 0.0))


@kernel
def free_distance(
    samples: path_tracker.Samples, place: path_tracker.Place, end: float, ground: collision.Ground, body: Body
) -> float:
    """Return the distance (m) along the leg until the footprint would touch more than it does now, less a margin; +Inf
    where it does not within ``end`` (m).
    """
    distances = evenly(end + FINE, FINE)
    poses = path_tracker.poses_at(samples, place.along + distances, place.backward)
    touched = collision.touched(ground, body.cover, collision.moved(poses, body.shift))
    for i in range(len(distances)):
        if touched[i] > touched[0]:
            return distances[i] - BLOCKED_BEFORE - FINE
    return np.inf


@kernel
def lowest_cap(bend: float, gap: float, ahead: float, limits: Limits, regulation: Regulation) -> tuple[float, int]:
    """Return (speed m/s, why): the least of what a bend (m/s), a gap (m) and what is free ahead (m) allow."""
    cap, why = bend, BEND
    beside = gap_cap(gap, regulation.narrow_vel, limits.max_vel_x, regulation.wide_gap)
    if beside < cap:
        cap, why = beside, NARROW
    before = ahead_cap(ahead, regulation.stop_distance, regulation.reaction_time, regulation.braking)
    before = max(before, regulation.narrow_vel)
    if before < cap:
        cap, why = before, AHEAD
    return cap, why


@kernel
def caps_ahead(
    samples: path_tracker.Samples,
    place: path_tracker.Place,
    driven: Driven,
    rules: tuple[Limits, Regulation],
    seen: tuple[np.ndarray, np.ndarray],
    free: float,
    slow: smooth_speed.Caps,
) -> Caps:
    """Return the Caps below the highest speed: of the places every STEP ahead, of the leg's end, of a blocked place,
    and of slow places.

    rules: (Limits, Regulation). seen: gaps and what is free ahead at those places, m (n,). free: see free_distance.
    """
    limits, regulation = rules
    gap, ahead = seen
    s, curvatures, changes = samples.s, samples.curvature, samples.size_of_change
    n = len(gap)
    most = n + len(slow.ahead) + 2
    caps = Caps(np.empty(most), np.empty(most), np.empty(most, np.int64), np.empty(most, np.int64))
    kept = 0
    for i in range(n):
        at = place.along + i * STEP
        curvature = path_tracker.on_leg(at, s, curvatures)
        change = path_tracker.on_leg(at, s, changes)
        bend = bend_cap(curvature, change, driven.turn_gain, limits)
        if i == 0:
            bend = min(bend, steering_cap(driven.curvature, driven.turn_gain, limits))
        cap, why = lowest_cap(bend, gap[i], ahead[i], limits, regulation)
        if cap < limits.highest:
            kept = _keep(caps, kept, i * STEP, cap, why, i)
    kept = _keep(caps, kept, place.left, 0.0, END, 0)
    if free < np.inf:
        kept = _keep(caps, kept, free, 0.0, BLOCKED, 0)
    for i in range(len(slow.ahead)):
        kept = _keep(caps, kept, slow.ahead[i], slow.speed[i], SLOW, 0)
    return Caps(caps.ahead[:kept], caps.speed[:kept], caps.why[:kept], caps.place[:kept])


@kernel
def _keep(caps, n, ahead, speed, why, place):
    """Write one more cap behind the first n; returns how many there are."""
    caps.ahead[n], caps.speed[n], caps.why[n], caps.place[n] = ahead, speed, why, place
    return n + 1


@kernel
def next_speed(motion: Motion, caps: Caps, limits: Limits, dt: float) -> tuple[float, float, int]:
    """Return (speed m/s, acceleration m/s2, index) after dt (s): as fast as the Caps allow. index: of the cap that
    slows, -1 when none does.

    Braking is comfortable, and harder where a cap appeared suddenly.
    """
    ahead = smooth_speed.Caps(caps.ahead, caps.speed)
    after, chosen, at = smooth_speed.following(motion, limits.highest, ahead, limits.comfort, dt)
    if at < 0:
        return after, chosen, at
    needed = smooth_speed.way_to_slow(after, chosen, caps.speed[at], limits.comfort.braking, limits.comfort.jerk)
    if caps.ahead[at] - needed < -SUDDEN:
        after, chosen, _ = smooth_speed.following(motion, limits.highest, ahead, limits.hard, dt)
    return after, chosen, at


@kernel
def size_of(why: int, gap: float, ahead: float, left: float, free: float) -> float:
    """Return the size (m) of a cause: the gap, what is free ahead, or the distance left to the end or to where it is
    blocked; 0.0 of others.
    """
    if why == NARROW:
        return gap
    if why == AHEAD:
        return ahead
    if why == END:
        return max(left, 0.0)
    return max(free, 0.0) if why == BLOCKED else 0.0


@kernel
def pace(
    samples: path_tracker.Samples,
    place: path_tracker.Place,
    driven: Driven,
    rules: tuple[Limits, Regulation],
    surroundings: tuple[collision.Ground, Body],
    slow: smooth_speed.Caps,
    dt: float,
) -> tuple[float, float, float, int, float, float, float]:
    """Return (speed, acceleration, cap, why, size, x, y) of the next command after dt (s), see speed_plan.Pace; x, y
    (m, robot's frame): of what is narrow.

    samples, place: of the Leg. driven: a Driven. rules: (Limits, Regulation). surroundings: (Ground, Body). slow:
    of slow places.
    """
    limits, regulation = rules
    ground, body = surroundings
    end = horizon(driven.motion, place.left, limits.comfort)
    poses = path_tracker.poses_at(samples, place.along + evenly(end + STEP, STEP), place.backward)
    poses[0] = driven.pose
    view = clearance.Ahead(-1.0 if place.backward else 1.0, body.front, body.span, regulation.slope, REACH)
    gap, near_x, near_y, ahead = clearance.gaps(ground, body.corners, collision.moved(poses, body.shift), view)
    free = free_distance(samples, place, end, ground, body)
    caps = caps_ahead(samples, place, driven, rules, (gap, ahead), free, slow)
    after, chosen, at = next_speed(driven.motion, caps, limits, dt)
    if chosen <= 0.0 and after < CREEP and place.left > 0.0 and free > 0.0:
        after, chosen = min(driven.motion.speed + limits.comfort.acceleration * dt, CREEP), 0.0  # nearer than braking
    if at < 0:
        return after, chosen, limits.highest, FREE, 0.0, 0.0, 0.0
    why, i = caps.why[at], caps.place[at]
    return after, chosen, caps.speed[at], why, size_of(why, gap[i], ahead[i], place.left, free), near_x[i], near_y[i]


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    s, xy = np.array([0.0, 1.0]), np.array([[0.0, 0.0], [1.0, 0.0]])
    corners = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
    limits = Limits(0.5, 0.5, SpeedLimits(0.5, 0.5, 0.5), SpeedLimits(0.5, 0.5, 0.5), 0.5, 0.5, 0.5)
    ground = collision.Ground(np.zeros((3, 3), np.uint8), Grid(0.0, 0.0, 1.0), True)
    pace(
        path_tracker.Samples(s, xy, xy[1:], s, s, s, s),
        path_tracker.Place(0.0, 1.0, False),
        Driven(Motion(0.1, 0.0), 0.0, 1.0, (0.0, 0.0, 0.0)),
        (limits, Regulation(*[0.5] * 6)),
        (ground, Body(corners, collision.example_cover(), (0.0, 0.0, 0.0), 1.0, 1.0)),
        NO_CAPS,
        0.05,
    )
    gap_cap(0.1, 0.1, 0.5, 0.3)
