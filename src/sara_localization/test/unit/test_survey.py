"""What a recorded drive says about a configuration: what is missing, what is no data, and which sensor misleads."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.diagnostics import ERROR, OK, WARN
from sara_localization.checks import yaw_sources as turning
from sara_localization.checks.mounting import check_mountings, turned_mask
from sara_localization.checks.survey import Survey
from sara_localization.config.filter_config import FilterConfig
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData


def mask(*variables):
    return [k in variables for k in range(15)]


class Drive:
    """A minute of turning left and right, seen by wheels (10 Hz) and an IMU (20 Hz); each thing can be spoilt."""

    def __init__(self, **params):
        self.config = FilterConfig.from_params(
            {
                'two_d_mode': True,
                'odom0': '/odom',
                'odom0_config': mask(6, 7),
                'imu0': '/imu',
                'imu0_config': mask(5, 11),
                **params,
            }
        )
        self.transforms = TransformBuffer()
        self.odometry, self.imu = {}, {}
        self.heading_error = self.gyro_bias = 0.0
        self.wheel_scale = 1.0
        self.moves = True

    @staticmethod
    def rate(t):
        return 0.3 * math.sin(2.0 * math.pi * t / 23.0) if 5.0 < t < 55.0 else 0.0

    def survey(self):
        survey, rng = Survey(self.config, self.transforms), np.random.default_rng(5)
        yaw, dt = 0.0, 0.05
        for k in range(1200):
            t = k * dt
            rate = self.rate(t)
            yaw += rate * dt
            stamp = 1000.0 + t
            if k % 2 == 0:
                v = 0.5 if 5.0 < t < 55.0 and self.moves else 0.0
                values = dict(
                    linear=(v, 0.0, 0.0), angular=(0.0, 0.0, rate * self.wheel_scale), twist_covariance=np.eye(6) * 1e-3
                )
                values.update(self.odometry)
                survey.add(
                    'odom0',
                    OdometryData(values.pop('stamp', stamp), 'odom', values.pop('child', 'base_link'), **values),
                    stamp,
                )
            wrong = yaw + self.heading_error * math.sin(t / 5.0)
            values = dict(
                orientation=quaternion_from_rpy(0.0, 0.0, wrong),
                orientation_covariance=np.eye(3) * 0.01,
                angular_velocity=(0.0, 0.0, rate + self.gyro_bias + rng.normal(0.0, 1e-3)),
                angular_velocity_covariance=np.eye(3) * 1e-5,
                linear_acceleration_covariance=np.eye(3),
            )
            values.update(self.imu)
            survey.add('imu0', ImuData(values.pop('stamp', stamp), values.pop('frame', 'base_link'), **values), stamp)
        return survey

    def findings(self):
        return self.survey().findings()


def only(findings, key):
    chosen = [f for f in findings if f.key == key]
    assert len(chosen) == 1, findings
    return chosen[0]


def test_a_sound_drive_is_left_in_peace():
    assert Drive().findings() == []


def test_a_heading_that_misleads_is_accused_with_its_remedy():
    drive = Drive()
    drive.heading_error = 0.6
    finding = only(drive.findings(), 'imu0_misleads')
    assert finding.level == WARN and "imu0's heading misleads" in finding.sentence and 'gyro_bias' in finding.sentence


def test_wheels_that_slip_are_accused_only_where_their_rate_is_used():
    drive = Drive()
    drive.wheel_scale = 1.3
    assert only(drive.findings(), 'odom0_misleads').level == OK
    drive = Drive(odom0_config=mask(6, 7, 11))
    drive.wheel_scale = 1.3
    assert only(drive.findings(), 'odom0_misleads').level == WARN


def test_a_gyros_bias_shows_at_standstill():
    drive = Drive()
    drive.gyro_bias = 0.01
    finding = only(drive.findings(), 'imu0_bias')
    assert '0.57' in finding.sentence and 'gyro_bias: standstill' in finding.sentence
    drive = Drive(imu0_gyro_bias='standstill')
    drive.gyro_bias = 0.01
    assert not [f for f in drive.findings() if f.key == 'imu0_bias']


def test_a_missing_transform_is_named():
    drive = Drive()
    drive.imu['frame'] = 'imu_link'
    finding = only(drive.findings(), 'imu0_transform')
    assert finding.level == ERROR and 'imu_link -> base_link' in finding.sentence and '1200 of 1200' in finding.sentence


@pytest.mark.parametrize(
    ('params', 'imu', 'lost'),
    [
        ({'world_frame': 'map', 'map_frame': 'map', 'odom0_config': mask(0, 1), 'odom0_differential': True}, {}, set()),
        ({'world_frame': 'map', 'map_frame': 'map', 'odom0_config': mask(0, 1)}, {}, {'odom0_transform'}),
        ({'imu0_config': mask(11)}, {'frame': ''}, set()),
        ({}, {'frame': ''}, {'imu0_transform'}),
    ],
)
def test_what_the_filter_takes_without_a_transform_is_not_lost(params, imu, lost):
    """Poses that count by how they change; rates without a frame, which are the robot's."""
    drive = Drive(**params)
    drive.imu.update(imu)
    drive.odometry.update(position=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0), pose_covariance=np.eye(6) * 1e-3)
    assert {finding.key for finding in drive.findings() if finding.key.endswith('_transform')} == lost


