"""The planner follows plans as they were made: in reverse, round bends, turning where they turn; and says what it
does.
"""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent))
from test_driving import FOOTPRINT, SimChair, costmap, degrees_between, room  # noqa: E402

from sara_common.planar import Pose2D, wrap  # noqa: E402
from sara_nav.grids import clearance  # noqa: E402
from sara_nav.grids.collision import LocalWorld  # noqa: E402
from sara_nav.move_base.local_planners import (
    BLOCKED,
    DRIVING,
    OFF_PATH,
    REACHED,
    RotateThenPursue,
    RotateThenPursueConfig,
)  # noqa: E402
from sara_nav.pursuit.speed_plan import gap_speed  # noqa: E402

HALL = LocalWorld(costmap(room()).costmap, FOOTPRINT)


def leg(start, length, bend=0.0, spacing=0.05):
    """Rows (n, 3) from a pose on: length < 0 in reverse; bend: curvature (1/m) of the way as the robot's yaw changes
    along it.
    """
    pose, rows = Pose2D(*start), [start]
    for _ in range(round(abs(length) / spacing)):
        pose = pose.advance(math.copysign(spacing, length), math.copysign(spacing, length) * bend, 1.0)
        rows.append((pose.x, pose.y, pose.yaw))
    return rows


def turn(start, angle, step=0.1):
    """Rows of a turn in place by ``angle`` (rad), either way round."""
    n = max(1, math.ceil(abs(angle) / step))
    return [(start[0], start[1], start[2] + angle * k / n) for k in range(1, n + 1)]


def drive(plan, chair=None, world=HALL, planner=None, limit=90.0, replan=None):
    """Drive a plan (n, 3) with the chair of test_driving; return (LocalCommand at the end, chair, [(t, pose, command),
    ...]).
    """
    plan = np.array(plan, float)
    planner, chair = planner or RotateThenPursue(), chair or SimChair(Pose2D(*plan[0]), pose_period=0.02)
    planner.start(plan)
    trail, began = [], chair.t
    while chair.t - began < limit:
        pose, velocity, stamp = chair.seen()
        if replan and abs(chair.t - began - replan[0]) < 0.025:
            planner.replan(np.array(replan[1](pose), float))
        command = planner.update(chair.t, 0.05, pose, velocity, chair.t - stamp, world)
        trail.append((chair.t, chair.pose, command))
        chair.command(command.v, command.w)
        if command.state != DRIVING:
            break
        for _ in range(5):
            chair.advance()
    for _ in range(50):
        chair.advance()
    return command, chair, trail


def off_path(plan, trail):
    """The greatest distance (m) of the chair from the rows of its plan."""
    points = np.array(plan, float)[:, :2]
    return max(np.hypot(*(points - (p.x, p.y)).T).min() for _, p, _ in trail) - 0.5 * 0.05


def arrived(chair, plan, metres=0.03, degrees=1.5):
    end = Pose2D(*plan[-1])
    return chair.pose.distance(end) < metres and degrees_between(chair.pose.yaw, end.yaw) < degrees


@pytest.mark.parametrize('bend', [0.0, 0.5, -0.8])
def test_a_leg_in_reverse_is_driven_in_reverse(bend):
    plan = leg((3.0, 3.0, 0.4), -1.5, bend)
    command, chair, trail = drive(plan)
    assert command.state == REACHED and arrived(chair, plan)
    assert (
        all(c.v <= 0.0 for _, _, c in trail)
        and min(c.v for _, _, c in trail) >= RotateThenPursueConfig().min_vel_x - 1e-9
    )
    assert off_path(plan, trail) < 0.03
    assert any('in reverse' in c.text for _, _, c in trail)


