"""Diagnostics by robot_localization's names: keys for what was wrong since the last report, and the rate of the
output.
"""

import numpy as np
import pytest

from sara_common.diagnostics import ERROR, OK, WARN
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.diagnostics import FilterDiagnostics, FrequencyDiagnostics
from sara_localization.engine.engine import FilterEngine
from sara_localization.geometry.rigid import IDENTITY
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData, TwistData

ALL = [True] * 15
NAMES = ('imu0', 'odom0', 'pose0', 'twist0')


class Node:
    """A filter with one input of each kind, and its diagnostics."""

    def __init__(self):
        params = {'frequency': 30.0}
        for name in NAMES:
            params[name], params[name + '_config'] = name, list(ALL)
        config = FilterConfig.from_params(params)
        transforms = TransformBuffer()
        transforms.set_transform('odom', 'base_link', IDENTITY)
        self.engine, self.diagnostics = FilterEngine(config, transforms), FilterDiagnostics(config)

    def give(self, stamp):
        I6, I3 = np.eye(6), np.eye(3)
        self.engine.add_odometry(
            'odom0', OdometryData(stamp, 'odom', 'base_link', pose_covariance=I6, twist_covariance=I6)
        )
        self.engine.add_pose('pose0', PoseData(stamp, 'base_link', covariance=I6))
        self.engine.add_twist('twist0', TwistData(stamp, 'base_link', covariance=I6))
        self.engine.add_imu(
            'imu0',
            ImuData(
                stamp,
                'base_link',
                orientation_covariance=I3,
                angular_velocity_covariance=I3,
                linear_acceleration_covariance=I3,
            ),
        )

    def keys(self, now):
        self.engine.tick(now)
        return {key for key, _ in self.diagnostics.status(now, self.engine.inputs.values(), None).values}


def test_messages_without_a_stamp_are_told():
    node = Node()
    node.give(100.0)
    assert not any(key.endswith('_timestamp') for key in node.keys(100.1))
    node.give(0.0)
    assert {name + '_timestamp' for name in NAMES} <= node.keys(100.2)


def test_messages_from_before_set_pose_are_told():
    node = Node()
    node.give(100.0)
    node.keys(100.1)
    assert node.engine.set_pose(PoseData(101.0, 'odom', covariance=np.eye(6)), 101.0) is None
    node.give(100.5)
    assert {name + '_timestamp' for name in NAMES} <= node.keys(101.1)


def test_messages_older_than_their_predecessor_are_told_part_by_part():
    node = Node()
    node.give(100.0)
    node.keys(100.1)
    node.give(99.0)
    assert {
        'imu0_acceleration_timestamp',
        'imu0_pose_timestamp',
        'imu0_twist_timestamp',
        'odom0_twist_timestamp',
        'odom0_pose_timestamp',
        'pose0_timestamp',
        'twist0_timestamp',
    } <= node.keys(100.2)


def test_a_problem_is_told_once_and_not_for_ever():
    node = Node()
    node.give(100.0)
    node.give(0.0)
    status = lambda now: node.diagnostics.status(now, node.engine.inputs.values(), None)
    node.engine.tick(100.1)
    assert status(100.1).level == WARN
    assert status(101.1).level == OK


def test_what_is_wrong_with_the_settings_stays():
    config = FilterConfig.from_params({'odom0': 'odom', 'odom0_config': [True] * 6 + [False] * 9})
    diagnostics = FilterDiagnostics(config, [(ERROR, 'X_configuration', 'x is not measured')])
    for now in (1.0, 2.0):
        status = diagnostics.status(now, (), None)
        assert status.level == ERROR and ('X_configuration', 'x is not measured') in status.values


def test_waiting_is_an_error_that_says_for_what():
    node = Node()
    status = node.diagnostics.status(1.0, node.engine.inputs.values(), 'nothing came')
    assert status.level == ERROR and 'nothing came' in status.message


@pytest.mark.parametrize(
    'rate, level, words',
    [
        (30.0, OK, 'met'),
        (26.0, OK, 'met'),
        (20.0, WARN, 'too low'),
        (40.0, WARN, 'too high'),
        (0.0, ERROR, 'No events'),
    ],
)
def test_the_rate_of_the_output_is_judged(rate, level, words):
    frequency = FrequencyDiagnostics(30.0)
    status, due = None, 0.0
    for second in range(12):
        due += rate
        while frequency.count < round(due) and second:
            frequency.tick()
        status = frequency.status(100.0 + second)
    assert status.level == level and words in status.message
    assert dict(status.values)['Events since startup'] == str(frequency.count)


def test_the_rate_starts_anew_when_the_clock_goes_back():
    frequency = FrequencyDiagnostics(30.0)
    frequency.status(100.0)
    frequency.status(101.0)
    assert frequency.status(50.0).level == OK
    for _ in range(30):
        frequency.tick()
    assert frequency.status(51.0).message == 'Desired frequency met'
