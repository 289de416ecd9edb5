"""Laws of the yaw: it is the sum of k rate dt, whatever jitters, is lost or is set; and a yaw that is set is exact."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.reader.imu import YawIntegrator

PERIOD, MAX_GAP = 0.2, 1.0
RATES = st.floats(-4.0, 4.0)
TURNS = st.lists(st.tuples(st.floats(0.15, 0.25), RATES), min_size=1, max_size=30)


def run(turns, integrator=None, start=50.0):
    """Feed turns (dt, rate); returns (integrator, [(stamp, rate)])."""
    integrator = integrator or YawIntegrator(PERIOD, MAX_GAP)
    integrator.add(start, 0.0)
    frames, stamp = [], start
    for dt, rate in turns:
        stamp += dt
        frames.append((stamp, rate))
        assert integrator.add(stamp, rate) or integrator.pending
    return integrator, frames


def differs(a, b):
    return abs(math.remainder(a - b, math.tau))


@given(TURNS, st.floats(0.9, 1.2))
def test_yaw_is_the_sum_of_k_rate_dt_under_any_jitter(turns, gain):
    integrator, _ = run(turns, YawIntegrator(PERIOD, MAX_GAP, 0.5, gain))
    turned = sum(rate * dt for dt, rate in turns)
    assert differs(integrator.yaw, 0.5 + gain * turned) < 1e-9
    assert integrator.turned == pytest.approx(turned, abs=1e-9), 'turned is neither scaled nor wrapped'
    assert integrator.gaps == 0


@pytest.mark.parametrize('back', [0.21, 0.5, 0.95])
def test_a_clock_set_back_by_less_than_max_gap_loses_nothing_of_a_turn(back):
    integrator = YawIntegrator(PERIOD, MAX_GAP)
    for k in range(50):
        assert integrator.add(10.0 + PERIOD * k - (back if k >= 25 else 0.0), 0.5)
    assert differs(integrator.yaw, 0.5 * PERIOD * 49) < 1e-9


@given(st.lists(st.booleans(), min_size=2, max_size=40), RATES)
def test_a_steady_turn_survives_any_loss_shorter_than_max_gap(lost, rate):
    integrator = YawIntegrator(PERIOD, MAX_GAP)
    integrator.add(10.0, rate)
    last = 0
    for k, gone in enumerate(lost, 1):
        if not gone or k - last == 4:  # four turns: 0.8 s
            integrator.add(10.0 + PERIOD * k, rate)
            last = k
    assert integrator.turned == pytest.approx(rate * PERIOD * last, abs=1e-9)
    assert integrator.long_gaps == 0


@given(TURNS, RATES, RATES)
def test_a_lost_frame_is_the_mean_of_its_neighbours(turns, before, after):
    integrator, frames = run([*turns, (PERIOD, before)])
    turned, stamp = integrator.turned, frames[-1][0]
    integrator.add(stamp + 3 * PERIOD, after)
    assert integrator.turned - turned == pytest.approx(PERIOD * (after + 2 * (before + after) / 2), abs=1e-9)
    assert integrator.gaps == 1


def test_over_a_long_silence_nothing_is_invented():
    integrator, frames = run([(PERIOD, 1.0)] * 3)
    turned, stamp = integrator.turned, frames[-1][0]
    integrator.add(stamp + 60.0, 1.0)
    assert integrator.turned - turned == pytest.approx(PERIOD)
    assert integrator.long_gaps == 1


@given(TURNS, st.floats(-10.0, 10.0), st.floats(0.0, 1.0))
def test_a_yaw_set_for_any_moment_is_exact(turns, yaw, part):
    """yaw + what was turned since the moment, be it in the past, between two frames or now."""
    integrator, frames = run(turns)
    start, end = 50.0, frames[-1][0]
    moment = start + part * (end - start)
    since = sum(
        rate * (stamp - max(moment, before))
        for (stamp, rate), before in zip(frames, [start, *(s for s, _ in frames)])
        if stamp > moment
    )
    integrator.set(yaw, moment)
    assert differs(integrator.yaw, yaw + since) < 1e-8


@given(TURNS, st.floats(-3.0, 3.0), st.floats(0.0, 3.0))
def test_a_yaw_set_ahead_of_the_frames_is_not_pulled_back(turns, yaw, ahead):
    """Frames received before the moment change nothing; the one across it counts only from there on."""
    integrator, frames = run([(PERIOD, 1.0)])
    moment = frames[-1][0] + ahead
    integrator.set(yaw, moment)
    stamp, expected = frames[-1][0], yaw
    for dt, rate in turns:
        stamp += dt
        is_new = integrator.add(stamp, rate)
        assert is_new == (stamp > moment)
        expected += rate * max(0.0, stamp - max(moment, stamp - dt))
        assert differs(integrator.yaw, expected) < 1e-8


@given(TURNS, st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-0.5, 0.1)), min_size=1, max_size=4))
def test_only_the_last_set_counts(turns, sets):
    one, frames = run(turns)
    other, _ = run(turns)
    for yaw, ago in sets:
        one.set(yaw, frames[-1][0] + ago)
    other.set(sets[-1][0], frames[-1][0] + sets[-1][1])
    for k in range(1, 4):
        one.add(frames[-1][0] + PERIOD * k, 0.7)
        other.add(frames[-1][0] + PERIOD * k, 0.7)
    assert differs(one.yaw, other.yaw) < 1e-9


def test_equal_stamps():
    integrator, frames = run([(PERIOD, 1.0)])
    stamp = frames[-1][0]
    assert not integrator.add(stamp, 5.0), 'the same frame twice'
    integrator.set(1.0, stamp)
    assert integrator.yaw == pytest.approx(1.0)
    assert integrator.add(stamp + PERIOD, 1.0)
    assert integrator.yaw == pytest.approx(1.2)
    integrator.set(2.0, stamp + 2 * PERIOD)
    assert not integrator.add(stamp + 2 * PERIOD, 1.0), 'a frame received at the moment of the pose is before it'
    assert integrator.yaw == pytest.approx(2.0)
    integrator.add(stamp + 3 * PERIOD, 1.0)
    assert integrator.yaw == pytest.approx(2.2)


def test_before_the_first_frame():
    integrator = YawIntegrator(PERIOD, MAX_GAP, 3.0)
    assert integrator.yaw == 3.0
    integrator.set(1.0, 10.0)
    assert not integrator.add(9.9, 1.0)
    assert integrator.add(10.1, 1.0)
    assert integrator.yaw == pytest.approx(1.1)


def test_a_change_of_the_gain_leaves_what_was_turned():
    integrator, frames = run([(PERIOD, 1.0)])
    integrator.gain = 2.0
    integrator.add(frames[-1][0] + PERIOD, 1.0)
    assert integrator.yaw == pytest.approx(0.2 + 0.4)
    assert integrator.turned == pytest.approx(0.4)
