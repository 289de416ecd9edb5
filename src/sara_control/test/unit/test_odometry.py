"""Odometry: equal to the C++ peer's step by step, and the laws of a circle."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_control.wheels.odometry import SHORTEST_INTERVAL, Odometry

REFERENCE = np.load(Path(__file__).resolve().parents[1] / 'data' / 'diff_drive.npz')
CLOSED_LOOP = [k for k, case in enumerate(REFERENCE['odo_cases']) if case[4] == 0]
OPEN_LOOP = [k for k, case in enumerate(REFERENCE['odo_cases']) if case[4] == 1]
SHORT_INTERVALS, NOT_AT_ZERO = 5, 8


@pytest.mark.parametrize('k', CLOSED_LOOP)
def test_equal_to_the_peer(k):
    window, separation, left_radius, right_radius, _, start = REFERENCE['odo_cases'][k]
    odometry = Odometry(separation, left_radius, right_radius, int(window))
    odometry.start(0.0, 0.0, start)  # the peer counts from zero, wherever the encoders stand
    stamps, left, right = (REFERENCE[f'odo_{k:02d}_{name}'] for name in 'tab')
    stamps = np.round(stamps, 9)  # the peer's clock counts nanoseconds
    # The peer loses the motion of intervals under 0.1 ms for its speed: ours must not, so there only poses are
    # compared.
    columns = 3 if np.diff(stamps, prepend=start).min() < SHORTEST_INTERVAL else 5
    answer = np.empty((len(stamps), 5))
    updated = []
    for row, values in zip(answer, zip(left, right, stamps)):
        updated.append(odometry.update(*values))
        row[:] = odometry.x, odometry.y, odometry.heading, odometry.linear, odometry.angular
    np.testing.assert_allclose(answer[:, :columns], REFERENCE[f'odo_{k:02d}_out'][:, :columns], rtol=0, atol=1e-9)
    assert updated == REFERENCE[f'odo_{k:02d}_updated'].tolist()


@pytest.mark.parametrize('k', OPEN_LOOP)
def test_open_loop_equals_the_peer(k):
    window, separation, left_radius, right_radius, _, start = REFERENCE['odo_cases'][k]
    odometry = Odometry(separation, left_radius, right_radius, int(window))
    odometry.update_open_loop(0.0, 0.0, start)
    stamps, linear, angular = (REFERENCE[f'odo_{k:02d}_{name}'] for name in 'tab')
    answer = []
    for values in zip(linear, angular, np.round(stamps, 9)):
        odometry.update_open_loop(*values)
        answer.append((odometry.x, odometry.y, odometry.heading, odometry.linear, odometry.angular))
    np.testing.assert_allclose(answer, REFERENCE[f'odo_{k:02d}_out'], rtol=0, atol=1e-9)


def test_the_peers_first_pose_jumps_and_this_ones_does_not():
    case, k = REFERENCE['odo_cases'][NOT_AT_ZERO], NOT_AT_ZERO
    odometry = Odometry(*case[1:4], int(case[0]))
    left, right = REFERENCE[f'odo_{k:02d}_a'], REFERENCE[f'odo_{k:02d}_b']
    odometry.update(left[0], right[0], REFERENCE[f'odo_{k:02d}_t'][0])
    peer = REFERENCE[f'odo_{k:02d}_out'][0]
    assert math.hypot(peer[0], peer[1]) > 0.1
    assert (odometry.x, odometry.y, odometry.heading, odometry.linear, odometry.angular) == (0.0,) * 5


def test_the_peers_speed_misses_short_intervals_and_this_ones_has_them():
    """Speed times interval must add up to the way; the peer's speeds are off, ours are not."""
    case, k = REFERENCE['odo_cases'][SHORT_INTERVALS], SHORT_INTERVALS
    readings = list(
        zip(REFERENCE[f'odo_{k:02d}_a'], REFERENCE[f'odo_{k:02d}_b'], np.round(REFERENCE[f'odo_{k:02d}_t'], 9))
    )
    odometry, single = Odometry(*case[1:4], int(case[0])), Odometry(*case[1:4], window=1)
    turned, counted_from, off = 0.0, case[5], []
    for each in (odometry, single):
        each.start(0.0, 0.0, case[5])
    for reading, row in zip(readings, REFERENCE[f'odo_{k:02d}_out']):
        odometry.update(*reading)
        off.append(abs(odometry.angular - row[4]))
        if single.update(*reading):
            turned += single.angular * (reading[2] - counted_from)
            counted_from = reading[2]
            assert turned == pytest.approx(single.heading, abs=1e-9)
    assert max(off) > 1e-5


def test_encoders_that_do_not_start_at_zero_do_not_move_the_pose():
    odometry = Odometry(0.5, 0.1, 0.1)
    odometry.update(1000.0, -500.0, 3.0)
    assert (odometry.x, odometry.y, odometry.heading, odometry.linear) == (0.0, 0.0, 0.0, 0.0)
    odometry.update(1001.0, -499.0, 4.0)
    assert odometry.x == pytest.approx(0.1) and odometry.linear == pytest.approx(0.1)


def test_the_motion_of_a_very_short_interval_enters_the_speed_with_the_next():
    odometry = Odometry(0.5, 0.1, 0.1, window=1)
    odometry.start(0.0, 0.0, 0.0)
    assert not odometry.update(1.0, 1.0, 5e-5)
    assert odometry.update(2.0, 2.0, 1.0)
    assert odometry.linear == pytest.approx(0.2)


def test_in_open_loop_a_clock_that_goes_back_moves_nothing():
    odometry = Odometry(0.5, 0.1, 0.1)
    for t in (100.0, 101.0, 1.0, 2.0):
        odometry.update_open_loop(0.5, 0.0, t)
    assert odometry.x == pytest.approx(1.0)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.integers(1, 50))
def test_steady_wheels_drive_an_arc_however_finely_it_is_cut(left, right, parts):
    separation, radius = 0.525, 0.155
    odometry = Odometry(separation, radius, radius)
    odometry.start(0.0, 0.0, 0.0)
    for k in range(1, parts + 1):
        odometry.update(left * k / parts, right * k / parts, k / parts)
    distance, turn = radius * (left + right) / 2, radius * (right - left) / separation
    chord = distance * (math.sin(turn / 2) / (turn / 2) if abs(turn) > 1e-9 else 1.0)
    assert odometry.heading == pytest.approx(turn, abs=1e-12)
    assert odometry.x == pytest.approx(chord * math.cos(turn / 2), abs=1e-7)
    assert odometry.y == pytest.approx(chord * math.sin(turn / 2), abs=1e-7)
    assert odometry.linear == pytest.approx(distance) and odometry.angular == pytest.approx(turn)


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), max_size=20))
def test_driving_back_along_the_same_way_returns_to_the_start(steps):
    odometry = Odometry(0.525, 0.155, 0.15)
    odometry.start(0.0, 0.0, 0.0)
    left = right = time = 0.0
    for d_left, d_right in [*steps, *((-a, -b) for a, b in reversed(steps))]:
        left, right, time = left + d_left, right + d_right, time + 0.1
        odometry.update(left, right, time)
    assert (odometry.x, odometry.y, odometry.heading) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_a_clock_that_goes_back_begins_anew_where_the_chair_is():
    odometry = Odometry(0.5, 0.1, 0.1)
    odometry.update(0.0, 0.0, 100.0)
    odometry.update(1.0, 1.0, 101.0)
    odometry.update(50.0, 50.0, 1.0)
    assert (odometry.x, odometry.linear) == (pytest.approx(0.1), 0.0)
