"""Differential, relative, child frames, covariances of the user's own, lagged data, switches: what the inputs' options
do.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import AX, SIZE, VX, VYAW, YAW, X, Y
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData, TwistData

POSE6 = (0, 1, 2, 3, 4, 5)


def mask(*variables):
    return [i in variables for i in range(SIZE)]


def make(buffer=None, filter='ekf', **params):
    said = []
    params = {'frequency': 20, 'initial_estimate_covariance': [0.01] * SIZE, **params}
    engine = FilterEngine(FilterConfig.from_params(params, filter), buffer or TransformBuffer(), said.append)
    engine.said = said
    return engine


def pose(stamp, x=0.0, y=0.0, yaw=0.0, frame='odom', variance=1e-4, **changes):
    return PoseData(stamp, frame, (x, y, 0.0), quaternion_from_rpy(0, 0, yaw), np.eye(6) * variance)


def odometry(stamp, transform=Transform(), child='base_link', linear=(0, 0, 0), angular=(0, 0, 0), variance=1e-4):
    return OdometryData(
        stamp,
        'odom',
        child,
        transform.translation,
        transform.rotation,
        np.eye(6) * variance,
        linear,
        angular,
        np.eye(6) * variance,
    )


def imu(
    stamp, yaw=0.0, rate=0.0, frame='base_link', force=(0, 0, 0), orientation=None, pitch=0.0, roll=0.0, measured=True
):
    q = orientation or quaternion_from_rpy(roll, pitch, yaw)
    covariance = np.eye(3) * 1e-4 if measured else -np.eye(3)
    return ImuData(stamp, frame, q, covariance, (0.0, 0.0, rate), np.eye(3) * 1e-4, force, np.eye(3) * 1e-4)


# Differential


@given(st.floats(-3, 3), st.floats(-2, 2), st.floats(-1, 1), st.floats(-3, 3))
def test_differential_poses_are_a_twist_wherever_they_start(x, speed, turning, heading):
    """From an arbitrary pose in a frame nobody knows, a steady motion gives its own speed and rate."""
    engine = make(pose0='/pose', pose0_config=mask(*POSE6), pose0_differential=True, two_d_mode=True)
    at = Transform.from_xyz_rpy(x, 1.0, 0, 0, 0, heading)
    for k in range(40):
        now = 100.0 + 0.05 * k
        engine.add_pose('pose0', PoseData(now, 'moon', at.translation, at.rotation, np.eye(6) * 1e-4))
        output = engine.tick(now)
        at = at @ Transform.from_xyz_rpy(speed * 0.05, 0, 0, 0, 0, turning * 0.05)
    assert output.state[VX] == pytest.approx(speed, abs=0.02 + 0.02 * abs(speed))
    assert output.state[VYAW] == pytest.approx(turning, abs=0.02 + 0.02 * abs(turning))


def test_the_first_differential_pose_only_begins_and_equal_stamps_are_told():
    engine = make(pose0='/pose', pose0_config=mask(*POSE6), pose0_differential=True)
    engine.add_pose('pose0', pose(100.0, x=50.0))
    assert engine.tick(100.0) is None
    engine.add_pose('pose0', pose(100.0, x=51.0))
    assert engine.inputs['pose0'].problems['same_stamp'] == 1


def test_a_pose_that_was_dropped_does_not_make_the_robot_fast():
    """robot_localization divides by the time since the last message, even if that message gave no pose."""
    engine = make(pose0='/pose', pose0_config=mask(*POSE6), pose0_differential=True, two_d_mode=True)
    for k in range(60):
        now = 100.0 + 0.05 * k
        data = pose(now, x=0.02 * k)
        if 30 <= k < 40:
            data = PoseData(now, 'odom', (math.nan, 0, 0), (0, 0, 0, 0), np.eye(6) * 1e-4)
        engine.add_pose('pose0', data)
        output = engine.tick(now)
        if k > 20:
            assert output.state[VX] == pytest.approx(0.4, abs=0.05)
    assert engine.inputs['pose0'].problems['bad_pose'] == 10


def test_differential_imu_measures_turning_through_its_mounting():
    buffer = TransformBuffer()
    buffer.set_transform('base_link', 'imu', Transform.from_xyz_rpy(0.1, 0, 0, math.pi, 0, 0.4))
    engine = make(buffer, imu0='/imu', imu0_config=mask(YAW), imu0_differential=True, two_d_mode=True)
    for k in range(40):
        now, yaw = 100.0 + 0.05 * k, 0.02 * k
        q = (Transform(rotation=quaternion_from_rpy(math.pi, 0, 0.4 + yaw))).rotation
        engine.add_imu('imu0', imu(now, frame='imu', orientation=q))
        output = engine.tick(now)
    assert output.state[VYAW] == pytest.approx(0.4, abs=0.01)


# Relative


@given(st.floats(-100, 100), st.floats(-3, 3))
def test_relative_poses_start_at_zero_and_whole_turns_make_no_difference(x, heading):
    engine = make(pose0='/pose', pose0_config=mask(X, Y, YAW), pose0_relative=True, two_d_mode=True)
    first = Transform.from_xyz_rpy(x, -7.0, 0, 0, 0, heading)
    for k in range(30):
        now = 100.0 + 0.05 * k
        at = first @ Transform.from_xyz_rpy(0.01 * k, 0, 0, 0, 0, 0.001 * k)
        engine.add_pose('pose0', PoseData(now, 'odom', at.translation, at.rotation, np.eye(6) * 1e-6))
        output = engine.tick(now)
    np.testing.assert_allclose(output.state[[X, Y, YAW]], (0.29, 0.0, 0.029), atol=0.01)


def test_relative_starts_anew_after_set_pose():
    engine = make(imu0='/imu', imu0_config=mask(YAW, VYAW), imu0_relative=True, two_d_mode=True)
    engine.add_imu('imu0', imu(100.0, yaw=2.0))
    assert engine.tick(100.0).state[YAW] == pytest.approx(0.0, abs=1e-9)
    engine.set_pose(pose(100.5, variance=1e-4), 100.5)
    engine.add_imu('imu0', imu(101.0, yaw=2.5))
    assert engine.tick(101.0).state[YAW] == pytest.approx(0.0, abs=1e-9)


def test_a_relative_pose_without_rotation_is_no_beginning():
    engine = make(imu0='/imu', imu0_config=mask(YAW, VYAW), imu0_relative=True, two_d_mode=True)
    engine.add_imu('imu0', imu(100.0, orientation=(0.0, 0.0, 0.0, 0.0)))
    engine.add_imu('imu0', imu(100.1, yaw=1.0))
    engine.add_imu('imu0', imu(100.2, yaw=1.0))
    assert engine.tick(100.2).state[YAW] == pytest.approx(0.0, abs=1e-6)


# Child frames


def test_pose_use_child_frame_takes_the_pose_of_another_part_of_the_robot():
    buffer = TransformBuffer()
    buffer.set_transform('base_link', 'camera', Transform.from_xyz_rpy(0.5, 0.2, 0, 0, 0, math.pi / 2))
    for use in (True, False):
        engine = make(
            buffer, odom0='/odom', odom0_config=mask(X, Y, YAW), odom0_pose_use_child_frame=use, two_d_mode=True
        )
        base = Transform.from_xyz_rpy(3.0, 4.0, 0, 0, 0, 0.3)
        camera = base @ buffer.lookup('base_link', 'camera', 0.0)
        for k in range(20):
            engine.add_odometry('odom0', odometry(100.0 + 0.05 * k, camera, 'camera'))
        state = engine.tick(101.0).state
        expected = base if use else camera
        np.testing.assert_allclose(state[[X, Y]], expected.translation[:2], atol=1e-6)
        assert state[YAW] == pytest.approx(expected.rpy[2], abs=1e-6)
    missing = make(odom0='/odom', odom0_config=mask(X, Y, YAW), odom0_pose_use_child_frame=True)
    missing.add_odometry('odom0', odometry(100.0, child='camera'))
    assert any('base_link -> camera' in sentence for sentence in missing.said)


# Gravity


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3, 3))
def test_gravity_is_removed_along_the_messages_orientation(roll, pitch, yaw):
    engine = make(imu0='/imu', imu0_config=mask(12, 13, 14), imu0_remove_gravitational_acceleration=True)
    attitude = Transform.from_xyz_rpy(0, 0, 0, roll, pitch, yaw)
    force = attitude.inverse().apply((0.0, 0.0, 9.80665))
    engine.add_imu('imu0', imu(100.0, yaw, roll=roll, pitch=pitch, force=force))
    np.testing.assert_allclose(engine.tick(100.0).state[12:], 0.0, atol=1e-9)


def test_gravity_is_removed_along_the_states_orientation_where_the_imu_has_none():
    start = np.zeros(SIZE)
    start[3:6] = 0.1, -0.2, 1.0
    engine = make(
        imu0='/imu',
        imu0_config=mask(12, 13, 14),
        imu0_remove_gravitational_acceleration=True,
        initial_state=start.tolist(),
    )
    force = Transform.from_xyz_rpy(0, 0, 0, *start[3:6]).inverse().apply((0.0, 0.0, 9.80665))
    engine.add_imu('imu0', imu(100.0, force=force, measured=False))
    np.testing.assert_allclose(engine.tick(100.0).state[12:], 0.0, atol=1e-9)


# Covariances


def test_a_covariance_of_the_users_own_takes_the_place_of_the_messages():
    loose = make(twist0='/t', twist0_config=mask(VX))
    tight = make(twist0='/t', twist0_config=mask(VX), twist0_twist_covariance=[1e-6] * 6)
    for engine in (loose, tight):
        for k in range(5):
            engine.add_twist('twist0', TwistData(100.0 + k, 'base_link', (1, 0, 0), (0, 0, 0), np.eye(6) * 10.0))
        engine.given = engine.tick(104.0)
    assert tight.given.covariance[VX, VX] < 1.1e-6 < 1.0 < loose.given.covariance[VX, VX]


def test_an_override_mends_the_zero_variances_of_a_driver_but_not_a_part_that_is_not_measured():
    engine = make(
        imu0='/imu',
        imu0_config=mask(YAW, VYAW),
        imu0_angular_velocity_covariance=[1e-4] * 3,
        imu0_orientation_covariance=[1e-2] * 3,
    )
    engine.add_imu('imu0', ImuData(100.0, 'base_link', (0, 0, 0, 1), -np.eye(3), (0, 0, 0.3), np.zeros((3, 3))))
    output = engine.tick(100.0)
    assert output.state[VYAW] == 0.3 and not engine.inputs['imu0'].problems
    assert output.covariance[YAW, YAW] == 0.01  # the initial one


def test_wheels_that_slip_in_turns_are_trusted_less_in_turns():
    found = {}
    for turning in (0.0, 1.0):
        engine = make(odom0='/odom', odom0_config=mask(VX, VYAW), odom0_turning_noise=[0.1, 0.0, 0.3])
        engine.add_odometry('odom0', odometry(100.0, linear=(0.5, 0, 0), angular=(0, 0, turning)))
        found[turning] = engine.tick(100.0).covariance
    assert found[0.0][VX, VX] == 1e-4 and found[1.0][VX, VX] == pytest.approx(1e-4 + 0.01)
    assert found[1.0][VYAW, VYAW] == pytest.approx(1e-4 + 0.09)


def test_a_number_that_is_none_stays_out_of_the_first_measurement():
    """robot_localization copies it into its state."""
    engine = make(twist0='/t', twist0_config=mask(VX, VYAW))
    engine.add_twist('twist0', TwistData(100.0, 'base_link', (math.nan, 0, 0), (0, 0, 0.2), np.eye(6)))
    output = engine.tick(100.0)
    assert output.state[VYAW] == 0.2 and np.isfinite(output.state).all() and output.covariance[VX, VX] == 0.01


def test_a_user_covariance_with_correlations_does_not_become_indefinite_at_the_start():
    """robot_localization overwrites a block of it and leaves the cross terms."""
    A = np.full((SIZE, SIZE), 0.9) + 0.1 * np.eye(SIZE)
    engine = make(twist0='/t', twist0_config=mask(VX, VYAW), initial_estimate_covariance=A.ravel().tolist())
    engine.add_twist('twist0', TwistData(100.0, 'base_link', covariance=np.eye(6) * 1e-6))
    assert np.linalg.eigvalsh(engine.tick(100.0).covariance).min() > 0.0


# Lagged data


def drive(engine, order, lag=0.0):
    """Measurements of a robot that speeds up, delivered in `order` of their numbers; ticks go with the deliveries."""
    output = None
    for delivered, k in enumerate(order):
        stamp = 100.0 + 0.05 * k
        engine.add_twist('twist0', TwistData(stamp, 'base_link', (0.05 * k, 0, 0), (0, 0, 0.2), np.eye(6) * 1e-3))
        output = engine.tick(100.0 + 0.05 * delivered + lag) or output
    return engine.tick(100.0 + 0.05 * (len(order) - 1) + lag)


@given(st.permutations(range(8)), st.sampled_from(['ekf', 'ukf']))
def test_with_lagged_data_any_order_of_one_topic_gives_the_result_of_the_right_order(order, filter):
    """robot_localization drops the late ones of a topic, lagged data or not."""
    params = dict(
        twist0='/t', twist0_config=mask(VX, VYAW), two_d_mode=True, smooth_lagged_data=True, history_length=10.0
    )
    order = [0, 1] + [k + 2 for k in order]
    late = drive(make(filter=filter, **params), order, lag=1.0)
    right = drive(make(filter=filter, **params), sorted(order), lag=1.0)
    np.testing.assert_allclose(late.state, right.state, atol=1e-9)
    np.testing.assert_allclose(late.covariance, right.covariance, atol=1e-12)
    assert late.stamp == right.stamp


def test_without_lagged_data_late_messages_are_dropped_and_told_once():
    engine = make(twist0='/t', twist0_config=mask(VX, VYAW))
    drive(engine, [0, 1, 2, 5, 3, 4, 6], lag=1.0)
    assert engine.inputs['twist0'].problems['out_of_order'] == 2 and sum('older than' in s for s in engine.said) == 1


def test_a_message_older_than_the_history_is_dropped():
    engine = make(twist0='/t', twist0_config=mask(VX, VYAW), smooth_lagged_data=True, history_length=0.2)
    drive(engine, [*range(20), 2], lag=0.0)
    assert engine.inputs['twist0'].problems['out_of_order'] == 1


def test_a_differential_source_gains_nothing_from_a_late_pose():
    params = dict(
        pose0='/pose',
        pose0_config=mask(*POSE6),
        pose0_differential=True,
        two_d_mode=True,
        smooth_lagged_data=True,
        history_length=10.0,
    )
    engine = make(**params)
    for k in (0, 1, 2, 4, 3, 5):
        engine.add_pose('pose0', pose(100.0 + 0.05 * k, x=0.02 * k))
        engine.tick(100.0 + 0.05 * k)
    assert engine.inputs['pose0'].problems['out_of_order'] == 1
    assert engine.tick(100.25).state[VX] == pytest.approx(0.4, abs=0.05)


def test_what_is_done_again_uses_the_command_of_its_time():
    params = dict(
        twist0='/t',
        twist0_config=mask(VYAW),
        two_d_mode=True,
        smooth_lagged_data=True,
        history_length=10.0,
        use_control=True,
        control_config=[True] + [False] * 5,
        control_timeout=10.0,
    )
    results = []
    for late in (False, True):
        engine = make(**params)
        for k in range(20):
            stamp = 100.0 + 0.05 * k
            engine.add_control([1.0 if k < 10 else -1.0] + [0.0] * 5, stamp)
            if not (late and k == 5):
                engine.add_twist('twist0', TwistData(stamp, 'base_link', covariance=np.eye(6)))
            engine.tick(stamp)
        if late:
            engine.add_twist('twist0', TwistData(100.25, 'base_link', covariance=np.eye(6)))
        results.append(engine.tick(100.951).state[VX])
        assert engine.control.command[0] == -1.0
    assert results[0] == pytest.approx(results[1], abs=1e-9)


# Switches


def test_disabled_at_startup_it_waits_for_enable():
    engine = make(twist0='/t', twist0_config=mask(VX), disabled_at_startup=True)
    engine.add_twist('twist0', TwistData(100.0, 'base_link', (5, 0, 0), covariance=np.eye(6)))
    assert engine.tick(100.0) is None and not engine.enabled
    assert engine.enable() and not engine.enable()
    assert engine.tick(100.1) is None  # what came before is not taken in
    engine.add_twist('twist0', TwistData(100.2, 'base_link', (1, 0, 0), covariance=np.eye(6)))
    assert engine.tick(100.2).state[VX] == 1.0


def test_toggled_off_it_goes_on_with_its_state_and_uses_nothing():
    engine = make(twist0='/t', twist0_config=mask(VX))
    drive(engine, range(10))
    assert engine.toggle(False) and not engine.toggle(False)
    before = engine.tick(101.0)
    engine.add_twist('twist0', TwistData(101.1, 'base_link', (9, 0, 0), covariance=np.eye(6) * 1e-6))
    output = engine.tick(105.0)
    np.testing.assert_array_equal(output.state, before.state)
    assert output.stamp == 105.0 and output.published
    assert engine.toggle(True)
    engine.add_twist('twist0', TwistData(105.1, 'base_link', (0.5, 0, 0), covariance=np.eye(6) * 1e-6))
    assert engine.tick(105.1).state[X] - before.state[X] < 0.2


def test_a_message_far_ahead_of_the_clock_is_told_and_does_not_shut_out_the_next():
    engine = make(twist0='/t', twist0_config=mask(VX))
    engine.tick(100.0)
    engine.add_twist('twist0', TwistData(5000.0, 'base_link', (9, 0, 0), covariance=np.eye(6)))
    engine.add_twist('twist0', TwistData(100.1, 'base_link', (1, 0, 0), covariance=np.eye(6)))
    assert engine.tick(100.1).state[VX] == 1.0
    assert engine.inputs['twist0'].problems['from_the_future'] == 1 and 'ahead of the clock' in engine.said[0]


@pytest.mark.parametrize('ahead', [1.2, 9.9, 3600.0])
@pytest.mark.parametrize('begins', ['start', 'reset'])
@pytest.mark.parametrize('lagged', [False, True])
def test_a_first_message_ahead_of_the_clock_costs_itself_alone(ahead, begins, lagged):
    engine = make(twist0='/t', twist0_config=mask(VX), smooth_lagged_data=lagged, history_length=1.0)
    if begins == 'reset':
        drive(engine, range(-10, 0))
        engine.reset()
    engine.clock(100.0)
    engine.add_twist('twist0', TwistData(100.0 + ahead, 'base_link', (9, 0, 0), covariance=np.eye(6)))
    last = drive(engine, range(300))
    account = engine.inputs['twist0']
    assert account.problems == {'from_the_future': 1} and account.used == account.received - 1
    assert last.state[VX] == pytest.approx(0.05 * 299, abs=0.01)


def test_a_message_a_little_ahead_of_the_clock_waits_until_its_time_comes():
    engine = make(twist0='/t', twist0_config=mask(VX))
    engine.tick(100.0)
    engine.add_twist('twist0', TwistData(100.5, 'base_link', (1, 0, 0), covariance=np.eye(6)))
    assert engine.tick(100.4) is None and engine.tick(100.5).state[VX] == 1.0


@pytest.mark.parametrize('two_d', [False, True])
def test_consistency_of_an_input_is_about_one_when_its_variance_is_honest(two_d):
    rng = np.random.default_rng(0)
    for claimed, low, high in ((0.01, 0.6, 1.6), (0.0004, 5.0, 100.0)):
        engine = make(twist0='/t', twist0_config=mask(VX), process_noise_covariance=[1e-6] * SIZE, two_d_mode=two_d)
        for k in range(400):
            stamp = 100.0 + 0.05 * k
            engine.add_twist(
                'twist0', TwistData(stamp, 'base_link', (rng.normal() * 0.1, 0, 0), covariance=np.eye(6) * claimed)
            )
            engine.tick(stamp)
        assert low < engine.inputs['twist0'].consistency < high


def test_acceleration_and_prediction_to_the_current_time():
    engine = make(imu0='/imu', imu0_config=mask(AX), predict_to_current_time=True, publish_acceleration=True)
    for k in range(20):
        engine.add_imu('imu0', imu(100.0 + 0.05 * k, force=(1.0, 0, 0)))
        output = engine.tick(100.02 + 0.05 * k)
        assert output.stamp == pytest.approx(100.02 + 0.05 * k)
    assert output.state[AX] == pytest.approx(1.0, abs=0.02) and output.state[VX] > 0.5


def test_invert_tf_broadcasts_the_world_from_the_robot():
    engine = make(pose0='/pose', pose0_config=mask(X, Y, YAW), invert_tf=True, two_d_mode=True)
    engine.add_pose('pose0', pose(100.0, 3.0, 1.0, 0.5))
    t = engine.tick(100.0).transform
    assert (t.parent, t.child) == ('base_link', 'odom')
    np.testing.assert_allclose(
        (t.transform @ Transform.from_xyz_rpy(3.0, 1.0, 0, 0, 0, 0.5)).translation, 0.0, atol=1e-9
    )
