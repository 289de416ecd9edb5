"""Laws of angles, quaternions and transforms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import wrap_exact
from sara_localization.filters import motion_model, state_pose
from sara_localization.geometry.rigid import (
    IDENTITY,
    Transform,
    normalised,
    quaternion_from_rpy,
    rotation_matrix,
    rpy_from_quaternion,
)

angles = st.floats(-math.pi, math.pi)
pitches = st.floats(-1.5, 1.5)
lengths = st.floats(-100.0, 100.0)
transforms = st.builds(Transform.from_xyz_rpy, lengths, lengths, lengths, angles, pitches, angles)


def same(a, b, tolerance=1e-9):
    np.testing.assert_allclose(a.translation, b.translation, atol=tolerance)
    np.testing.assert_allclose(rotation_matrix(a.rotation), rotation_matrix(b.rotation), atol=tolerance)


@given(angles, pitches, angles)
def test_rpy_round_trip(roll, pitch, yaw):
    back = rpy_from_quaternion(quaternion_from_rpy(roll, pitch, yaw))
    for angle, asked in zip(back, (roll, pitch, yaw)):
        assert abs(wrap_exact(angle - asked)) < 1e-6


@given(transforms)
def test_yaw_alone_is_that_of_all_three(t):
    assert t.yaw == t.rpy[2]


def test_with_the_nose_up_all_of_the_turn_is_in_roll():
    up = Transform((0.0, 0.0, 0.0), normalised((0.0, 1.0, 0.0, 1.0)))
    assert up.yaw == up.rpy[2] == 0.0


@given(transforms, st.tuples(lengths, lengths, lengths))
def test_inverse_takes_back(t, point):
    np.testing.assert_allclose(t.inverse().apply(t.apply(point)), point, atol=1e-9)
    same(t @ t.inverse(), IDENTITY)


@given(transforms, transforms, st.tuples(lengths, lengths, lengths))
def test_composition_is_one_after_the_other(a, b, point):
    np.testing.assert_allclose((a @ b).apply(point), a.apply(b.apply(point)), atol=1e-9)


@given(st.lists(st.floats(-1.0, 1.0), min_size=15, max_size=15), transforms, st.floats(0.0, 0.5))
def test_a_state_is_joined_as_it_was(state, other, age):
    x = np.array(state)
    before, _ = motion_model.predict(x, -age)
    same(state_pose.pose_of(state_pose.earlier(x, age)) @ other, state_pose.pose_of(before) @ other)
    np.testing.assert_array_equal(x, state)
    same(
        state_pose.pose_of(state_pose.earlier(x, 60.0)) @ other,
        state_pose.pose_of(state_pose.earlier(x, state_pose.LONGEST)) @ other,
    )


@given(transforms, st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6), transforms, st.floats(0.0, 0.5))
def test_a_pose_that_moves_is_joined_as_the_state_that_says_the_same(pose, twist, other, age):
    x = np.array((*pose.translation, *pose.rpy, *twist, 0.0, 0.0, 0.0))
    same(
        state_pose.pose_earlier(pose, twist, age) @ other, state_pose.pose_of(state_pose.earlier(x, age)) @ other, 1e-6
    )
    for nothing in (math.nan, math.inf):
        same(state_pose.pose_earlier(pose, (*twist[:5], nothing), age) @ other, pose @ other, 1e-6)


@given(transforms, transforms)
def test_interpolation_ends_at_its_ends(a, b):
    same(a.interpolate(b, 0.0), a, 1e-6)
    same(a.interpolate(b, 1.0), b, 1e-6)


@pytest.mark.parametrize('q', [(0, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 1)])
def test_no_rotation_is_refused(q):
    with pytest.raises(ValueError):
        normalised(q)
