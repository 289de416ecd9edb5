"""Laws of angles, planar poses, quaternions and grid cells."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import Pose2D, quaternion_from_yaw, wrap, yaw_from_quaternion
from sara_nav.grids.grid import GridError, GridGeometry

coordinates = st.floats(-100.0, 100.0)
angles = st.floats(-50.0, 50.0)
poses = st.builds(Pose2D, coordinates, coordinates, angles)


def close(a, b, tolerance=1e-9):
    return a.distance(b) < tolerance and abs(wrap(a.yaw - b.yaw)) < tolerance


@given(angles)
def test_wrap_keeps_the_direction(angle):
    assert -math.pi <= wrap(angle) < math.pi
    assert math.cos(wrap(angle)) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrap(angle)) == pytest.approx(math.sin(angle), abs=1e-9)


@given(poses)
def test_inverse_undoes(pose):
    assert close(pose.compose(pose.inverse()), Pose2D(0.0, 0.0, 0.0))
    assert close(pose.inverse().compose(pose), Pose2D(0.0, 0.0, 0.0))


@given(poses, poses, poses)
def test_compose_is_associative(a, b, c):
    assert close(a.compose(b).compose(c), a.compose(b.compose(c)), 1e-8)


@given(poses, st.floats(-1.0, 1.0), st.floats(-2.0, 2.0))
def test_an_arc_in_two_halves_is_the_arc(pose, v, w):
    assert close(pose.advance(v, w, 1.0), pose.advance(v, w, 0.5).advance(v, w, 0.5), 1e-7)


@given(angles)
def test_yaw_survives_the_quaternion(angle):
    assert wrap(yaw_from_quaternion(*quaternion_from_yaw(angle)) - angle) == pytest.approx(0.0, abs=1e-9)


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


@given(st.integers(0, 39), st.integers(0, 29))
def test_a_cells_centre_is_in_the_cell(column, row):
    grid = GridGeometry(40, 30, 0.05, -1.3, 2.7)
    assert grid.to_cell(*grid.to_world(column, row)) == (column, row)


def test_off_the_grid_is_none():
    grid = GridGeometry(40, 30, 0.05, 0.0, 0.0)
    for x, y in ((-1e-6, 1.0), (1.0, -1e-6), (2.0, 1.0), (1.0, 1.5), (math.nan, 1.0), (1.0, math.inf)):
        assert grid.to_cell(x, y) is None


@pytest.mark.parametrize(
    'fault', [(0, 3, 0.1, 0, 0), (3, 0, 0.1, 0, 0), (3, 3, 0.0, 0, 0), (3, 3, math.nan, 0, 0), (3, 3, 0.1, math.inf, 0)]
)
def test_senseless_grids_are_refused(fault):
    with pytest.raises(GridError):
        GridGeometry(*fault)
