"""The judge on motions whose figures are known by pen and paper: circle, S-curve, a hunting end, turns the short and
the long way; mirrored drives judge alike.
"""

import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_lab.judge import motion
from sara_lab.judge.judge import WEIGHTS, judge
from sara_lab.judge.judgement import Goal, Track, table
from sara_lab.judge.motion import Motion, reversals

DT = 0.01


def circle(v, w, seconds=20.0):
    t = np.arange(0.0, seconds + DT / 2, DT)
    yaw = w * t
    return t, np.column_stack([v / w * np.sin(yaw), v / w * (1.0 - np.cos(yaw)), yaw])


def driven(v, w, dt=DT):
    """Poses of speeds (n,) held for dt each, on exact arcs."""
    yaw = np.concatenate([[0.0], np.cumsum(w * dt)])
    middle, chord = 0.5 * (yaw[1:] + yaw[:-1]), v * dt * np.sinc(w * dt / (2.0 * math.pi))
    x, y = (np.concatenate([[0.0], np.cumsum(chord * f(middle))]) for f in (np.cos, np.sin))
    return dt * np.arange(len(yaw)), np.column_stack([x, y, yaw])


def goal(t, path, **other):
    return Goal(**{'pose': tuple(path[-1]), 'given': t[0], 'ended': t[-1], 'reached': True, **other})


@given(st.floats(0.1, 1.0), st.floats(0.1, 0.6), st.sampled_from((-1.0, 1.0)))
@settings(max_examples=25)
def test_on_a_circle_the_acceleration_is_v_w_and_the_jerk_v_w_w(v, w, side):
    t, pose = circle(v, side * w)
    found = judge(Track(t, pose))
    assert (
        found.acceleration_normal_rms == pytest.approx(v * w, rel=0.01)
        and found.acceleration_tangential_rms < 0.01 * v * w
    )
    assert (
        found.jerk_tangential_rms == pytest.approx(v * w * w, rel=0.02)
        and found.jerk_normal_rms < 0.02 * v * w * w + 1e-9
    )
    assert found.length == pytest.approx(20.0 * v, rel=1e-4) and found.reversals == 0
    assert found.discomfort == pytest.approx(20.0 + 20.0 * WEIGHTS[1] * (v * w * w) ** 2, rel=0.05)


def test_the_least_jerky_way_from_rest_to_rest_has_the_jerk_of_the_book():
    """x = L (10 u^3 - 15 u^4 + 6 u^5): int jerk^2 dt = 720 L^2 / T^5 (Flash and Hogan 1985)."""
    length, seconds = 4.0, 16.0
    t = np.arange(0.0, seconds + DT / 2, DT)
    u = t / seconds
    pose = np.column_stack([length * (10 * u**3 - 15 * u**4 + 6 * u**5), np.zeros_like(u), np.zeros_like(u)])
    found = judge(Track(t, pose), weights=(0.0, 1.0, 1.0))
    assert found.discomfort == pytest.approx(720.0 * length**2 / seconds**5, rel=0.03)
    assert found.length == pytest.approx(length) and math.isnan(found.cross_track_p95)


def test_time_and_jerk_weigh_alike_on_the_leg_that_the_weights_come_from():
    """4 m from rest to rest at 0.5 m/s, 0.4 m/s2, 0.8 m/s3: pulses of jerk of 0.5 s, which the derivatives' window
    blurs; so it is summed up here.
    """
    jerk = 0.8 * np.concatenate(
        [np.repeat((1.0, 0.0, -1.0), (500, 750, 500)), np.zeros(6250), np.repeat((-1.0, 0.0, 1.0), (500, 750, 500))]
    )
    speed = np.cumsum(np.cumsum(jerk) * 1e-3) * 1e-3
    assert (
        speed.max() == pytest.approx(0.5, rel=0.01)
        and speed.sum() * 1e-3 == pytest.approx(4.0, rel=0.01)
        and abs(speed[-1]) < 0.01
    )
    assert (
        WEIGHTS[0] * len(jerk) * 1e-3 == pytest.approx(WEIGHTS[1] * (jerk**2).sum() * 1e-3) and WEIGHTS[1] == WEIGHTS[2]
    )