def test_changes_of_direction_come_to_rest_first():
    plan = leg((2.0, 3.0, 0.0), 1.0)
    plan += leg(plan[-1], -0.8, 0.6)[1:]
    plan += leg(plan[-1], 1.2, -0.4)[1:]
    command, chair, trail = drive(plan)
    assert command.state == REACHED and arrived(chair, plan) and off_path(plan, trail) < 0.03
    v = np.array([c.v for _, _, c in trail])
    senses = [math.copysign(1.0, x) for x in v if x]
    assert sum(a != b for a, b in zip(senses, senses[1:])) == 2
    flips = [i for i in range(1, len(v)) if v[i - 1] == 0.0 and v[i] != 0.0]
    assert len(flips) == 2 and all(abs(chair_speed(trail, i)) < 0.05 for i in flips)
    assert any('a change of direction' in c.text for _, _, c in trail)


def chair_speed(trail, i):
    (t0, a, _), (t1, b, _) = trail[i - 1], trail[i]
    return a.distance(b) / (t1 - t0)


@settings(max_examples=12)
@given(st.floats(0.6, 5.5).flatmap(lambda size: st.sampled_from([size, -size])))
def test_a_turn_in_a_plan_is_made_where_it_is_and_the_way_round_that_it_is(angle):
    plan = leg((3.0, 3.0, 0.2), 0.8)
    corner = plan[-1]
    plan += turn(corner, angle)
    plan += leg(plan[-1], 0.7)[1:]
    command, chair, trail = drive(plan)
    assert command.state == REACHED and arrived(chair, plan)
    assert math.degrees(chair.turned) == pytest.approx(math.degrees(angle), abs=3.0)
    in_place = [p for _, p, c in trail if c.v == 0.0 and abs(c.w) > 0.1]
    assert max(p.distance(Pose2D(*corner)) for p in in_place) < 0.03
    assert off_path(plan, trail) < 0.03


@pytest.mark.parametrize('angle', [0.3, -0.4])
def test_a_slight_turn_between_two_legs_is_driven_as_a_bend(angle):
    plan = leg((2.0, 3.0, 0.0), 1.5)
    plan += turn(plan[-1], angle)
    plan += leg(plan[-1], 1.5)[1:]
    command, chair, trail = drive(plan)
    assert command.state == REACHED and arrived(chair, plan) and off_path(plan, trail) < 0.04
    under_way = [c.v for t, _, c in trail if 2.0 < t < 5.0]
    assert min(under_way) > 0.1, 'it did not stop'


def test_a_turn_at_the_end_of_a_plan_goes_the_planned_way_round():
    plan = leg((3.0, 3.0, 0.0), 1.0)
    plan += turn(plan[-1], -4.2)
    command, chair, _ = drive(plan)
    assert command.state == REACHED and arrived(chair, plan)
    assert chair.turned == pytest.approx(-4.2, abs=0.05)


def test_a_way_that_ends_where_it_began_is_driven_all_the_same():
    plan = leg((3.0, 3.0, 0.0), 0.6, 1.2)
    plan += leg(plan[-1], -0.6, -1.2)[1:]  # a change of heading without turning in place
    back = plan[-1]
    plan[-1] = (back[0], back[1], back[2])
    command, chair, trail = drive(plan)
    assert command.state == REACHED and arrived(chair, plan)
    assert max(c.v for _, _, c in trail) > 0.05 > -0.05 > min(c.v for _, _, c in trail)


@settings(max_examples=10)
@given(st.floats(-0.9, 0.9), st.floats(1.0, 1.3), st.sampled_from([0.02, 0.1]))
def test_bends_are_followed_within_all_limits_of_speed_acceleration_and_jerk(bend, slip, period):
    plan = leg((1.5, 3.0, 0.0), 0.6) + leg((2.1, 3.0, 0.0), 1.2, bend)[1:]
    chair = SimChair(Pose2D(*plan[0]), slip=slip, pose_period=period)
    command, chair, trail = drive(plan, chair)
    c = RotateThenPursueConfig()
    assert command.state == REACHED and arrived(chair, plan, 0.04) and off_path(plan, trail) < 0.04
    v, w = (np.array([getattr(command, name) for _, _, command in trail[:-1]]) for name in 'vw')
    assert v.max() <= c.max_vel_x + 1e-9 and np.abs(w).max() <= c.max_vel_theta + 1e-9
    dv, dw = np.diff(v) / 0.05, np.diff(w) / 0.05
    assert dv.max() <= c.acc_lim_x + 1e-6 and dv.min() >= -c.dec_lim_x - 1e-6
    moving = (v[1:] > 0.03) & (v[:-1] > 0.03)  # at the ends of a leg it creeps
    assert np.abs(dw).max() <= c.acc_lim_theta + 0.02 / 0.05 + 1e-6
    both = moving[1:] & moving[:-1]
    assert np.abs(np.diff(dv))[both].max() <= c.jerk_lim_x * 0.05 + 1e-6
    assert np.abs(np.diff(dw))[both].max() <= c.jerk_lim_theta * 0.05 + 1e-6


