"""What the filter does with messages as they come: order, time, transforms, set_pose, output."""

import math

import numpy as np
import pytest

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import VX, VYAW, YAW
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData

DEFAULT = (VX,)
THESIS = (0, 1, VX)
START = [1.0, 1.0] + [0.0] * 13


class Drive:
    """A chair that drives exactly; its wheels and IMU feed an engine every 0.1 s and 0.2 s, ticks come at 50 Hz."""

    def __init__(self, odometry=DEFAULT, restarts=True, **params):
        params = {
            'frequency': 50,
            'two_d_mode': True,
            'world_frame': 'map',
            'predict_to_current_time': True,
            'transform_time_offset': 0.05,
            'odom0': '/odom',
            'odom0_config': [i in odometry for i in range(15)],
            'imu0': '/imu',
            'imu0_config': [i in (YAW, VYAW) for i in range(15)],
            'initial_state': START,
            **params,
        }
        self.buffer, self.said, self.late = TransformBuffer(), [], 0.0
        self.engine = FilterEngine(FilterConfig.from_params(params), self.buffer, self.said.append, restarts)
        self.step, self.set_back = 0, 0.0
        self.pose = Transform()
        self.imu_yaw = 0.0
        self.v = self.w = 0.0
        self.last = None

    @property
    def now(self):
        return 100.0 + 0.02 * self.step - self.set_back

    def odometry(self, stamp, **changes):
        return OdometryData(
            **{
                **dict(
                    stamp=stamp,
                    frame_id='odom',
                    child_frame_id='base_link',
                    position=self.pose.translation,
                    orientation=self.pose.rotation,
                    pose_covariance=np.eye(6) * 1e-3,
                    linear=(self.v, 0.0, 0.0),
                    angular=(0.0, 0.0, self.w),
                    twist_covariance=np.eye(6) * 1e-3,
                ),
                **changes,
            }
        )

    def imu(self, stamp, **changes):
        return ImuData(
            **{
                **dict(
                    stamp=stamp,
                    frame_id='base_link',
                    orientation=quaternion_from_rpy(0, 0, self.imu_yaw),
                    orientation_covariance=np.eye(3) * 1e-2,
                    angular_velocity=(0.0, 0.0, self.w),
                    angular_velocity_covariance=np.eye(3) * 1e-6,
                ),
                **changes,
            }
        )

    def run(self, seconds):
        for _ in range(round(seconds * 50)):
            self.step += 1
            dt = 0.02
            self.pose = self.pose @ Transform.from_xyz_rpy(x=self.v * dt, yaw=self.w * dt)
            self.imu_yaw += self.w * dt
            then = self.pose @ Transform.from_xyz_rpy(x=self.v * self.late, yaw=self.w * self.late).inverse()
            self.buffer.set_transform('odom', 'base_link', then, self.now - self.late)
            if self.step % 5 == 0:
                self.engine.add_odometry('odom0', self.odometry(self.now))
            if self.step % 10 == 0:
                self.engine.add_imu('imu0', self.imu(self.now))
            output = self.engine.tick(self.now)
            self.last = output or self.last
            if output and output.transform:
                t = output.transform
                self.buffer.set_transform(t.parent, t.child, t.transform, t.stamp)
        return self.last


def test_nothing_comes_out_before_the_first_measurement():
    drive = Drive()
    assert drive.engine.tick(1.0) is None
    assert 'nothing received on /odom' in drive.engine.status_lines(1.0)[0]


def test_starts_at_the_initial_state_and_drives_straight():
    drive = Drive()
    drive.v = 0.5
    output = drive.run(4.0)
    np.testing.assert_allclose(output.pose.translation, (3.0, 1.0, 0.0), atol=0.06)
    assert output.stamp == pytest.approx(drive.now) and output.published
    assert (output.frame_id, output.child_frame_id) == ('map', 'base_link')


def test_map_to_odom_joins_the_estimate_with_the_wheels():
    drive = Drive()
    drive.v, drive.w = 0.3, 0.2
    output = drive.run(3.0)
    link = output.map_to_odom
    assert (link.parent, link.child) == ('map', 'odom') and link.stamp == pytest.approx(output.stamp + 0.05)
    joined = link.transform @ drive.buffer.lookup('odom', 'base_link', output.stamp)
    np.testing.assert_allclose(joined.translation, output.pose.translation, atol=1e-9)
    np.testing.assert_allclose(joined.rpy, output.pose.rpy, atol=1e-9)


