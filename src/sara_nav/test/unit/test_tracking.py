"""What the default local planner is made of: stages of a plan, smooth legs, the tracking law, prediction, gaps and
speeds ahead.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D, wrap
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.clearance import place_of, room
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import GridGeometry
from sara_nav.pursuit.curvature_law import STEEPEST, Bend, Deviation, TrackingLaw
from sara_nav.pursuit.messages import Words
from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.plan_stages import Stretch, Turn, final_angle, stages
from sara_nav.pursuit.prediction import Prediction
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_turn import free_angle, planned_way, way_round
from sara_nav.pursuit.speed_ahead import ahead_cap
from sara_nav.pursuit.speed_plan import gap_speed
from sara_nav.pursuit.stopping_path import MARGIN, REACTION, blocked_where, stopping_path

FOOTPRINT = np.array([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
CONFIG = RotateThenPursueConfig()


def arc(start, length, bend, spacing=0.05):
    pose, rows = start, [(start.x, start.y, start.yaw)]
    for _ in range(round(abs(length) / spacing)):
        pose = pose.advance(math.copysign(spacing, length), math.copysign(spacing, length) * bend, 1.0)
        rows.append((pose.x, pose.y, pose.yaw))
    return rows


LEGS = st.lists(
    st.tuples(st.sampled_from(['ahead', 'astern', 'turn']), st.floats(0.3, 2.0), st.floats(-1.0, 1.0)),
    min_size=1,
    max_size=6,
)


@given(LEGS, st.floats(-3.0, 3.0))
def test_stages_are_what_the_plan_was_made_of(parts, yaw):
    """Legs of other sense and turns beyond a corner are told apart; what is alike is one."""
    rows, expected, angle = [(1.0, 2.0, yaw)], [], 0.0
    for kind, size, bend in parts:
        last = Pose2D(*rows[-1])
        if kind == 'turn':
            turn = math.copysign(0.4 + size, bend)
            rows += [(last.x, last.y, last.yaw + turn * k / 30) for k in range(1, 31)]
            angle += turn
            continue
        if angle:
            expected.append(('turn', angle))
        angle = 0.0
        rows += arc(last, size if kind == 'ahead' else -size, bend)[1:]
        if not expected or expected[-1] != (kind,):
            expected.append((kind,))
    found = stages(np.array(rows), 0.5)
    # A turn that undoes another, and one of less than a corner between legs alike, is none.
    if all(abs(entry[1]) > 0.55 for entry in expected if len(entry) == 2):
        assert [('turn',) if isinstance(s, Turn) else ('astern' if s.backward else 'ahead',) for s in found] == [
            entry[:1] for entry in expected
        ]
        for stage, entry in zip(found, expected):
            if isinstance(stage, Turn):
                assert stage.angle == pytest.approx(entry[1], abs=1e-6)
    assert final_angle(rows) == pytest.approx(angle, abs=1e-6)


def test_a_sharp_bend_of_a_plan_without_turns_parts_two_legs_with_straight_ends():
    points = [(0.0, 0.0), (1.0, 0.0), (1.05, 0.02), (1.08, 0.06), (1.09, 0.1), (1.1, 1.0)]
    plan = np.array(
        [(*a, math.atan2(b[1] - a[1], b[0] - a[0])) for a, b in zip(points, points[1:])] + [(*points[-1], 3.0)]
    )
    first, second = stages(plan, 0.5)
    assert isinstance(first, Stretch) and not first.backward and np.allclose(first.points[-1], second.points[0])
    assert abs(Leg(first.points).heading[-1]) < 0.2 and abs(Leg(second.points).heading[0] - 0.5 * math.pi) < 0.3


@given(st.floats(-1.5, 1.5), st.floats(0.5, 3.0), st.floats(-3.0, 3.0))
def test_straights_and_arcs_stay_what_they_are_when_smoothed(bend, length, yaw):
    rows = np.array(arc(Pose2D(1.0, 2.0, yaw), length, bend))
    leg = Leg(rows[:, :2])
    assert leg.length == pytest.approx(abs(length), abs=0.06)
    assert np.allclose(leg.curvature, bend, atol=0.03 + 0.03 * abs(bend))
    assert abs(wrap(leg.heading[0] - yaw)) < 0.01 and abs(wrap(leg.heading[-1] - rows[-1, 2])) < 0.01
    along, offset, left = leg.nearest(*rows[len(rows) // 2, :2], max(0.5 * length - 0.3, 0.0))
    assert abs(offset) < 0.003 and along + left == pytest.approx(leg.length)


def plan_of(points):
    return np.array(
        [(*a, math.atan2(b[1] - a[1], b[0] - a[0])) for a, b in zip(points, points[1:])] + [(*points[-1], 0.0)]
    )


def test_legs_split_at_sharp_corners_only():
    assert len(stages(plan_of([(0, 0), (1, 0), (2, 0.3), (3, 0.3)]), 0.5)) == 1
    found = stages(plan_of([(0, 0), (1, 0), (1, 1), (2, 1)]), 0.5)
    assert [Leg(stretch.points).length for stretch in found] == pytest.approx([1.0, 1.0, 1.0])


@given(st.floats(-0.4, 1.4), st.floats(-0.3, 0.3))
def test_a_straight_leg_knows_where_one_is(x, y):
    leg = Leg([(0.0, 0.0), (0.9, 0.0)])
    leg.locate(x, y)
    assert leg.left == pytest.approx(0.9 - max(x, 0.0), abs=1e-6) and leg.offset == pytest.approx(y, abs=1e-6)
    assert leg.poses([leg.along + 5.0])[0, 0] == pytest.approx(min(max(x, 0.0), 0.9) + 5.0, abs=1e-6)


def test_progress_never_falls_where_a_path_crosses_itself():
    leg = Leg([(0, 0), (2, 0), (2, 2), (1, 2), (1, -1)])
    for x in np.arange(0.0, 1.0, 0.1):
        leg.locate(x, 0.0)
    assert leg.along < 1.0
    leg.locate(1.0, 0.0)
    assert leg.along == pytest.approx(1.0, abs=1e-3)
    leg.locate(0.2, 0.0)
    assert leg.along == pytest.approx(1.0, abs=1e-3)


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), min_size=2, max_size=8), st.floats(0.0, 0.05))
def test_no_path_is_moved_far_and_beside_it_left_is_positive(steps, deviation):
    points = np.cumsum([(0.0, 0.0)] + [(0.3 + abs(x), y) for x, y in steps], axis=0)
    leg = Leg(points, deviation=deviation)
    dense = np.column_stack(
        [np.interp(np.linspace(0, len(points) - 1, 2000), np.arange(len(points)), points[:, k]) for k in (0, 1)]
    )
    off = max(np.hypot(*(dense - p).T).min() for p in leg.xy)
    assert off <= deviation + 0.035  # the last smoothing takes the corners
    x, y, heading = leg.poses([0.5 * leg.length])[0]
    leg.locate(leg.xy[0, 0], leg.xy[0, 1])
    _, offset, _ = leg.nearest(
        float(x) - 0.05 * math.sin(heading), float(y) + 0.05 * math.cos(heading), 0.5 * leg.length - 0.2
    )
    assert 0.0 < offset < 0.06


@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-0.5, 0.5), st.floats(0.02, 0.5), st.floats(-0.8, 0.8))
def test_errors_die_out_in_path_length_at_every_speed(offset, heading, off_curvature, speed, bend):
    law, way = TrackingLaw(0.25, 0.6), 0.005
    curvature, crossings, last = bend + off_curvature, 0, 0.0
    for _ in range(round(12.0 * law.reach(speed) / way)):
        curvature = law.next_curvature(curvature, way, Deviation(offset, heading), Bend(bend, 0.0), speed)
        middle = heading + 0.5 * way * (curvature - bend)
        offset += way * math.sin(middle)
        heading += way * (curvature - bend * math.cos(middle) / (1.0 - bend * offset))
        if abs(offset) > 0.005 and offset * last < 0.0:
            crossings += 1
        last = offset if abs(offset) > 0.005 else last
    assert abs(offset) < 0.01 and abs(heading) < 0.02 and abs(curvature - bend) < 0.1
    assert crossings <= 1
    assert abs(law.heading(1e3, speed)) == STEEPEST


LATENCY = st.floats(0.05, 0.3)


@given(st.floats(1.0, 1.4), LATENCY, LATENCY, st.floats(0.0, 0.15), st.sampled_from([0.02, 0.1]))
def test_the_pose_at_which_a_command_acts_is_foretold_on_a_base_that_slips_and_answers_late(
    slip, latency, turn_latency, delay, period
):
    prediction, pose = Prediction(latency, turn_latency), Pose2D(0.0, 0.0, 0.0)
    told, ahead, t, worst = [], [], 0.0, 0.0
    late, turns_late = (round(s / 0.01) for s in (latency, turn_latency))
    seen = [(0.0, pose, (0.0, 0.0))]
    truth = {}
    for tick in range(2400):
        t = tick / 100.0
        if tick % 5 == 0:
            stamp, at, velocity = [s for s in seen if s[0] <= t - delay + 1e-9][-1] if t >= delay else seen[0]
            guess = prediction.ahead(t, at, t - stamp, velocity[0], 0.05)
            ahead.append((tick + late, guess))
            command = 0.3 + 0.2 * math.sin(0.4 * t), 0.35 * math.sin(0.7 * t)
            prediction.commanded(t, *command)
        told.append(command)
        v, w = (told[tick - by][axis] if tick >= by else 0.0 for axis, by in enumerate((late, turns_late)))
        pose = pose.advance(v, w / slip, 0.01)
        truth[tick + 1] = pose
        if (tick + 1) % round(100 * period) == 0:
            seen.append(((tick + 1) / 100.0, pose, (v, w / slip)))
    for tick, guess in ahead[160:]:
        if tick in truth:
            worst = max(worst, guess.distance(truth[tick]), abs(wrap(guess.yaw - truth[tick].yaw)))
    assert worst < (0.02 if latency <= turn_latency else 0.05)  # a turn rate yet to be commanded is not foretold
    assert prediction.turn_gain == pytest.approx(1.0 / slip, abs=0.05)


def test_a_turn_in_place_is_foretold_to_when_a_turn_rate_acts():
    prediction, rest = Prediction(0.4, 0.1), Pose2D(1.0, 1.0, 0.0)
    prediction.ahead(0.0, rest, 0.0, 0.0, 0.05)
    prediction.commanded(0.0, 0.0, 0.5)
    assert prediction.ahead(0.1, rest, 0.0, 0.0, 0.05).yaw == pytest.approx(0.05)
    assert prediction.ahead(0.2, rest, 0.2, 0.0, 0.05).yaw == pytest.approx(0.1)


def test_a_base_that_is_held_is_not_foretold_to_move_and_teaches_nothing():
    prediction, pose = Prediction(0.17, 0.17), Pose2D(1.0, 1.0, 0.0)
    for i in range(100):
        guess = prediction.ahead(0.05 * i, pose, 0.0, 0.0, 0.05)
        prediction.commanded(0.05 * i, 0.2, 0.3)
    assert guess.distance(pose) < 0.01 and abs(guess.yaw) < 0.02 and prediction.turn_gain == 1.0
    assert prediction.driven(0.2) < 0.01 and prediction.driven(-0.2) == 0.2
    for velocity in (1e9, -1e9):  # nonsense of a wheel
        assert prediction.ahead(5.0, pose, 0.0, velocity, 0.05).distance(pose) < 0.25


@pytest.mark.parametrize('sense', [1.0, -1.0])
def test_prediction_knows_how_fast_the_base_drives_that_is_slowed(sense):
    prediction, pose = Prediction(0.17, 0.17), Pose2D(1.0, 1.0, 0.0)
    for i in range(60):
        prediction.ahead(0.05 * i, pose, 0.0, sense * 0.06, 0.05)
        prediction.commanded(0.05 * i, sense * 0.35, 0.0)
        pose = Pose2D(pose.x + sense * 0.003, 1.0, 0.0)
    assert prediction.driven(sense * 0.35) == pytest.approx(0.06, abs=0.005)
    assert prediction.driven(0.0) == 0.0


def world(*cells):
    costs = np.zeros((120, 120), np.uint8)
    for x, y in cells:
        costs[int((y + 3.0) / 0.05), int((x + 3.0) / 0.05)] = 254
    return LocalWorld(Costmap(costs, GridGeometry(120, 120, 0.05, -3.0, -3.0)), FOOTPRINT)


@given(st.integers(-20, 20), st.integers(-20, 20), st.floats(-3.1, 3.1))
def test_the_gap_is_the_distance_of_the_outline_from_what_is_nearest(column, row, yaw):
    cell = (column + 0.5) * 0.05, (row + 0.5) * 0.05
    found = room(world(cell), [[0.0, 0.0, yaw]], False, 0.7, 1.5)
    c, s = math.cos(yaw), math.sin(yaw)
    bx, by = c * cell[0] + s * cell[1], c * cell[1] - s * cell[0]
    outside = math.hypot(max(abs(bx) - 0.54, 0.0), max(abs(by) - 0.29, 0.0))
    assert found.gap[0] == pytest.approx(max(outside - 0.025, 0.0), abs=1e-6)
    if outside > 0.0:
        assert (found.x[0], found.y[0]) == pytest.approx((bx, by), abs=1e-6)
    straight = bx - 0.54 > 0.0 and abs(by) < 0.6 * 0.29
    if straight:
        assert found.ahead[0] == pytest.approx(max(bx - 0.54 - 0.025, 0.0), abs=1e-6)
    elif bx < 0.54 or abs(by) - 0.6 * 0.29 > math.tan(0.7) * (bx - 0.54) + 1e-6:
        assert found.ahead[0] == math.inf


def test_places_have_names():
    for (x, y), name in {
        (0.7, 0.0): 'front',
        (0.6, 0.3): 'front left',
        (0.0, 0.4): 'left',
        (-0.5, 0.35): 'rear left',
        (-0.7, 0.1): 'rear',
        (-0.5, -0.3): 'rear right',
        (0.1, -0.4): 'right',
        (0.5, -0.4): 'front right',
    }.items():
        assert place_of(x, y, FOOTPRINT) == name
    assert blocked_where(world((0.8, -0.3)), [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]) == 'front right'


@given(st.floats(0.0, 3.0), st.floats(0.0, 1.0))
def test_speeds_allowed_grow_with_room_and_leave_the_way_to_react_and_brake(free, gap):
    c = CONFIG.ahead_stop_distance, CONFIG.ahead_reaction_time, CONFIG.ahead_dec
    v = ahead_cap(free, *c)
    assert v * CONFIG.ahead_reaction_time + v * v / (2.0 * CONFIG.ahead_dec) == pytest.approx(
        max(free - CONFIG.ahead_stop_distance, 0.0), abs=1e-9
    )
    assert CONFIG.narrow_vel <= gap_speed(gap, CONFIG) <= CONFIG.max_vel_x
    assert gap_speed(gap + 0.1, CONFIG) >= gap_speed(gap, CONFIG)
    assert ahead_cap(math.inf, *c) == math.inf and gap_speed(math.inf, CONFIG) == CONFIG.max_vel_x


def test_the_short_way_round_unless_it_is_not_free_or_planned_otherwise():
    here, beside = Pose2D(0.0, 0.0, 0.0), world((0.42, 0.42))
    assert way_round(world(), here, 1.5, False) == (1.5, 1.5)
    angle, free = way_round(beside, here, 1.0, False)
    assert angle == 1.0 and free < 0.6, 'the other way round is not free either: it ends beside the thing'
    angle, free = way_round(beside, here, 2.5, False)
    assert angle == pytest.approx(2.5) and free < 0.6
    assert way_round(world((0.3, 0.52)), here, 1.0, True)[0] == 1.0
    assert free_angle(world(), here, -2.0) == 2.0
    assert planned_way(0.5, 0.4) == 0.5 and planned_way(0.5, -5.5) == pytest.approx(0.5 - 2 * math.pi)


def test_words_of_one_kind_stay_for_a_second():
    words = Words()
    assert [
        words.say(t, key, text)
        for t, key, text in (
            (0.0, 'a', '1'),
            (0.5, 'a', '2'),
            (1.1, 'a', '3'),
            (1.2, 'b', '4'),
            (1.3, 'a', '5'),
            (0.2, 'a', '6'),
        )
    ] == ['1', '1', '3', '4', '5', '6']


def test_a_reason_that_comes_and_goes_stays_for_a_second():
    words, slow, free = Words(), ('path', 'ahead'), ('path', 'free')
    said = [
        words.say(t, key, text, key == free)
        for t, key, text in (
            (0.0, free, '0.8'),
            (0.1, slow, '0.2'),
            (0.2, free, '0.8'),
            (1.0, slow, '0.3'),
            (1.2, slow, '0.4'),
            (1.9, free, '0.8'),
            (2.3, free, '0.7'),
            (2.4, ('back', 'ahead'), '0.1'),
            (2.5, free, '0.8'),
        )
    ]
    assert said == ['0.8', '0.2', '0.2', '0.2', '0.4', '0.4', '0.7', '0.1', '0.8']


@given(
    st.floats(-1.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(-0.3, 0.3),
    st.floats(-0.6, 0.6),
    st.floats(0.05, 1.0),
    st.floats(-2.0, 2.0),
    st.booleans(),
)
@settings(max_examples=100)
def test_the_way_to_rest_is_what_the_law_drives(bend, way, aside, off, speed, curvature, backward):
    """Step by step as the law, the leg and the pose say it, each by itself."""
    leg = Leg(np.array(arc(Pose2D(1.0, 2.0, 0.3), 1.5, bend))[:, :2], backward)
    x, y, yaw = (float(value) for value in leg.poses([way])[0])
    heading = yaw - math.pi if backward else yaw
    now = Pose2D(
        x - aside * math.sin(heading),
        y + aside * math.cos(heading),
        wrap(heading + off + (math.pi if backward else 0.0)),
    )
    leg.locate(now.x, now.y)
    law, pose, along = TrackingLaw(CONFIG.tracking_length, CONFIG.tracking_time), now, leg.along
    expected, left = [(now.x, now.y, now.yaw)], speed * REACTION + speed * speed / (2.0 * CONFIG.dec_lim_x) + MARGIN
    found = stopping_path(leg, law, now, speed, curvature, CONFIG)
    while left > 1e-6:
        step = min(left, 0.04)
        along, offset, _ = leg.nearest(pose.x, pose.y, along)
        off = Deviation(offset, leg.heading_error(pose.yaw, along))
        curvature = law.next_curvature(curvature, step, off, leg.bend(along), speed)
        pose = pose.advance(-step if backward else step, step * curvature, 1.0)
        expected.append((pose.x, pose.y, pose.yaw))
        left -= step
    assert found.shape == (len(expected), 3)
    assert found == pytest.approx(np.array(expected), abs=1e-9)