def test_it_drives_on_when_a_better_plan_begins_where_it_is():
    plan = leg((1.0, 3.0, 0.0), 4.0)
    command, chair, trail = drive(plan, replan=(4.0, lambda pose: leg((pose.x, pose.y, pose.yaw), 5.0 - pose.x)))
    assert command.state == REACHED
    assert min(c.v for t, _, c in trail if 3.0 < t < 6.0) > 0.3


def walls(*boxes):
    """A LocalWorld of the hall with boxes (x0, x1, y0, y1; m)."""
    data = room()
    for x0, x1, y0, y1 in boxes:
        data[
            round((y0 + 1.0) / 0.05) : round((y1 + 1.0) / 0.05), round((x0 + 1.0) / 0.05) : round((x1 + 1.0) / 0.05)
        ] = 100
    return LocalWorld(costmap(data).costmap, FOOTPRINT)


def test_a_door_of_80_cm_is_driven_through_slowly_and_said():
    world = walls((3.0, 3.15, 0.0, 2.6), (3.0, 3.15, 3.4, 6.0))
    plan = leg((1.2, 3.0, 0.0), 3.6)
    command, chair, trail = drive(plan, world=world)
    assert command.state == REACHED
    inside = [(p, c) for _, p, c in trail if 2.6 < p.x < 3.4]
    assert max(c.v for _, c in inside) < 0.3 and world.touched([(p.x, p.y, p.yaw) for _, p, _ in trail]).max() == 0
    assert max(abs(p.y - 3.0) for p, _ in inside) < 0.02 and max(abs(math.degrees(p.yaw)) for p, _ in inside) < 2.0
    assert any('narrow, 0.1' in c.text or 'free ahead' in c.text for _, _, c in trail)
    # The same way in the open takes less.
    assert drive(plan)[2][-1][0] < trail[-1][0] - 3.0


def test_it_comes_to_rest_before_what_stands_on_the_path_and_says_where():
    world = walls((3.5, 3.7, 3.2, 3.6))  # on the left half of the way
    command, chair, trail = drive(leg((1.0, 3.0, 0.0), 4.5), world=world)
    assert command.state == BLOCKED and 'front left' in command.text and (command.v, command.w) == (0.0, 0.0)
    assert not world.collides(chair.pose) and 3.5 - 0.54 - 0.2 < chair.pose.x < 3.5 - 0.54
    v = [c.v for _, _, c in trail[:-1]]
    assert min(np.diff(v)) / 0.05 >= -RotateThenPursueConfig().dec_lim_x - 1e-6 and v[-1] < 0.06, 'braked in time'


def test_the_long_way_round_is_turned_only_where_the_short_one_is_not_free():
    for world, turned in ((HALL, 1.8), (walls((2.85, 3.0, 3.45, 3.6)), 1.8 - 2 * math.pi)):
        plan = [(3.0, 3.0, 0.0), (3.0, 3.0, 0.0 + 1e-12), (3.0, 3.0, 1.8)]
        command, chair, _ = drive(plan[:2] + [(3.0, 3.0, 1.8)], world=world)
        if command.state == REACHED:
            assert chair.turned == pytest.approx(turned, abs=0.05)
        else:
            assert 'no room to turn left by 103 deg' in command.text and turned < 0.0


