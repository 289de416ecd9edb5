"""fake_localization: the map's frame follows the true pose, whatever the odometry says."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_common.planar import wrap_exact
from sara_localization.fake import FakeConfig, FakeLocalization, true_pose
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.inputs.data import PoseData

metres, angle = st.floats(-100.0, 100.0), st.floats(-math.pi, math.pi)
poses = st.builds(lambda x, y, yaw: Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw), metres, metres, angle)


def near(a: Transform, b: Transform):
    assert a.translation == pytest.approx(b.translation, abs=1e-6)
    assert abs(wrap_exact(a.rpy[2] - b.rpy[2])) < 1e-6


@given(poses, poses)
def test_map_to_odom_and_the_odometry_make_the_true_pose(truth, odometry):
    output = FakeLocalization(FakeConfig()).on_ground_truth(10.0, truth, odometry)
    near(output.pose, truth)
    near(output.transform.transform @ odometry, truth)
    assert (output.transform.parent, output.transform.child) == ('map', 'odom')
    assert output.transform.stamp == pytest.approx(10.1)


@given(poses, poses, poses, poses)
def test_an_initial_pose_holds_from_then_on(before, after, odometry, wanted):
    fake = FakeLocalization(FakeConfig())
    fake.on_ground_truth(1.0, before, odometry)
    assert fake.on_initial_pose(PoseData(1.0, 'map', wanted.translation, wanted.rotation)) is None
    near(fake.on_ground_truth(1.1, before, odometry).pose, wanted)
    near(
        fake.on_ground_truth(1.2, after, odometry).pose, wanted @ before.inverse() @ after
    )  # it moves as the truth does


def test_delta_moves_the_true_frame():
    fake = FakeLocalization(FakeConfig(delta_x=1.0, delta_y=-2.0))
    near(
        fake.on_ground_truth(1.0, Transform.from_xyz_rpy(5.0, 5.0), Transform()).pose, Transform.from_xyz_rpy(4.0, 7.0)
    )


def test_what_is_no_pose_is_refused_in_a_sentence():
    fake = FakeLocalization(FakeConfig())
    assert 'no true pose' in fake.on_initial_pose(PoseData(1.0, 'map'))
    fake.on_ground_truth(1.0, Transform(), Transform())
    assert 'frame' in fake.on_initial_pose(PoseData(1.0, 'odom'))
    assert 'not a number' in fake.on_initial_pose(PoseData(1.0, 'map', (math.nan, 0.0, 0.0)))
    assert 'rotation' in fake.on_initial_pose(PoseData(1.0, 'map', (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)))
    assert true_pose((0.0, math.inf, 0.0), (0.0, 0.0, 0.0, 1.0)) is None
    assert true_pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)) is None
    near(
        true_pose((1.0, 2.0, 0.0), quaternion_from_rpy(0.0, 0.0, 0.5)),
        Transform.from_xyz_rpy(1.0, 2.0, 0.0, 0.0, 0.0, 0.5),
    )


def test_parameters_are_checked_all_at_once():
    with pytest.raises(ConfigError) as caught:
        FakeConfig.from_params(
            {'odom_frame_id': 'map', 'delta_x': 'far', 'transform_tolerance': -1.0, 'relay_set_pose': 'maybe'}
        )
    assert len(caught.value.faults) == 4
    config = FakeConfig.from_params({'delta_yaw': 1, 'odom_frame': 'odom'})
    assert config.delta_yaw == 1.0 and 'odom_frame ' in config.warnings[0]
