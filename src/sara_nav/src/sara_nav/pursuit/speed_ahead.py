"""What a leg and a costmap allow of speed ahead, place by place, and the next command that keeps to it: speed_plan's
numbers, compiled.

One call a cycle: from the leg's samples to the next speed nothing is handed back to Python, whose arrays of a dozen
numbers would cost more than all that is computed of them. The tests hold it against its plain form.
"""

import math

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids import clearance, collision
from sara_nav.grids.grid import Grid
from sara_nav.pursuit import path_tracker, smooth_speed

STEP, FINE = 0.1, 0.04
"""Way (m) between two places ahead that are looked at for speeds, and for what the footprint would touch."""
BEYOND = 0.3
"""Way (m) that is looked at beyond what braking takes."""
BLOCKED_BEFORE = 0.03
"""Way (m) before a place where the footprint would touch something at which it rests."""
CREEP = 0.02
"""The slowest speed (m/s) of the end of a leg, which would else be neared for ever."""
SUDDEN = 0.05
"""A cap that is missed by more than that (m) came suddenly, and is braked for harder."""
REACH = 1.2
"""How far (m) about the robot is looked for gaps."""
FREE, BEND, NARROW, AHEAD, END, BLOCKED = range(6)
"""Why it is slow."""


@kernel
def poses_along(ways, along, backward, s, xy, heading):
    """Return the robot's poses (n, 3) at ``along + ways`` (n,) m of a leg (s, xy, heading of its samples); beyond its
    end it goes straight on.
    """
    poses = np.empty((len(ways), 3))
    x, y = np.ascontiguousarray(xy[:, 0]), np.ascontiguousarray(xy[:, 1])
    for i in range(len(ways)):
        at = along + ways[i]
        over = max(at - s[-1], 0.0)
        direction = path_tracker.between(at, s, heading)
        poses[i, 0] = path_tracker.between(at, s, x) + over * math.cos(direction)
        poses[i, 1] = path_tracker.between(at, s, y) + over * math.sin(direction)
        poses[i, 2] = direction + (math.pi if backward else 0.0)
    return poses


@kernel
def spaced(end, step):
    """Return the ways (n,) m from 0 on, evenly, that are less than ``end``."""
    n = int(math.ceil(end / step))
    ways = np.empty(n)
    for i in range(n):
        ways[i] = i * step
    return ways


@kernel
def bend_cap(curvature, change, turn_gain, max_vel_theta, acc_lim_theta, max_lateral_acc):
    """Return the speed (m/s) that a bend (1/m) and its change (1/m2) allow: w = v k, its change v^2 k', lateral v^2
    k.
    """
    k, change = abs(curvature) + 1e-9, change + 1e-9
    return min(
        0.9 * turn_gain * max_vel_theta / k,
        math.sqrt(0.8 * turn_gain * acc_lim_theta / change),
        math.sqrt(max_lateral_acc / k),
    )


@kernel
def gap_cap(gap, narrow_vel, max_vel_x, wide_gap):
    """Return the speed (m/s) beside an obstacle: narrow_vel at a gap (m) of 0, max_vel_x from wide_gap on, evenly
    between.
    """
    return narrow_vel + (max_vel_x - narrow_vel) * min(gap / wide_gap, 1.0)


@kernel
def ahead_cap(free, stop_distance, reaction_time, dec):
    """Return the speed (m/s) at which a robot with ``free`` m before it can still react and come to rest."""
    way = max(free - stop_distance, 0.0)
    return dec * (math.sqrt(reaction_time * reaction_time + 2.0 * way / dec) - reaction_time)


@kernel
def free_way(
    look, along, backward, s, xy, heading, costs, origin_x, origin_y, resolution, points, box, offset, unknown_blocks
):
    """Return the way (m) along the leg until its footprint would touch more than it does now, +Inf where it does not
    within ``look``.
    """
    ways = spaced(look + FINE, FINE)
    ground = collision.Ground(costs, Grid(origin_x, origin_y, resolution), unknown_blocks)
    poses = collision.moved(poses_along(ways, along, backward, s, xy, heading), offset)
    touched = collision.touched(ground, points, box, poses)
    for i in range(len(ways)):
        if touched[i] > touched[0]:
            return ways[i] - BLOCKED_BEFORE - FINE
    return np.inf


