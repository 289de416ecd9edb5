"""Reckoning: the way of a chair that turns, from wheels at 10 Hz and a turn rate at 20 Hz."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import advanced
from sara_control.zones.reckoning import Reckoning


def drive(reckoning, moves, begin=5.0, wheels=True, turns=True):
    """[(v, w)] for 0.1 s each; returns (t, pose) as it was."""
    pose, way, t = (0.0, 0.0, 0.0), 0.0, begin
    for v, w in moves:
        for half in (1, 2):
            pose, way = advanced(*pose, v, w, 0.05), way + 0.05 * v
            t = round(t + 0.05, 6)
            if turns:
                reckoning.on_turn(t, w)
            if wheels and half == 2:
                reckoning.on_way(t, way)
    return t, pose


@given(st.lists(st.tuples(st.floats(-0.3, 0.8), st.floats(-0.8, 0.8)), min_size=3, max_size=6))
def test_a_second_s_way_is_known_to_some_centimetres(moves):
    reckoning = Reckoning()
    t, _ = drive(reckoning, [(0.0, 0.0)] * 3)
    begin = reckoning.at(t, t)
    t, pose = drive(reckoning, moves, t)
    found = reckoning.at(t, t)
    assert math.hypot(found[0] - begin[0] - pose[0], found[1] - begin[1] - pose[1]) < 0.06
    assert math.remainder(found[2] - begin[2] - pose[2], math.tau) == pytest.approx(0.0, abs=0.12)


def test_between_two_readings_the_pose_is_between():
    reckoning = Reckoning()
    t, _ = drive(reckoning, [(0.5, 0.0)] * 8)
    a, b, c = (reckoning.at(t - back, t + 0.03)[0] for back in (0.2, 0.15, 0.1))
    assert (a + c) / 2 == pytest.approx(b, abs=1e-3) and c - a == pytest.approx(0.05, abs=2e-3)
    assert reckoning.at(t + 0.03, t + 0.03)[0] - reckoning.at(t, t + 0.03)[0] == pytest.approx(0.015, abs=2e-3)


@pytest.mark.parametrize('silent', ['wheels', 'turns'])
def test_what_is_silent_for_long_breaks_the_way(silent):
    reckoning = Reckoning()
    t, _ = drive(reckoning, [(0.2, 0.1)] * 5)
    assert reckoning.at(t, t) is not None
    t, _ = drive(reckoning, [(0.2, 0.1)] * 6, t, **{silent: False})
    assert reckoning.at(t, t) is None and reckoning.breaks > 0
    t, _ = drive(reckoning, [(0.2, 0.1)] * 5, t)
    assert reckoning.at(t, t) is not None


def test_the_future_and_the_distant_past_are_not_known():
    reckoning = Reckoning()
    assert reckoning.at(5.0, 5.0) is None
    t, _ = drive(reckoning, [(0.2, 0.1)] * 30)
    assert reckoning.at(t + 0.1, t) is None and reckoning.at(t - 2.0, t) is None


def test_a_clock_that_is_set_back_breaks_the_way():
    reckoning = Reckoning()
    drive(reckoning, [(0.2, 0.0)] * 5, 100.0)
    drive(reckoning, [(0.2, 0.0)] * 2, 5.0)
    assert reckoning.breaks == 1
