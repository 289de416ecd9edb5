"""Frozen encoders: found by the way they miss, with the other wheel as witness, and never where nothing was asked."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_control.wheels.wheel_watch import WheelWatch


def run(watch, left, right, turning, seconds, angles=(0.0, 0.0)):
    """Commands at 50 Hz, positions at 10 Hz of wheels of which only those in `turning` turn. Seconds until one is
    called frozen.
    """
    angles = list(angles)
    watch.on_wheels(*angles)
    for k in range(1, round(seconds * 50) + 1):
        watch.on_command(left, right, 0.02)
        angles = [
            angle + 0.02 * speed * (name in turning)
            for angle, speed, name in zip(angles, (left, right), ('left', 'right'))
        ]
        if k % 5 == 0 and watch.on_wheels(*angles):
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
        w.on_command(0.0, 0.0, 0.1)
        assert not w.on_wheels(0.3 * k, 0.0)


def test_one_that_stands_while_the_other_is_asked_to_turn_is_left_alone():
    assert run(watch(), 2.0, 0.0, ('left',), 5.0) is None


def test_it_stays_until_it_is_reset():
    w = watch()
    run(w, 2.0, 2.0, ('left',), 2.0)
    w.on_wheels(5.0, 5.0)
    assert w.frozen == ('right',)
    w.reset()
    assert w.frozen == () and run(w, 2.0, 2.0, ('left', 'right'), 2.0) is None


def test_a_wheel_on_its_way_through_zero_is_given_time():
    w = WheelWatch(0.001, (0.155, 0.155))
    assert run(w, 2.0, 2.0, ('left', 'right'), 1.0) is None
    for _ in range(4):
        w.on_command(-2.0, 2.0, 0.02)
    assert not w.on_wheels(2.0, 2.16) and w.frozen == ()
