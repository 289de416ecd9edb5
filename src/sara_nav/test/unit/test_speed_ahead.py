"""The compiled pace along a leg against its plain form: the same caps place by place, the same command, the same
cause.
"""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import LETHAL, Costmap
from sara_nav.grids.clearance import place_of, room
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_speed import SpeedLimits, next_speed, way_to_slow
from sara_nav.pursuit.speed_ahead import BEYOND, BLOCKED_BEFORE, CREEP, FINE, REACH, STEP, SUDDEN
from sara_nav.pursuit.speed_plan import KINDS, SpeedPlan

CONFIG = RotateThenPursueConfig()
SARA = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
GRID = GridGeometry(120, 120, 0.05, -3.0, -3.0)
marks = st.lists(st.tuples(st.integers(0, 119), st.integers(0, 119)), max_size=6)


def ahead_speed(free, c):
    """The speeds (m/s) at which a robot with `free` m before it (array) can still react and come to rest: v t + v^2 / 2
    a = free - stop.
    """
    way = np.maximum(np.asarray(free, float) - c.ahead_stop_distance, 0.0)
    return c.ahead_dec * (np.sqrt(c.ahead_reaction_time**2 + 2.0 * way / c.ahead_dec) - c.ahead_reaction_time)


def gap_speed(gap, c):
    """The speeds (m/s) beside obstacles: narrow_vel at a gap (m, array) of 0, max_vel_x from wide_gap on, evenly
    between.
    """
    return c.narrow_vel + (c.max_vel_x - c.narrow_vel) * np.minimum(np.asarray(gap, float) / c.wide_gap, 1.0)


def bend_speed(leg, s, turn_gain, c):
    """The speeds (m/s) at s (n,) m along that the path's bends allow: w = v k, its change v^2 k', lateral v^2 k."""
    k = np.abs(leg.at(s)[3]) + 1e-9
    change = np.where(s > leg.length, 0.0, np.interp(s, leg.s, np.abs(leg.change))) + 1e-9
    return np.minimum.reduce(
        [
            0.9 * turn_gain * c.max_vel_theta / k,
            np.sqrt(0.8 * turn_gain * c.acc_lim_theta / change),
            np.sqrt(c.max_lateral_acc / k),
        ]
    )


def plain(leg, speed, acceleration, curvature, world, gain, dt, c=CONFIG):
    """(speed, acceleration, cap, kind) as speed_ahead's text has it, array by array."""
    highest = c.max_vel_x if not leg.backward else -c.min_vel_x
    look = speed * 0.5 + way_to_slow(speed, max(acceleration, 0.0), 0.0, c.comfort_dec_x, c.jerk_lim_x) + BEYOND
    ways = np.arange(0.0, min(look, max(leg.left, 0.0)) + STEP, STEP)
    s = leg.along + ways
    seen = room(world, leg.poses(s), leg.backward, c.ahead_angle, REACH)
    options = np.vstack(
        [bend_speed(leg, s, gain, c), gap_speed(seen.gap, c), np.maximum(ahead_speed(seen.ahead, c), c.narrow_vel)]
    )
    options[0, 0] = min(options[0, 0], max(0.9 * gain * c.max_vel_theta / max(abs(curvature), 1e-6), CREEP))
    fine = np.arange(0.0, min(look, max(leg.left, 0.0)) + FINE, FINE)
    touched = world.touched(leg.poses(leg.along + fine))
    worse = np.flatnonzero(touched > touched[0])
    free = fine[worse[0]] - BLOCKED_BEFORE - FINE if len(worse) else math.inf
    ways, caps = np.append(ways, [leg.left, free]), np.append(options.min(axis=0), [0.0, 0.0])
    picked = [k for k in range(len(ways)) if (caps[k] < highest or k >= len(ways) - 2) and math.isfinite(ways[k])]
    limits = SpeedLimits(c.acc_lim_x, c.comfort_dec_x, c.jerk_lim_x)
    after, chosen, at = next_speed(speed, acceleration, highest, ways[picked], caps[picked], limits, dt)
    k = picked[at] if at >= 0 else -1
    if k >= 0 and ways[k] - way_to_slow(after, chosen, caps[k], c.comfort_dec_x, c.jerk_lim_x) < -SUDDEN:
        after, chosen, _ = next_speed(
            speed,
            acceleration,
            highest,
            ways[picked],
            caps[picked],
            SpeedLimits(c.acc_lim_x, c.dec_lim_x, c.jerk_lim_x),
            dt,
        )
    if chosen <= 0.0 and after < CREEP and leg.left > 0.0 and free > 0.0:
        after, chosen = CREEP if speed >= CREEP else min(speed + c.acc_lim_x * dt, CREEP), 0.0
    if k < 0:
        return after, chosen, highest, 'free', 0.0
    n = len(ways) - 2
    kind = 'end' if k == n else 'blocked' if k == n + 1 else ('bend', 'narrow', 'ahead')[int(options[:, k].argmin())]
    size = {
        'end': max(leg.left, 0.0),
        'blocked': max(free, 0.0),
        'bend': 0.0,
        'narrow': seen.gap[min(k, n - 1)],
        'ahead': seen.ahead[min(k, n - 1)],
    }[kind]
    return after, chosen, caps[k], kind, size


@settings(deadline=None, max_examples=150)
@given(
    st.floats(0.3, 3.0),
    st.floats(-1.2, 1.2),
    st.booleans(),
    st.floats(0.0, 1.0),
    st.floats(0.0, 0.5),
    st.floats(-0.3, 0.3),
    st.floats(-1.0, 1.0),
    st.floats(0.7, 1.1),
    marks,
    st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0)),
)
def test_the_pace_is_that_of_the_plain_form(
    length, bend, backward, share, speed, acceleration, curvature, gain, cells, offset
):
    angles = np.linspace(0.0, length * bend, 30)
    points = np.cumsum(np.column_stack([np.cos(angles), np.sin(angles)]) * length / 30, axis=0)
    leg = Leg(points, backward)
    leg.locate(*points[int(share * 29)])
    costs = np.zeros(GRID.shape, np.uint8)
    for row, column in cells:
        costs[row, column] = LETHAL
    world = LocalWorld(Costmap(costs, GRID), SARA, offset=Pose2D(*offset))
    assume(leg.left > 0.0)
    plan = SpeedPlan(CONFIG)
    plan.acceleration = acceleration
    found = plan.pace(leg, speed, curvature, world, gain, 0.05)
    after, chosen, cap, kind, size = plain(leg, speed, acceleration, curvature, world, gain, 0.05)
    assert (found.speed, found.acceleration, found.cap) == pytest.approx((after, chosen, cap), abs=1e-9)
    assert found.cause.kind == kind and found.cause.size == pytest.approx(size, abs=1e-9)
    assert (found.cause.where != '') == (kind == 'narrow')


def test_every_cause_has_a_name():
    assert len(set(KINDS)) == 6 and place_of(1.0, 0.0, SARA) == 'front'
