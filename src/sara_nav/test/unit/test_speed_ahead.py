"""Laws of the speed along a leg: of each rule by itself, and of a drive that keeps to all of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import LETHAL, Costmap
from sara_nav.grids.clearance import place_of
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import pad_footprint, parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.pursuit import speed_ahead
from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_speed import Motion
from sara_nav.pursuit.speed_plan import KINDS, SpeedPlan, driven_now, limits_of

CONFIG = RotateThenPursueConfig()
SARA = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
GRID = GridGeometry(120, 120, 0.05, -3.0, -3.0)
DT = 0.05
marks = st.lists(st.tuples(st.integers(0, 119), st.integers(0, 119)), max_size=6)


def arc(length, bend, backward=False):
    angles = np.linspace(0.0, length * bend, 30)
    return Leg(np.cumsum(np.column_stack([np.cos(angles), np.sin(angles)]) * length / 30, axis=0), backward)


def world_with(cells):
    costs = np.zeros(GRID.shape, np.uint8)
    for row, column in cells:
        costs[row, column] = LETHAL
    return LocalWorld(Costmap(costs, GRID), SARA)


def driven(leg, world, config=CONFIG, seconds=60.0):
    """An ideal base drives from rest at the leg's start to its end, or until it stands: (m along, Pace) each cycle."""
    plan, speed, acceleration, rows = SpeedPlan(config), 0.0, 0.0, []
    for _ in range(round(seconds / DT)):
        curvature = leg.bend(leg.along)[0]
        pace = plan.pace(
            leg, driven_now(Motion(speed, acceleration), curvature, 1.0, Pose2D(*leg.poses([leg.along])[0])), world, DT
        )
        rows.append((leg.along, pace))
        leg.along += 0.5 * (speed + pace.speed) * DT
        leg.left = leg.length - leg.along
        if leg.left <= 0.0 or speed == pace.speed == 0.0:
            return rows
        speed, acceleration = pace.speed, pace.acceleration
    return rows


def test_beside_a_wall_the_gap_counts_where_the_robot_is_not_where_its_path_is():
    """The path keeps 0.4 m off the wall, the robot has come 0.3 m nearer."""
    leg = Leg(np.array([(0.0, 0.0), (4.0, 0.0)]))
    world = world_with([GRID.to_cell(x, 0.71)[::-1] for x in np.arange(-1.0, 2.9, GRID.resolution)])
    speeds = [
        SpeedPlan(CONFIG).pace(leg, driven_now(Motion(0.5, 0.0), 0.0, 1.0, Pose2D(0.0, off, 0.0)), world, DT)
        for off in (0.0, 0.3)
    ]
    assert speeds[0].cause.kind != 'narrow'
    assert speeds[1].cause.kind == 'narrow' and speeds[1].cause.size < 0.15
    assert speeds[1].speed < speeds[0].speed == 0.5


@given(st.floats(-3.0, 3.0), st.floats(0.0, 3.0), st.floats(0.7, 1.1))
def test_a_bend_allows_the_speed_at_which_the_first_limit_is_reached(curvature, change, gain):
    limits = limits_of(CONFIG, False)
    v, k = speed_ahead.bend_cap(curvature, change, gain, limits), abs(curvature)
    shares = (
        v * k / (0.9 * gain * CONFIG.max_vel_theta),
        v * v * change / (0.6 * gain * CONFIG.acc_lim_theta),
        v * v * k / CONFIG.max_lateral_acc,
    )
    assert max(shares) <= 1.0 + 1e-9
    if k > 1e-3 or change > 1e-3:
        assert max(shares) == pytest.approx(1.0, abs=1e-5)


@given(st.floats(0.0, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 4.0))
def test_the_slowest_of_bend_gap_and_what_is_ahead_counts(bend, gap, ahead):
    c, limits = CONFIG, limits_of(CONFIG, False)
    beside = speed_ahead.gap_cap(gap, c.narrow_vel, c.max_vel_x, c.wide_gap)
    before = max(speed_ahead.ahead_cap(ahead, c.ahead_stop_distance, c.ahead_reaction_time, c.ahead_dec), c.narrow_vel)
    cap, why = speed_ahead.lowest_cap(bend, gap, ahead, limits, SpeedPlan(c).regulation)
    assert cap == min(bend, beside, before)
    assert cap == {'bend': bend, 'narrow': beside, 'ahead': before}[KINDS[why]]


@settings(max_examples=60)
@given(st.floats(0.5, 2.5), st.floats(-1.0, 1.0), st.booleans(), marks)
def test_a_drive_keeps_every_limit_touches_nothing_and_says_why_it_is_slow(length, bend, backward, cells):
    leg, world = arc(length, bend, backward), world_with(cells)
    at_start = int(world.touched(leg.poses([0.0]))[0])
    rows = driven(leg, world)
    along = np.array([a for a, _ in rows] + [leg.along])
    touched = world.touched(leg.poses(along))
    if at_start:  # between two looks one point more may lie on a cell
        assert touched.max() <= at_start + world.cover.weights.max()
    else:  # a corner may graze a cell between two looks, by half of what lies between them
        within = LocalWorld(world.costmap, pad_footprint(SARA, -0.5 * speed_ahead.FINE))
        assert within.touched(leg.poses(np.arange(0.0, leg.along, 0.002))).sum() == 0
    highest = -CONFIG.min_vel_x if backward else CONFIG.max_vel_x
    for (_, before), (_, after) in zip(rows, rows[1:]):
        assert 0.0 <= after.speed <= highest + 1e-12
        creeps = after.speed <= speed_ahead.CREEP + 1e-12
        assert creeps or -CONFIG.dec_lim_x <= after.acceleration <= CONFIG.acc_lim_x
        assert creeps or abs(after.acceleration - before.acceleration) <= CONFIG.jerk_lim_x * DT + 1e-9
    last = rows[-1][1]
    if leg.left <= 0.0:
        assert leg.left > -0.002 and last.speed <= 2.0 * speed_ahead.CREEP
    else:
        assert last.speed == 0.0
        assert last.cause.kind == 'blocked'
        ahead = leg.along + np.arange(0.0, speed_ahead.BLOCKED_BEFORE + 3 * speed_ahead.FINE, 0.01)
        assert world.touched(leg.poses(ahead)).max() > touched[-1]
    for _, pace in rows:
        assert pace.cause.size >= 0.0 and (pace.cause.where != '') == (pace.cause.kind == 'narrow')


@settings(max_examples=40)
@given(st.floats(0.1, 2.0))
def test_a_bend_is_driven_at_a_turn_rate_within_its_limit(bend):
    rows = driven(arc(2.3, bend), world_with(()))
    assert max(pace.speed for _, pace in rows) * bend <= 0.9 * CONFIG.max_vel_theta * 1.03


def test_every_cause_has_a_name():
    assert len(set(KINDS)) == 7 and place_of(1.0, 0.0, SARA) == 'front'
    assert [KINDS[i] for i in (speed_ahead.FREE, speed_ahead.END, speed_ahead.BLOCKED)] == ['free', 'end', 'blocked']