@pytest.mark.parametrize('free', [0.10, 0.16, 0.25])
def test_a_turn_sweeps_past_walls_no_faster_than_the_chair_drives_past_them_and_no_slower_than_that_needs(free):
    wall = 3.0 + math.hypot(0.54, 0.29) + free
    world, c = walls((1.0, 5.0, wall, wall + 0.2)), RotateThenPursueConfig()
    command, chair, trail = drive([(3.0, 3.0, 0.0), (3.0, 3.0, 3.0)], world=world)
    assert command.state == REACHED and world.touched([(p.x, p.y, p.yaw) for _, p, _ in trail]).max() == 0
    corner = float(np.hypot(*FOOTPRINT.T).max()) / chair.slip
    gaps = clearance.room(world, [(p.x, p.y, p.yaw) for _, p, _ in trail], False, c.ahead_angle, c.wide_gap).gap
    swept = np.abs([k.w for _, _, k in trail]) * corner
    allowed = np.array([gap_speed(gap, c) for gap in gaps])
    assert (swept <= np.maximum(allowed, 0.02) + 0.02).all()
    fastest = min(c.max_vel_theta * corner, gap_speed(gaps.min(), c))
    narrow = gaps < gaps.min() + 0.02
    assert swept[narrow].max() >= 0.9 * fastest


def test_no_room_to_turn_is_said_before_anything_moves():
    world = walls((2.0, 4.0, 3.35, 3.6), (2.0, 4.0, 2.4, 2.65))
    command, chair, trail = drive([(3.0, 3.0, 0.0), (3.0, 3.0, 1.5)], world=world)
    assert command.state == BLOCKED and 'no room to turn left by 86 deg' in command.text and 'left' in command.text
    assert chair.pose == Pose2D(3.0, 3.0, 0.0)


def test_far_off_its_path_it_asks_for_another():
    plan = leg((2.0, 3.0, 0.0), 3.0)
    command, _, _ = drive(plan, SimChair(Pose2D(2.0, 3.6, 0.0), pose_period=0.02))
    assert command.state == OFF_PATH and '0.60 m off its path' in command.text


@settings(max_examples=8)
@given(st.floats(-0.3, 0.3), st.floats(-0.07, 0.07))
def test_it_comes_back_onto_a_straight_path_without_weaving(offset, heading):
    plan = leg((1.0, 3.0, 0.0), 4.0)
    command, chair, trail = drive(plan, SimChair(Pose2D(1.2, 3.0 + offset, heading), pose_period=0.02))
    assert command.state == REACHED and arrived(chair, plan)
    side = [p.y - 3.0 for _, p, _ in trail if p.x > 2.8]
    assert max(map(abs, side)) < 0.03
    rates = [math.copysign(1.0, c.w) for _, _, c in trail if abs(c.w) > 0.05 and c.v > 0.05]
    assert sum(a != b for a, b in zip(rates, rates[1:])) <= 1


def test_sentences_are_short_and_do_not_flicker():
    plan = leg((1.0, 3.0, 0.0), 3.0)
    plan += turn(plan[-1], 1.6)
    plan += leg(plan[-1], 1.5)[1:]
    _, _, trail = drive(plan)
    said = [c.text for _, _, c in trail if c.state == DRIVING]
    assert all(said) and max(map(len, said)) < 80
    changes = sum(a != b for a, b in zip(said, said[1:]))
    assert changes < 1.5 * trail[-1][0]
    assert said[0] == 'follows the path, 0.50 m/s' and any(text.endswith(': a turn') for text in said)
    assert any(text.startswith('turns left in place') for text in said) and any(
        text.endswith(': the goal') for text in said
    )


def test_a_plan_whose_yaw_is_nothing_is_driven_forward():
    plan = np.array(leg((2.0, 3.0, 1.0), 2.0))
    plan[:, 2] = 0.0  # as the peer's navfn gives it: orientation 0 everywhere
    command, chair, trail = drive(plan, SimChair(Pose2D(2.0, 3.0, 1.0), pose_period=0.02))
    assert command.state == REACHED and all(c.v >= 0.0 for _, _, c in trail)
    assert degrees_between(chair.pose.yaw, 0.0) < 2.5 and abs(wrap(trail[40][1].yaw - 1.0)) < 0.1
