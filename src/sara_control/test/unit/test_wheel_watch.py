"""Frozen encoders: found by the way they miss, with the other wheel as witness, and never where nothing was asked."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sara_control.wheels.wheel_watch import WheelWatch


def run(watch, left, right, turning, seconds, start=10.0, angles=(0.0, 0.0)):
    """Commands at 50 Hz, positions at 10 Hz of wheels of which only those in `turning` turn. Seconds until one is
    called frozen.
    """
    angles = list(angles)
    watch.on_wheels(*angles, start)
    for k in range(1, round(seconds * 50) + 1):
        watch.on_command(left, right, start + (k - 1) / 50)
        angles = [
            angle + 0.02 * speed * (name in turning)
            for angle, speed, name in zip(angles, (left, right), ('left', 'right'))
        ]
        if k % 5 == 0 and watch.on_wheels(*angles, start + k / 50):
            return k / 50
    return None


def watch():
    return WheelWatch(0.015, (0.155, 0.155))


@given(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0))
def test_wheels_that_turn_are_never_frozen(left, right):
    w = watch()
    assert run(w, left, right, ('left', 'right'), 5.0) is None and w.frozen == ()


@given(st.floats(0.2, 6.0), st.sampled_from([-1.0, 1.0]), st.sampled_from(['left', 'right']))
def test_the_one_that_stands_still_is_named(speed, sign, still):
    w = watch()
    other = 'right' if still == 'left' else 'left'
    assert run(w, sign * speed, sign * speed, (other,), 5.0) is not None
    assert w.frozen == (still,)
    missed = w.missed[('left', 'right').index(still)]
    assert 0.015 <= missed <= 0.015 + 0.1 * speed * 0.155 + 1e-9, (
        'it was noticed at the first reading after the way was missed'
    )


def test_alone_it_takes_twice_the_way():
    one, both = watch(), watch()
    assert run(both, 0.6, 0.6, (), 5.0) > run(one, 0.6, 0.6, ('left',), 5.0)
    assert both.frozen == ('left', 'right')


@pytest.mark.parametrize('left, right', [(0.0, 0.0), (0.05, 0.05), (0.0, -0.05)])
def test_what_is_not_asked_to_turn_may_stand(left, right):
    assert run(watch(), left, right, (), 20.0) is None


def test_a_wheel_pushed_by_hand_accuses_nobody():
    w = watch()
    for k in range(50):
        w.on_command(0.0, 0.0, 0.1 * k)
        assert not w.on_wheels(0.3 * k, 0.0, 0.1 * k)


def test_one_that_stands_while_the_other_is_asked_to_turn_is_left_alone():
    assert run(watch(), 2.0, 0.0, ('left',), 5.0) is None


def test_it_stays_until_it_is_reset():
    w = watch()
    run(w, 2.0, 2.0, ('left',), 2.0)
    w.on_wheels(5.0, 5.0, 12.1)
    assert w.frozen == ('right',)
    w.reset()
    assert w.frozen == () and run(w, 2.0, 2.0, ('left', 'right'), 2.0) is None


def test_a_wheel_on_its_way_through_zero_is_given_time():
    w = WheelWatch(0.001, (0.155, 0.155))
    assert run(w, 2.0, 2.0, ('left', 'right'), 1.0) is None
    for k in range(4):
        w.on_command(-2.0, 2.0, 11.0 + 0.02 * k)
    assert not w.on_wheels(2.0, 2.16, 11.08) and w.frozen == ()


@given(
    st.floats(-1.5, 1.5),
    st.floats(-1.5, 1.5),
    st.lists(st.floats(0.0, 0.1), min_size=2, max_size=5),
    st.booleans(),
)
@example(0.8, 0.8, [0.039, 0.001], True)
def test_cycles_of_any_length_freeze_no_wheel_that_obeys(left, right, cycles, commanded_first):
    """Rims at m/s: a short cycle after a long one has little way in it, and not that of the long one to show."""
    w, angles, t = watch(), [0.0, 0.0], 10.0
    speeds = left / 0.155, right / 0.155
    for dt in cycles * 20:
        if commanded_first:
            w.on_command(*speeds, t)
            assert not w.on_wheels(*angles, t)
        else:
            assert not w.on_wheels(*angles, t)
            w.on_command(*speeds, t)
        angles, t = [angle + speed * dt for angle, speed in zip(angles, speeds)], t + dt


def test_a_command_that_nothing_follows_counts_for_a_while_only():
    w = watch()
    w.on_wheels(0.0, 0.0, 10.0)
    w.on_command(2.0, 2.0, 10.0)
    assert not w.on_wheels(0.0, 0.0, 15.0), '0.1 s of 0.31 m/s is not yet the 0.03 m'
    w.on_command(2.0, 2.0, 15.0)
    assert w.on_wheels(0.0, 0.0, 15.1)


def test_a_clock_set_back_does_not_blind_it():
    w = watch()
    run(w, 2.0, 2.0, ('left', 'right'), 1.0, start=1000.0)
    assert run(w, 2.0, 2.0, (), 1.0, start=10.0) is not None