def test_a_sensor_mounted_turned_is_told_and_what_it_no_longer_measures():
    drive = Drive(imu0_config=mask(11))
    drive.imu['frame'] = 'imu_link'
    drive.transforms.set_transform('base_link', 'imu_link', Transform.from_xyz_rpy(roll=math.pi / 2))
    survey = drive.survey()
    findings = survey.findings()
    assert only(findings, 'imu0_mounting').level == OK
    assert only(findings, 'YAW_configuration').level == ERROR
    drive = Drive(imu0_config=mask(10))
    drive.imu['frame'] = 'imu_link'
    drive.transforms.set_transform('base_link', 'imu_link', Transform.from_xyz_rpy(roll=math.pi / 2))
    survey = drive.survey()
    assert not [f for f in survey.findings() if f.key == 'YAW_configuration'] and 'YAW_configuration' in survey.replaces


SPOILT = [
    # which input, what of it, level, words
    ('odometry', dict(stamp=0.0), ERROR, 'no time stamp'),
    ('odometry', dict(twist_covariance=np.zeros((6, 6))), ERROR, 'variance of vx is zero'),
    ('odometry', dict(twist_covariance=-np.eye(6)), ERROR, 'variance of vx is zero, negative'),
    ('odometry', dict(twist_covariance=np.eye(6) * 1e-12), WARN, 'nobody else will be believed'),
    ('odometry', dict(linear=(math.nan, 0.0, 0.0)), WARN, 'not a number'),
    ('imu', dict(orientation_covariance=np.diag([-1.0, 0.0, 0.0])), WARN, 'does not measure'),
    ('imu', dict(angular_velocity=(0.0, 0.0, 0.0)), WARN, 'although the robot moves'),
]


@pytest.mark.parametrize('which, spoilt, level, words', SPOILT)
def test_what_is_no_data_is_told(which, spoilt, level, words):
    drive = Drive()
    getattr(drive, which).update(spoilt)
    key = {'odometry': 'odom0_data', 'imu': 'imu0_data'}[which]
    findings = [f for f in drive.findings() if f.key == key and words in f.sentence]
    assert findings and all(f.level == level for f in findings), drive.findings()


def test_no_message_at_all_is_told():
    config = Drive().config
    findings = Survey(config, TransformBuffer()).findings()
    assert {f.key for f in findings} == {'odom0_data', 'imu0_data'} and all(f.level == ERROR for f in findings)


def test_order_delay_and_gaps_are_told():
    def told(stamps, received, **params):
        survey = Survey(Drive(**params).config, TransformBuffer())
        for stamp, now in zip(stamps, received):
            survey.add('odom0', OdometryData(stamp, 'odom', 'base_link', twist_covariance=np.eye(6)), now)
        return ' '.join(f.sentence for f in survey.findings() if f.key == 'odom0_data')

    steady = [100.0 + 0.1 * k for k in range(100)]
    assert told(steady, steady) == ''
    swapped = steady[:50] + [steady[51], steady[50]] + steady[52:]
    assert 'smooth_lagged_data: true' in told(swapped, steady)
    assert told(swapped, steady, smooth_lagged_data=True, history_length=1.0) == ''
    assert 'arrive 3.00 s after' in told(steady, [t + 3.0 for t in steady])
    assert 'in the future' in told(steady, [t - 0.5 for t in steady])
    assert 'a gap of' in told(
        steady[:50] + [t + 4.0 for t in steady[50:]], steady[:50] + [t + 4.0 for t in steady[50:]]
    )