@pytest.mark.parametrize('v, w', [(0.5, 0.0), (0.0, 0.5), (-0.2, 0.3)])
def test_odometry_that_comes_late_is_joined_as_it_is_or_at_its_own_time(v, w):
    joined = {}
    for at_its_time in (False, True):
        drive = Drive(join_at_odometry_time=at_its_time)
        drive.v, drive.w, drive.late = v, w, 0.06
        output = drive.run(2.0)
        joined[at_its_time] = output.map_to_odom.transform @ drive.buffer.lookup('odom', 'base_link', output.stamp)
    np.testing.assert_allclose(
        (*joined[False].translation, joined[False].yaw), (*output.pose.translation, output.pose.yaw), atol=1e-9
    )
    ahead = joined[True].inverse() @ joined[False]
    assert (ahead.translation[0], ahead.yaw) == pytest.approx((0.06 * v, 0.06 * w), abs=5e-4)


def test_in_the_odom_frame_the_robot_itself_is_broadcast():
    output = Drive(world_frame='odom').run(1.0)
    assert (output.transform.parent, output.transform.child) == ('odom', 'base_link') and output.map_to_odom is None


def test_the_thesis_set_measures_itself_through_its_own_map_to_odom():
    drive = Drive(THESIS)
    drive.v = 0.5
    output = drive.run(5.0)
    assert any('odom -> map' in sentence for sentence in drive.said)  # dropped until map -> odom exists
    assert drive.engine.inputs['odom0'].missing is None
    assert 2.3 < output.state[0] - 1.0 < 3.1  # 2.5 m driven


@pytest.mark.parametrize('yaw', [1.0, -3.0, math.pi])
def test_set_pose_holds_against_measurements_of_before(yaw):
    drive = Drive()
    drive.run(1.0)
    stamp = drive.now
    assert (
        drive.engine.set_pose(
            PoseData(stamp, 'map', (2.0, 3.0, 0.0), quaternion_from_rpy(0, 0, yaw), np.eye(6) * 0.1), drive.now
        )
        is None
    )
    drive.engine.add_imu('imu0', drive.imu(stamp - 0.01))
    drive.engine.add_imu('imu0', drive.imu(stamp))
    drive.imu_yaw = yaw
    output = drive.run(1.0)
    assert drive.engine.inputs['imu0'].problems['before_set_pose'] == 2
    np.testing.assert_allclose(output.pose.translation, (2.0, 3.0, 0.0), atol=1e-3)
    assert abs(math.remainder(output.state[YAW] - yaw, 2 * math.pi)) < 1e-3


def test_set_pose_in_an_unknown_frame_or_without_numbers_is_refused_and_changes_nothing():
    drive = Drive()
    before = drive.run(1.0)
    for pose in (
        PoseData(drive.now, 'moon'),
        PoseData(drive.now, 'map', (math.nan, 0, 0)),
        PoseData(drive.now, 'map', orientation=(0, 0, 0, 0)),
    ):
        assert 'ignored' in drive.engine.set_pose(pose, drive.now)
    np.testing.assert_array_equal(drive.engine.filter.x, before.state)


def test_set_pose_before_the_first_measurement_counts():
    drive = Drive()
    drive.engine.set_pose(PoseData(99.0, 'map', (5.0, 5.0, 0.0), covariance=np.eye(6) * 0.01), 99.0)
    np.testing.assert_allclose(drive.engine.tick(99.0).pose.translation, (5.0, 5.0, 0.0))


def test_a_missing_transform_is_said_once_counted_and_named():
    drive = Drive()
    drive.run(0.5)
    for k in range(3):
        drive.engine.add_imu('imu0', drive.imu(drive.now + 0.001 * k, frame_id='imu_link'))
    assert sum('imu_link -> base_link' in sentence for sentence in drive.said) == 1
    line = drive.engine.status_lines(drive.now + 4.2)[1]
    assert 'no transform imu_link -> base_link for 4.2 s' in line and '6 dropped' in line


def test_measurements_are_taken_in_the_order_of_their_stamps():
    a, b = Drive(), Drive()
    for drive in (a, b):
        drive.run(1.0)
    first, second = a.odometry(a.now + 0.005, linear=(0.1, 0, 0)), a.imu(a.now + 0.01, angular_velocity=(0, 0, 0.1))
    a.engine.add_odometry('odom0', first)
    a.engine.add_imu('imu0', second)
    b.engine.add_imu('imu0', second)
    b.engine.add_odometry('odom0', first)
    np.testing.assert_array_equal(a.engine.tick(a.now + 0.02).state, b.engine.tick(b.now + 0.02).state)


