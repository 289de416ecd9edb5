"""Laws of angles, planar poses and quaternions of a yaw."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sara_common import kernels
from sara_common.planar import (
    TWO_PI,
    Pose2D,
    advanced,
    between,
    compose,
    inverse,
    is_apart,
    quaternion_from_yaw,
    wrap,
    wrap_exact,
    yaw_from_quaternion,
    yaw_of,
)

coordinates = st.floats(-100.0, 100.0)
angles = st.floats(-50.0, 50.0)
poses = st.builds(Pose2D, coordinates, coordinates, angles)


def close(a, b, tolerance=1e-9):
    return a.distance(b) < tolerance and abs(wrap(a.yaw - b.yaw)) < tolerance


@given(angles)
@example(math.pi)
@example(-math.pi)
def test_wrap_keeps_the_direction(angle):
    assert -math.pi <= wrap(angle) < math.pi
    assert math.cos(wrap(angle)) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrap(angle)) == pytest.approx(math.sin(angle), abs=1e-9)


@given(st.lists(angles, max_size=8))
def test_an_array_is_wrapped_as_its_numbers(values):
    assert wrap(np.array(values)).tolist() == [wrap(value) for value in values]


@given(st.floats(-math.pi, math.pi))
def test_wrap_exact_keeps_every_bit_of_what_is_within(angle):
    assert wrap_exact(angle) == angle


@given(st.floats(-1e9, 1e9) | st.integers(-1000, 1000).map(lambda turns: turns * math.pi))
def test_wrap_exact_is_the_remainder_that_ieee_754_defines(angle):
    wrapped, remainder = wrap_exact(angle), math.remainder(angle, TWO_PI)
    assert wrapped == remainder or {wrapped, remainder} == {-math.pi, math.pi}  # the two names of half a turn
    assert -math.pi <= wrapped <= math.pi


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
def test_wrap_exact_gives_back_what_is_not_finite(value):
    assert str(wrap_exact(value)) == str(value)


@given(angles)
def test_the_compiled_wraps_are_the_plain_ones_to_the_bit(angle):
    assert kernels.wrap(angle) == wrap(angle) and kernels.wrap_exact(angle) == wrap_exact(angle)


@given(poses)
def test_inverse_undoes(pose):
    assert close(pose.compose(pose.inverse()), Pose2D(0.0, 0.0, 0.0))
    assert close(pose.inverse().compose(pose), Pose2D(0.0, 0.0, 0.0))


@given(poses, poses, poses)
def test_compose_is_associative(a, b, c):
    assert close(a.compose(b).compose(c), a.compose(b.compose(c)), 1e-8)


@given(poses, poses)
def test_a_tuple_is_composed_as_a_pose(a, b):
    assert compose(tuple(a), tuple(b)) == a.compose(b) and inverse(tuple(a)) == a.inverse()


def test_compose_turns_before_it_moves():
    assert compose((1.0, 2.0, 0.5 * math.pi), (3.0, 0.0, 0.0)) == pytest.approx((1.0, 5.0, 0.5 * math.pi))


@given(poses, st.floats(-1.0, 1.0), st.floats(-2.0, 2.0))
def test_an_arc_in_two_halves_is_the_arc(pose, v, w):
    assert close(pose.advance(v, w, 1.0), pose.advance(v, w, 0.5).advance(v, w, 0.5), 1e-7)


@given(st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(0.01, 3.0))
def test_an_arc_lies_on_its_circle(v, w, dt):
    x, y, yaw = advanced(0.0, 0.0, 0.0, v, w, dt)
    assert math.hypot(x, y - v / w) == pytest.approx(v / w) and yaw == pytest.approx(wrap(w * dt))


@given(angles)
def test_yaw_survives_the_quaternion(angle):
    quaternion = quaternion_from_yaw(angle)
    assert wrap(yaw_from_quaternion(*quaternion) - angle) == pytest.approx(0.0, abs=1e-9)
    assert yaw_of(SimpleNamespace(**dict(zip('xyzw', quaternion)))) == pytest.approx(yaw_from_quaternion(*quaternion))


@pytest.mark.parametrize(
    'quaternion, reason',
    [
        ((0.0, 0.0, 0.0, 0.0), 'unit'),
        ((0.0, 0.0, 0.0, 3.0), 'unit'),
        ((math.nan, 0.0, 0.0, 1.0), 'NaN'),
        ((0.0, 0.0, math.inf, 1.0), 'NaN'),
        ((0.7071, 0.0, 0.0, 0.7071), 'vertical'),
    ],
)
def test_bad_quaternions_are_refused(quaternion, reason):
    with pytest.raises(ValueError, match=reason):
        yaw_from_quaternion(*quaternion)


@given(st.floats(-3.0, 3.0), st.floats(0.05, 0.5))
def test_on_a_slope_the_yaw_is_that_of_the_way_up(yaw, pitch):
    (s, c), (sp, cp) = ((math.sin(0.5 * angle), math.cos(0.5 * angle)) for angle in (yaw, pitch))
    quaternion = -s * sp, c * sp, s * cp, c * cp
    with pytest.raises(ValueError, match='vertical'):
        yaw_from_quaternion(*quaternion)
    assert yaw_from_quaternion(*quaternion, tilt=pitch + 1e-6) == pytest.approx(yaw)
    with pytest.raises(ValueError, match='vertical'):
        yaw_from_quaternion(*quaternion, tilt=pitch - 1e-3)


def test_between_two_poses_it_turns_the_short_way_round():
    a, b = (0.0, 0.0, 3.0), (2.0, 4.0, -3.0)
    assert between(a, b, 0.0) == a and between(a, b, 0.5) == pytest.approx((1.0, 2.0, math.pi))
    x, y, yaw = between(a, b, np.array([0.0, 0.25, 1.0]))
    assert x.tolist() == [0.0, 0.5, 2.0] and y.tolist() == [0.0, 1.0, 4.0]
    assert yaw == pytest.approx([3.0, 3.0 + 0.25 * (math.tau - 6.0), math.tau - 3.0])


def test_poses_are_apart_by_their_way_or_their_turn_the_short_way_round():
    assert is_apart((0.0, 0.0, 0.0), (0.3, 0.4, 0.0), 0.5, 1.0)
    assert not is_apart((0.0, 0.0, 3.1), (0.3, 0.4, -3.1), 0.51, 0.1)
    assert is_apart((0.0, 0.0, 3.1), (0.0, 0.0, -3.1), 1.0, 0.08)