@given(st.integers(0, 10**6))
@settings(max_examples=20)
def test_mirrored_drives_judge_alike(seed):
    random = np.random.default_rng(seed)
    v, w = (np.convolve(random.normal(0.0, 1.0, 700), np.ones(100) / 100.0, 'valid') * scale for scale in (2.0, 3.0))
    t, pose = driven(v, w)
    legs = {'straight': (0.0, 0.0), 'shortest': 1.5}
    end = pose[-1] + (1.0, 2.0, 0.3)
    here = judge(Track(t, pose, goals=(goal(t, pose, pose=tuple(end), **legs),), contacts=0))
    mirrored = judge(
        Track(
            t, pose * (1.0, -1.0, -1.0), goals=(goal(t, pose, pose=tuple(end * (1.0, -1.0, -1.0)), **legs),), contacts=0
        )
    )
    turned = math.radians(100.0)
    c, s = math.cos(turned), math.sin(turned)
    elsewhere = judge(
        Track(
            t,
            pose @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + (3.0, -2.0, turned),
            goals=(
                goal(
                    t,
                    pose,
                    pose=(c * end[0] - s * end[1] + 3.0, s * end[0] + c * end[1] - 2.0, end[2] + turned),
                    straight=(3.0, -2.0),
                    shortest=1.5,
                ),
            ),
            contacts=0,
        )
    )
    for other in (mirrored, elsewhere):
        for name, value in vars(here).items():
            if name == 'corners':
                assert abs(other.corners[0].yaw) == pytest.approx(abs(here.corners[0].yaw)) and other.corners[
                    0
                ].position == pytest.approx(here.corners[0].position)
            elif name == 'turns':
                assert np.allclose(
                    [dataclasses.astuple(turn) for turn in other.turns],
                    [dataclasses.astuple(turn) for turn in value],
                    atol=1e-6,
                )
            else:
                assert getattr(other, name) == (
                    value if isinstance(value, str) else pytest.approx(value, nan_ok=True, abs=1e-9, rel=1e-6)
                ), name


def test_a_hunting_end_shows():
    """3 m straight, then four swings of the heading by 12 deg at 0.1 m/s within the last half metre."""
    swing = np.repeat([0.3, -0.3, 0.3, -0.3, 0.3, -0.3, 0.3, -0.3], 100) * np.tile(
        np.sin(np.linspace(0.0, math.pi, 100)), 8
    )
    v, w = np.concatenate([np.full(1000, 0.3), np.full(800, 0.06)]), np.concatenate([np.zeros(1000), swing])
    t, pose = driven(v, w)
    hunting = judge(Track(t, pose, goals=(goal(t, pose, straight=(0.0, 0.0)),)))
    t, pose = driven(np.full(1160, 0.3), np.zeros(1160))
    calm = judge(Track(t, pose, goals=(goal(t, pose, straight=(0.0, 0.0)),)))
    assert hunting.reversals == 7 and calm.reversals == 0
    assert hunting.reversals_per_m == pytest.approx(7 / 3.48, rel=0.02)
    assert hunting.last_metre[0] == pytest.approx(8.0 + 0.52 / 0.3, abs=0.1) and calm.last_metre[0] == pytest.approx(
        1.0 / 0.3, abs=0.05
    )
    assert hunting.discomfort > calm.discomfort and hunting.cross_track_max < 0.05


def test_turns_in_place_the_short_and_the_long_way():
    still, quarter, more = np.zeros(100), np.full(500, math.pi / 10.0), np.full(550, math.pi / 10.0)  # 90 and 99 deg
    back, long_way = np.full(50, -math.pi / 10.0), np.full(1500, -math.pi / 10.0)  # -9 and -270 deg

    def turns(*rates):
        w = np.concatenate([still, *rates, still])
        t, pose = driven(np.zeros(len(w)), w)
        return judge(Track(t, pose, goals=(goal(t, pose),))).turns

    (turn,) = turns(quarter)
    assert turn.turned == pytest.approx(90.0, abs=0.1) and turn.beyond == pytest.approx(0.0, abs=0.1)
    (turn,) = turns(more, still, back)
    assert turn.beyond == pytest.approx(18.0, abs=0.1)
    (turn,) = turns(long_way)
    assert turn.shortest == pytest.approx(90.0, abs=0.1) and turn.beyond == pytest.approx(180.0, abs=0.1)
    assert turns(np.full(20, math.pi / 10.0)) == ()


def test_a_turn_belongs_to_its_goal_and_driving_parts_turns():
    turn, drive = np.full(500, math.pi / 10.0), np.full(300, 0.3)
    v, w = (
        np.concatenate([np.zeros(500), drive, np.zeros(500), np.zeros(500)]),
        np.concatenate([turn, np.zeros(300), turn, -turn]),
    )
    t, pose = driven(v, w)
    goals = (Goal(tuple(pose[1300]), 0.0, t[1300], True), Goal(tuple(pose[-1]), t[1300], t[-1], True))
    found = judge(Track(t, pose, goals=goals)).turns
    assert len(found) == 3 and max(turn.beyond for turn in found) < 0.2
    assert judge(Track(t, pose, goals=(goal(t, pose),))).beyond_shortest == pytest.approx(
        180.0, abs=2.0
    )  # without the goal between, it turned to and fro