def test_bad_stamps_and_late_messages_are_dropped_and_counted():
    drive = Drive()
    drive.run(1.0)
    for stamp, kind in ((0.0, 'no_stamp'), (math.nan, 'no_stamp'), (drive.now - 0.5, 'out_of_order')):
        before = drive.engine.inputs['odom0'].problems[kind]
        drive.engine.add_odometry('odom0', drive.odometry(stamp))
        assert drive.engine.inputs['odom0'].problems[kind] == before + 1


def test_without_measurements_it_predicts_after_the_sensor_timeout():
    drive = Drive(predict_to_current_time=False, sensor_timeout=0.1)
    drive.v = 0.5
    last = drive.run(2.0)
    assert not drive.engine.tick(drive.now + 0.01).published
    later = drive.engine.tick(drive.now + 0.2)
    assert later.stamp == pytest.approx(drive.now + 0.2)
    assert later.state[0] == pytest.approx(last.state[0] + 0.1, abs=0.01)


def test_a_measurement_from_the_far_future_does_not_stop_it():
    drive = Drive(predict_to_current_time=False)
    drive.run(1.0)
    drive.engine.add_imu('imu0', drive.imu(drive.now + 1e6))
    assert drive.engine.tick(drive.now + 0.5).stamp == pytest.approx(drive.now + 0.5)


@pytest.mark.parametrize('reset', [True, False])
def test_time_that_goes_back_is_noticed(reset):
    drive = Drive(reset_on_time_jump=reset)
    drive.run(1.0)
    assert (drive.engine.tick(50.0) is None) == reset
    assert drive.engine.time_jumps == 1 and any('time went back' in sentence for sentence in drive.said)


@pytest.mark.parametrize('reset', [True, False])
@pytest.mark.parametrize('back', [0.03, 2.0, 60.0])
def test_a_computer_whose_clock_is_set_back_knows_where_the_robot_is(back, reset):
    drive = Drive(restarts=False, reset_on_time_jump=reset)
    drive.v = 0.5
    x = drive.run(4.0).pose.translation[0]
    P = drive.engine.filter.P.copy()
    drive.set_back = back
    assert drive.run(0.02).pose.translation[0] == pytest.approx(x, abs=0.02)
    np.testing.assert_allclose(drive.engine.filter.P, P, rtol=0.3, atol=1e-4)
    drive.v = 0.0
    x = drive.run(0.4).pose.translation[0]
    assert drive.run(1.0).pose.translation[0] == pytest.approx(x, abs=0.02)  # what comes then is used at once
    assert drive.engine.inputs['odom0'].used > 50


def test_in_a_simulation_time_that_goes_back_takes_no_uncertainty_away():
    drive = Drive(reset_on_time_jump=False)
    drive.run(4.0)
    P = drive.engine.filter.P.copy()
    drive.engine.tick(drive.now - 2.0)
    np.testing.assert_array_equal(drive.engine.filter.P, P)


def test_turning_the_start_turns_the_path():
    paths = []
    for yaw in (0.0, 2.5):
        drive = Drive(initial_state=[0.0] * 5 + [yaw] + [0.0] * 9)
        drive.imu_yaw, drive.v, drive.w = yaw, 0.4, 0.3
        x, y, _ = drive.run(5.0).pose.translation
        c, s = math.cos(yaw), math.sin(yaw)
        paths.append((c * x + s * y, c * y - s * x))
    np.testing.assert_allclose(*paths, atol=1e-9)


def test_debug_writes_what_happened_step_by_step(tmp_path):
    file = tmp_path / 'trace.txt'
    drive = Drive(debug=True, debug_out_file=str(file), odom0_twist_rejection_threshold=4.0)
    drive.v = 0.5
    drive.run(2.0)
    drive.engine.add_odometry('odom0', drive.odometry(drive.now + 0.01, linear=(50.0, 0.0, 0.0)))
    drive.run(0.1)
    lines = file.read_text().splitlines()
    ticks = [line for line in lines if line.startswith('tick')]
    assert len(ticks) == 105 and ticks[-1] == f'tick {drive.now:.3f} s'
    assert sum(line.startswith('  took odom0_twist') for line in lines) >= 19
    assert sum(line.startswith('  took imu0_pose') for line in lines) == 10
    (left,) = [line for line in lines if line.startswith('  left')]
    assert 'rejected by the gate' in left and 'vx 50 (' in left
    assert lines[-1].startswith('  state of') and ' vx 0.5' in lines[-1]


def test_a_debug_file_that_cannot_be_written_is_told_and_the_filter_runs(tmp_path):
    drive = Drive(debug=True, debug_out_file=str(tmp_path / 'nowhere' / 'trace.txt'))
    drive.run(1.0)
    assert drive.last is not None and any('debug_out_file' in sentence for sentence in drive.said)
