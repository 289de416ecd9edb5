"""Every mistake that users make is found and told in one sentence with its remedy, and a sound configuration is left in peace."""
from pathlib import Path

import pytest
import yaml

from sara_localization import check_config
from sara_localization.diagnostics import ERROR, WARN

CONFIG = Path(__file__).resolve().parents[2] / 'config'


def mask(*variables):
    return [k in variables for k in range(15)]


def sound(**changes):
    """A planar robot with wheels and an IMU, with changes; None takes a parameter out."""
    params = dict(frequency=50, two_d_mode=True, odom0='odom', odom0_config=mask(6, 7), imu0='imu', imu0_config=mask(5, 11))
    params.update(changes)
    return {name: value for name, value in params.items() if value is not None}


def found(params, filter='ekf'):
    return check_config.check(params, filter)[1]


def test_a_sound_configuration_is_left_in_peace():
    assert found(sound()) == []


@pytest.mark.parametrize('name', ['ekf_default.yaml'])
def test_our_own_default_is_sound(name):
    assert found(yaml.safe_load((CONFIG / name).read_text())) == []


def test_the_thesis_set_is_told_to_measure_itself():
    findings = found(yaml.safe_load((CONFIG / 'ekf_thesis.yaml').read_text()))
    assert [f.key for f in findings] == ['odom0_configuration'] and 'measures itself' in findings[0].sentence


MISTAKES = [
    # changed parameters, level, key, words of the sentence
    (dict(odom0_config=mask(7)), ERROR, 'X_configuration', 'Neither x nor its velocity'),
    (dict(imu0_config=mask(14), imu0_remove_gravitational_acceleration=True), ERROR, 'YAW_configuration', 'Neither yaw'),
    (dict(two_d_mode=False), ERROR, 'Z_configuration', 'two_d_mode'),
    (dict(odom0_config=mask(6)), ERROR, 'Y_configuration', 'sideways'),
    (dict(pose0='gps', pose0_config=mask(0, 1), odom0_config=mask(0, 1, 6, 7)), WARN, 'X_configuration', 'odom0_differential: true'),
    (dict(imu0_differential=True, imu0_relative=True), WARN, 'parameters', 'differential'),
    (dict(odom0_differential=True), WARN, 'parameters', 'no effect'),
    (dict(odom0_pose_use_child_frame=True), WARN, 'odom0_configuration', 'no effect'),
    (dict(world_frame='map', imu0_relative=True), WARN, 'imu0_configuration', 'initial_state'),
    (dict(world_frame='map', odom0_config=mask(0, 1, 6)), WARN, 'odom0_configuration', 'measures itself'),
    (dict(two_d_mode=False, odom0_config=mask(2, 3, 4, 6, 7), imu0_config=mask(5, 11, 14)), WARN, 'imu0_configuration', 'gravity'),
    (dict(odom0_config=mask(7), imu0_config=mask(5, 11, 12)), WARN, 'imu0_configuration', 'bias of the accelerometer'),
    (dict(process_noise_covariance=[0.0] * 15), WARN, 'process_noise_covariance', 'no longer follows'),
    (dict(process_noise_covariance=[1e9] * 15), WARN, 'process_noise_covariance', '1e3'),
    (dict(odom0_twist_rejection_threshold=0.5), WARN, 'odom0_configuration', '3 to 5'),
    (dict(transform_time_offset=5.0), WARN, 'transform_time_offset', '0.05'),
    (dict(sensor_timeout=20.0), WARN, 'sensor_timeout', '1/frequency'),
    (dict(transform_timeout=1.0), WARN, 'transform_timeout', '0.1'),
    (dict(smooth_lagged_data=True), WARN, 'parameters', 'history_length'),
    (dict(smooth_lagged_data=True, history_length=1000.0), WARN, 'history_length', 'delay'),
    (dict(use_control=True, control_config=[False] * 6), WARN, 'control_config', 'no effect'),
    (dict(frequenzy=30), WARN, 'parameters', 'frequency'),
    (dict(imu2='imu', imu2_config=mask(5)), WARN, 'parameters', 'without a gap'),
    (dict(odom0_config=[True] * 12), ERROR, 'configuration', '15'),
    (dict(odom0_config=None), ERROR, 'configuration', 'odom0_config'),
    (dict(odom_frame='base_link'), ERROR, 'configuration', 'must differ'),
    (dict(base_link_frame_output='map'), ERROR, 'configuration', 'base_link_frame_output'),
    (dict(world_frame='earth'), ERROR, 'configuration', 'world_frame'),
    (dict(process_noise_covariance=[-1.0] + [1.0] * 14), ERROR, 'configuration', 'process_noise_covariance'),
    (dict(odom0_twist_covariance=[0.0] * 6), ERROR, 'configuration', 'odom0_twist_covariance'),
    (dict(frequency=0), ERROR, 'configuration', 'frequency'),
]


@pytest.mark.parametrize('changes, level, key, words', MISTAKES, ids=lambda v: '+'.join(v) if isinstance(v, dict) else None)
def test_a_mistake_is_told_with_its_remedy(changes, level, key, words):
    findings = [f for f in found(sound(**changes)) if f.key == key and words in f.sentence]
    assert len(findings) == 1, found(sound(**changes))
    assert findings[0].level == level
    assert findings[0].sentence.rstrip(')').endswith('.')


def test_every_fault_is_told_at_once_and_errors_come_first():
    findings = check_config.sorted_findings(found(sound(frequency=-1, odom0_config=[1], world_frame='x')))
    assert len(findings) == 3
    findings = check_config.sorted_findings(found(sound(frequenzy=1, two_d_mode=False)))
    assert [f.level for f in findings] == sorted((f.level for f in findings), reverse=True)
    assert findings[0].level == ERROR and findings[-1].level == WARN


def test_a_turned_imu_may_measure_yaw_with_another_axis():
    findings = [f for f in found(sound(imu0_config=mask(10))) if f.key == 'YAW_configuration']
    assert [f.level for f in findings] == [WARN] and 'mounted turned' in findings[0].sentence