@settings(max_examples=60)
@given(
    st.floats(-math.pi, math.pi), st.floats(-math.pi / 2, math.pi / 2), st.floats(-math.pi, math.pi), st.integers(0, 14)
)
def test_a_turned_mask_is_the_filters_own(roll, pitch, yaw, variable):
    """mounting.turned_mask says what measurement.py does with a message."""
    from sara_localization.inputs import measurement
    from sara_localization.inputs.measurement import Frames, Part

    mounting = Transform.from_xyz_rpy(roll=roll, pitch=pitch, yaw=yaw)
    chosen = mask(variable)
    buffer = TransformBuffer()
    buffer.set_transform('base_link', 'sensor', mounting)
    turned = turned_mask(chosen, mounting, imu=True)
    if 9 <= variable < 12:
        from sara_localization.inputs.data import TwistData

        data = TwistData(1.0, 'sensor', (0.0, 0.0, 0.0), (0.1, 0.2, 0.3), np.eye(6))
        m, _ = measurement.twist(data, Part('x', tuple(chosen[6:12])), Frames(buffer, 'odom', 'base_link'), np.zeros(3))
        assert set(m.indices) == {k for k in range(15) if turned[k]}
    assert any(turned) and turned_mask(chosen, Transform(), True) == tuple(chosen)


def test_mountings_along_the_axes_change_nothing():
    config = Drive().config
    assert check_mountings(config, {'imu0': Transform((1.0, 2.0, 3.0))})[0] == []


def test_two_sources_accuse_nobody_and_a_short_drive_neither():
    t = np.linspace(0.0, 60.0, 600)
    a, b = turning.Source('a', t, 0.3 * t), turning.Source('b', t, 0.5 * t)
    assert turning.misleading(turning.compare([a, b])) == []
    assert turning.compare([a]) is None
    assert turning.compare([a, turning.Source('c', t[:50], t[:50])]) is None


@given(st.floats(0.05, 0.5), st.floats(1.2, 3.0))
def test_the_one_against_two_is_accused_whichever_it_is(rate, scale):
    t = np.linspace(0.0, 60.0, 600)
    good = [turning.Source(name, t, rate * t + 0.01 * np.sin(t + k)) for k, name in enumerate('ab')]
    bad = turning.Source('c', t, scale * rate * t)
    for order in ([*good, bad], [bad, *good], [good[0], bad, good[1]]):
        accused = turning.misleading(turning.compare(order))
        assert (
            accused == (['c'] if (scale - 1.0) * rate * 10.0 > 0.1 else accused)
            and 'a' not in accused
            and 'b' not in accused
        )


def test_at_rest_keeps_away_from_motion():
    wheels = np.arange(0.0, 20.0, 0.1)
    speed = np.where((wheels > 5.0) & (wheels < 10.0), 0.5, 0.0)
    still = turning.at_rest(
        np.array([1.0, 4.4, 4.8, 7.0, 10.2, 10.8, 15.0, 25.0]), wheels, speed, np.zeros_like(wheels)
    )
    assert still.tolist() == [True, True, False, False, False, True, True, False]


def test_wheels_that_are_silent_are_not_at_rest():
    wheels = np.concatenate([np.arange(0.0, 10.0, 0.1), np.arange(14.0, 20.0, 0.1)])
    still = turning.at_rest(
        np.array([5.0, 9.8, 10.5, 12.0, 13.9, 14.2, 17.0]), wheels, np.zeros_like(wheels), np.zeros_like(wheels)
    )
    assert still.tolist() == [True, False, False, False, False, False, True]


numbers = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.sampled_from([0.0, -1.0, 1e308, -0.0]))


@given(
    st.lists(
        st.tuples(
            st.booleans(),
            numbers,
            st.lists(numbers, min_size=11, max_size=11),
            st.sampled_from(['', 'base_link', '/x']),
        ),
        max_size=30,
    )
)
def test_no_message_can_break_the_survey(messages):
    survey = Survey(Drive().config, TransformBuffer())
    for wheels, stamp, v, frame in messages:
        if wheels:
            survey.add(
                'odom0',
                OdometryData(
                    stamp, 'odom', frame, v[:3], v[3:7], np.full((6, 6), v[7]), v[8:11], v[:3], np.full((6, 6), v[4])
                ),
                100.0,
            )
        else:
            survey.add(
                'imu0',
                ImuData(stamp, frame, v[3:7], np.full((3, 3), v[7]), v[:3], np.full((3, 3), v[8]), v[8:11]),
                100.0,
            )
    with np.errstate(all='ignore'):
        for finding in survey.findings():
            assert finding.sentence.endswith('.')