def test_cross_track_is_the_distance_from_the_leg_while_driving():
    v = np.concatenate([np.zeros(100), np.full(1000, 0.4), np.zeros(400)])
    t, pose = driven(v, np.zeros(len(v)))
    pose[:, 1] += 0.03
    found = judge(
        Track(t, pose, goals=(goal(t, pose, pose=(4.0, 0.0, 0.0), straight=(0.0, 0.0), shortest=4.0, judged=t[-1]),))
    )
    assert (
        found.cross_track_p95 == pytest.approx(0.03)
        and found.cross_track_max == pytest.approx(0.03)
        and found.detour == pytest.approx(1.0, abs=1e-3)
    )
    assert found.corners[0].position == pytest.approx(0.03) and found.corners[0].yaw == 0.0
    plan = np.column_stack([np.linspace(0.0, 4.0, 80), np.full(80, 0.01), np.zeros(80)])
    assert judge(Track(t, pose, plans=((0.0, plan),))).off_plan_p95 == pytest.approx(0.02)


def test_where_a_straight_leg_has_no_length_cross_track_is_the_distance_from_its_goal():
    v = np.concatenate([np.zeros(100), np.full(500, 0.4), np.zeros(400)])
    t, pose = driven(v, np.zeros(len(v)))
    there = goal(t, pose, pose=(0.0, 0.0, 0.0), straight=(0.0, 0.0), shortest=4.0, judged=t[-1])
    assert judge(Track(t, pose, goals=(there,))).cross_track_max == pytest.approx(2.0, abs=0.02)


def test_reversals_count_sides_and_not_wiggles_below_the_threshold():
    assert reversals(np.array([0.1, 0.04, -0.04, 0.1, -0.1, 0.0, -0.1, 0.06]), 0.05) == 2
    assert reversals(np.array([]), 0.05) == 0


def test_commands_are_judged_for_themselves():
    t, pose = driven(np.full(1000, 0.2), np.zeros(1000))
    commands = np.column_stack([np.full(1001, 0.2), 0.1 * np.sign(np.sin(2.0 * math.pi * t / 2.0 + 0.1))])
    commands[::3] = math.nan
    found = judge(Track(t, pose, commanded=commands))
    assert found.reversals == 0 and found.commanded_reversals_per_m == pytest.approx(9.5 / 2.0, abs=0.3)
    assert math.isnan(judge(Track(t, pose)).commanded_reversals_per_m)


def test_uneven_times_are_made_even():
    t, pose = circle(0.4, 0.3)
    keep = np.sort(np.random.default_rng(1).choice(np.arange(1, len(t) - 1), len(t) // 2, replace=False))
    even = Motion.of(t[keep], pose[keep])
    assert (
        np.allclose(np.diff(even.t), even.dt)
        and np.median(even.v) == pytest.approx(0.4, rel=0.01)
        and np.median(even.w) == pytest.approx(0.3, rel=0.01)
    )


@pytest.mark.parametrize('order', (1, 2, 3))
def test_derivatives_are_those_of_savitzky_and_golay(order):
    from scipy.signal import savgol_filter

    values = np.random.default_rng(3).normal(size=200)
    size = 2 * round(0.25 / DT) + 1
    assert np.allclose(
        motion._derivative(values, DT, order, 0.5),
        savgol_filter(values, size, 3, deriv=order, delta=DT),
        rtol=1e-6,
        atol=1e-6 / DT**order,
    )


def test_a_track_that_cannot_be_is_refused():
    t, pose = circle(0.4, 0.3, 1.0)
    for bad in (
        {'t': t[:-1]},
        {'t': t[::-1]},
        {'pose': pose * math.nan},
        {'source': 'guessed'},
        {'t': t[:1], 'pose': pose[:1]},
        {'commanded': pose},
    ):
        with pytest.raises(ValueError):
            Track(**{'t': t, 'pose': pose, **bad})


def test_a_judgement_is_printed_and_stored():
    t, pose = circle(0.4, 0.3)
    found = judge(Track(t, pose, goals=(goal(t, pose, text='Goal reached.'),), contacts=0))
    text = found.table()
    assert (
        'discomfort' in text
        and '1/1' in text
        and text.count('\n') + 1 == len(table([('a', found), ('b', found)]).split('\n')) - 1
    )
    data = json.loads(json.dumps(found.to_json()))
    assert data['gap_min'] is None and data['corners'][0]['text'] == 'Goal reached.' and data['contacts'] == 0


def test_few_poses_are_judged_too():
    found = judge(Track(np.array([0.0, 0.1]), np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])))
    assert found.length == pytest.approx(0.01) and found.turns == ()


def test_what_is_printed_does_not_depend_on_where_the_numbers_lie_in_memory():
    t, pose = circle(0.4, 0.3)

    def placed(array, offset):
        """A copy of the array that begins `offset` numbers behind where numpy puts one."""
        room = np.empty(array.size + offset)
        found = room[offset:].reshape(array.shape)
        found[:] = array
        return found

    printed = {json.dumps(judge(Track(placed(t, k), placed(pose, k))).to_json()) for k in range(8)}
    assert len(printed) == 1
    exact = judge(Track(t, pose))
    numbers = [value for value in exact.to_json().values() if isinstance(value, float)]
    assert numbers and all(value == round(value, 9) for value in numbers)
