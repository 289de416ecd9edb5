"""How sensors' data become measurements: frames, masks, gravity, bad data."""

import math

import numpy as np
import pytest

from sara_localization.filters.state import AX, OFF_PLANE, PITCH, ROLL, VX, VY, YAW, X, Y, Z
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy, rotation_matrix
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs import measurement, poses
from sara_localization.inputs.data import ImuData, PoseData, TwistData
from sara_localization.inputs.measurement import Frames, Gravity, MissingTransform, Part

ALL6 = (True,) * 6
ALL, FIRST, ALL3 = Part('s', ALL6), Part('s', (True,) + (False,) * 5), Part('s', (True,) * 3)
COVARIANCE = np.diag([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])


@pytest.fixture
def frames():
    buffer = TransformBuffer()
    buffer.set_transform('map', 'odom', Transform.from_xyz_rpy(1.0, 2.0, 0.0, yaw=math.pi / 2))
    buffer.set_transform('base_link', 'side', Transform.from_xyz_rpy(0.0, -0.25, 0.4, yaw=math.pi / 2))
    buffer.set_transform('base_link', 'front', Transform.from_xyz_rpy(1.0, 0.0, 0.0))
    return Frames(buffer, 'map', 'base_link')


def value_of(prepared, index):
    return prepared.z[prepared.indices.index(index)]


def test_a_pose_is_brought_into_the_world(frames):
    data = PoseData(1.0, 'odom', (3.0, 0.0, 0.0), quaternion_from_rpy(0.0, 0.0, 0.5), COVARIANCE)
    prepared, problems = poses.pose(data, Part('odom0_pose', ALL6), frames)
    assert problems == []
    np.testing.assert_allclose(prepared.z, [1.0, 5.0, 0.0, 0.0, 0.0, math.pi / 2 + 0.5], atol=1e-12)
    np.testing.assert_allclose(np.diag(prepared.R), [0.2, 0.1, 0.3, 0.5, 0.4, 0.6], atol=1e-12)


def test_the_mask_turns_with_the_frame(frames):
    prepared, _ = poses.pose(PoseData(1.0, 'odom', covariance=COVARIANCE), FIRST, frames)
    assert prepared.indices == (Y,)


def test_a_sideways_sensor_and_its_lever(frames):
    side, _ = measurement.twist(
        TwistData(1.0, 'side', (1.0, 0.0, 0.0), (0, 0, 0), COVARIANCE),
        FIRST,
        frames,
        (0.0, 0.0, 0.0),
    )
    assert side.indices == (VY,)
    front, _ = measurement.twist(
        TwistData(1.0, 'front', (1.0, 0.5, 0.0), (0, 0, 0.5), COVARIANCE),
        ALL,
        frames,
        (0.0, 0.0, 0.5),
    )
    # A sensor 1 m ahead of a robot turning at 0.5 rad/s moves sideways by 0.5 m/s; the robot itself does not.
    assert value_of(front, VX) == pytest.approx(1.0) and value_of(front, VY) == pytest.approx(0.0)


def test_the_mounting_of_an_imu_is_taken_off(frames):
    pitched = ImuData(1.0, 'side', quaternion_from_rpy(0.0, 0.1, math.pi / 2 + 0.3), np.diag([0.1, 0.2, 0.3]))
    prepared, _ = poses.imu_orientation(pitched, Part('s', (False, True, True)), frames)
    assert prepared.indices == (ROLL, YAW)
    assert value_of(prepared, ROLL) == pytest.approx(-0.1) and value_of(prepared, YAW) == pytest.approx(0.3)


@pytest.mark.parametrize('orientation', ['message', 'state'])
def test_gravity_is_taken_off_a_tilted_imu(frames, orientation):
    q = quaternion_from_rpy(0.2, -0.1, 0.7)
    felt = rotation_matrix(q).T @ (0.0, 0.0, 9.8)
    state = np.zeros(15)
    covariance = np.eye(3)
    if orientation == 'state':
        state[ROLL], state[PITCH], state[YAW] = 0.2, -0.1, 0.7
        covariance = -covariance
        q = (0.0, 0.0, 0.0, 0.0)
    data = ImuData(1.0, 'base_link', q, covariance, linear_acceleration=felt, linear_acceleration_covariance=np.eye(3))
    prepared, problems = measurement.acceleration(data, ALL3, frames, state, (0, 0, 0), Gravity(9.8))
    np.testing.assert_allclose(prepared.z, 0.0, atol=1e-12)
    assert problems == []