@kernel
def pace(
    s,
    xy,
    heading,
    bends,
    changes,
    along,
    left,
    backward,
    speed,
    acceleration,
    curvature,
    turn_gain,
    dt,
    limits,
    sight,
    costs,
    origin_x,
    origin_y,
    resolution,
    corners,
    points,
    box,
    front,
    span,
    offset,
    unknown_blocks,
):
    """Return (speed, acceleration, cap, why, size, x, y) of the next command, see speed_plan.Pace; x, y (m, robot's
    frame): of what is narrow.

    s, xy, heading, bends, changes: the leg's samples (path_tracker.Leg). limits: max_vel_x or -min_vel_x, max_vel_x,
    acc_lim_x, comfort_dec_x, dec_lim_x, jerk_lim_x, max_vel_theta, acc_lim_theta, max_lateral_acc. sight: wide_gap,
    narrow_vel, ahead_angle's tangent, ahead_stop_distance, ahead_reaction_time, ahead_dec. front, span: see clearance.
    corners, points, box, offset: of the LocalWorld.
    """
    highest, max_vel_x, acc_lim_x, comfort_dec, hard_dec, jerk, max_vel_theta, acc_lim_theta, max_lateral_acc = limits
    wide_gap, narrow_vel, slope, stop_distance, reaction_time, ahead_dec = sight
    look = min(
        speed * 0.5 + smooth_speed.way_to_slow(speed, max(acceleration, 0.0), 0.0, comfort_dec, jerk) + BEYOND,
        max(left, 0.0),
    )
    ways = spaced(look + STEP, STEP)
    n = len(ways)
    poses = collision.moved(poses_along(ways, along, backward, s, xy, heading), offset)
    ground = collision.Ground(costs, Grid(origin_x, origin_y, resolution), unknown_blocks)
    view = clearance.Ahead(-1.0 if backward else 1.0, front, span, slope, REACH)
    gap, near_x, near_y, ahead = clearance.gaps(ground, corners, poses, view)
    free = free_way(
        look,
        along,
        backward,
        s,
        xy,
        heading,
        costs,
        origin_x,
        origin_y,
        resolution,
        points,
        box,
        offset,
        unknown_blocks,
    )
    places, caps, whys, index = np.empty(n + 2), np.empty(n + 2), np.empty(n + 2, np.int64), np.empty(n + 2, np.int64)
    kept = 0
    for i in range(n):
        at = along + ways[i]
        over = at > s[-1]
        bend = bend_cap(
            0.0 if over else path_tracker.between(at, s, bends),
            0.0 if over else path_tracker.between(at, s, changes),
            turn_gain,
            max_vel_theta,
            acc_lim_theta,
            max_lateral_acc,
        )
        if i == 0:
            bend = min(bend, max(0.9 * turn_gain * max_vel_theta / max(abs(curvature), 1e-6), CREEP))
        cap, why = bend, BEND
        beside = gap_cap(gap[i], narrow_vel, max_vel_x, wide_gap)
        if beside < cap:
            cap, why = beside, NARROW
        before = max(ahead_cap(ahead[i], stop_distance, reaction_time, ahead_dec), narrow_vel)
        if before < cap:
            cap, why = before, AHEAD
        if cap < highest:
            places[kept], caps[kept], whys[kept], index[kept] = ways[i], cap, why, i
            kept += 1
    places[kept], caps[kept], whys[kept], index[kept] = left, 0.0, END, 0
    kept += 1
    if free < np.inf:
        places[kept], caps[kept], whys[kept], index[kept] = free, 0.0, BLOCKED, 0
        kept += 1
    places, caps = places[:kept], caps[:kept]
    after, chosen, at = smooth_speed.following(
        speed, acceleration, highest, places, caps, acc_lim_x, comfort_dec, jerk, dt
    )
    if at >= 0 and places[at] - smooth_speed.way_to_slow(after, chosen, caps[at], comfort_dec, jerk) < -SUDDEN:
        after, chosen, _ = smooth_speed.following(
            speed, acceleration, highest, places, caps, acc_lim_x, hard_dec, jerk, dt
        )
    if chosen <= 0.0 and after < CREEP and left > 0.0 and free > 0.0:
        after, chosen = (CREEP if speed >= CREEP else min(speed + acc_lim_x * dt, CREEP)), 0.0
    if at < 0:
        return after, chosen, highest, FREE, 0.0, 0.0, 0.0
    why, i = whys[at], index[at]
    size = 0.0
    if why == NARROW:
        size = gap[i]
    elif why == AHEAD:
        size = ahead[i]
    elif why == END:
        size = max(left, 0.0)
    elif why == BLOCKED:
        size = max(free, 0.0)
    return after, chosen, caps[at], why, size, near_x[i], near_y[i]


def warm():
    """Compile, or load from the cache, the kernel for the types it is called with."""
    s, xy, corners = (
        np.array([0.0, 1.0]),
        np.array([[0.0, 0.0], [1.0, 0.0]]),
        np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]),
    )
    pace(
        s,
        xy,
        s,
        s,
        s,
        0.0,
        1.0,
        False,
        0.1,
        0.0,
        0.0,
        1.0,
        0.05,
        (0.5,) * 9,
        (0.5,) * 6,
        np.zeros((3, 3), np.uint8),
        0.0,
        0.0,
        1.0,
        corners,
        corners,
        (0.0,) * 5,
        1.0,
        1.0,
        (0.0, 0.0, 0.0),
        True,
    )
    gap_cap(0.1, 0.1, 0.5, 0.3)