def test_two_d_mode_measures_the_plane_and_takes_no_cross_terms(frames):
    covariance = COVARIANCE + 0.01
    prepared, _ = poses.pose(PoseData(1.0, 'map', covariance=covariance), ALL, frames._replace(two_d=True))
    for i in OFF_PLANE:
        k = prepared.indices.index(i)
        assert prepared.z[k] == 0.0 and prepared.R[k, k] == 1e-6
        assert np.count_nonzero(prepared.R[k]) == 1
    assert prepared.R[prepared.indices.index(X), prepared.indices.index(YAW)] == pytest.approx(0.01)


@pytest.mark.parametrize(
    'variance, value, kind',
    [
        (0.1, math.nan, 'not_finite'),
        (0.1, math.inf, 'not_finite'),
        (math.nan, 1.0, 'not_finite'),
        (0.0, 1.0, 'bad_variance'),
        (-0.5, 1.0, 'bad_variance'),
        (1.7e308, 1.0, 'huge_variance'),
    ],
)
def test_bad_data_leave_their_variable_out_and_are_told(frames, variance, value, kind):
    covariance = COVARIANCE.copy()
    covariance[0, 0] = variance
    for frame in ('base_link', 'side'):
        data = TwistData(1.0, frame, (value, 0.5, 0.0), (0.0, 0.0, 0.1), covariance)
        prepared, problems = measurement.twist(data, ALL, frames, (0.0, 0.0, 0.0))
        assert [p.kind for p in problems] == [kind]
        assert len(prepared.indices) == 5
        assert np.isfinite(prepared.z).all() and np.isfinite(prepared.R).all()


def test_bad_numbers_that_nobody_asked_for_do_no_harm(frames):
    covariance = COVARIANCE.copy()
    covariance[5, :] = covariance[:, 5] = math.nan
    data = TwistData(1.0, 'side', (1.0, math.nan, 0.0), (0.0, 0.0, math.inf), covariance)
    prepared, problems = measurement.twist(data, FIRST, frames, (0.0, 0.0, 0.0))
    assert problems == [] and prepared.indices == (VY,)
    assert np.isfinite(prepared.z).all() and np.isfinite(prepared.R).all()


def test_no_rotation_leaves_the_angles_out(frames):
    data = PoseData(1.0, 'map', (1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 0.0), COVARIANCE)
    prepared, problems = poses.pose(data, ALL, frames)
    assert prepared.indices == (X, Y, Z) and [p.kind for p in problems] == ['bad_orientation']


def test_a_missing_transform_is_named(frames):
    data = ImuData(1.0, 'unknown', linear_acceleration_covariance=np.eye(3))
    with pytest.raises(MissingTransform, match='unknown -> base_link'):
        measurement.acceleration(data, ALL3, frames, np.zeros(15), (0, 0, 0))


def test_acceleration_is_at_its_place_in_the_state(frames):
    data = ImuData(1.0, 'base_link', linear_acceleration=(0.3, 0, 9.8), linear_acceleration_covariance=np.eye(3))
    prepared, _ = measurement.acceleration(data, Part('s', (True, False, False)), frames, np.zeros(15), (0, 0, 0))
    assert prepared.indices == (AX,) and prepared.z[0] == pytest.approx(0.3)


def test_the_lever_arm_of_a_state_that_ran_away_is_left_out(frames):
    """Its square, taken in, would end in numbers that are none: found by random messages, twice in a million."""
    frames.transforms.set_transform('base_link', 'aside', Transform((1.0, 0.0, 0.0)))
    for rates in (1e9, 1e150, 1e300):
        state = np.zeros(15)
        state[9:12] = rates
        data = ImuData(1.0, 'aside', linear_acceleration=(0.0, 0.0, 9.8), linear_acceleration_covariance=np.eye(3))
        prepared, problems = measurement.acceleration(data, ALL3, frames, state, (0.0,) * 3)
        assert prepared is None and {p.kind for p in problems} <= {'huge_value', 'not_finite'} and len(problems) == 3
        data = TwistData(1.0, 'aside', (1.0, 0.0, 0.0), (0.0, 0.0, 0.5), np.eye(6))
        prepared, problems = measurement.twist(data, ALL, frames, [1e5 * rates] * 3)
        assert 11 in prepared.indices and 7 not in prepared.indices and np.isfinite(prepared.z).all()
