"""Every mistake that users make is found and told in one sentence with its remedy, and a sound configuration is left in
peace.
"""

from pathlib import Path

import pytest
import yaml

from sara_common.diagnostics import ERROR, WARN
from sara_localization.checks import check_config
from sara_localization.checks.findings import sorted_findings

CONFIG = Path(__file__).resolve().parents[2] / 'config'


def mask(*variables):
    return [k in variables for k in range(15)]


def sound(**changes):
    """A planar robot with wheels and an IMU, with changes; None takes a parameter out."""
    params = dict(
        frequency=50, two_d_mode=True, odom0='odom', odom0_config=mask(6, 7), imu0='imu', imu0_config=mask(5, 11)
    )
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
    (
        dict(imu0_config=mask(14), imu0_remove_gravitational_acceleration=True),
        ERROR,
        'YAW_configuration',
        'Neither yaw',
    ),
    (dict(two_d_mode=False), ERROR, 'Z_configuration', 'two_d_mode'),
    (dict(odom0_config=mask(6)), ERROR, 'Y_configuration', 'sideways'),
    (
        dict(pose0='gps', pose0_config=mask(0, 1), odom0_config=mask(0, 1, 6, 7)),
        WARN,
        'X_configuration',
        'odom0_differential: true',
    ),
    (dict(imu0_differential=True, imu0_relative=True), WARN, 'parameters', 'differential'),
    (dict(odom0_differential=True), WARN, 'parameters', 'no effect'),
    (dict(odom0_pose_use_child_frame=True), WARN, 'odom0_configuration', 'no effect'),
    (dict(world_frame='map', imu0_relative=True), WARN, 'imu0_configuration', 'initial_state'),
    (dict(world_frame='map', odom0_config=mask(0, 1, 6)), WARN, 'odom0_configuration', 'measures itself'),
    (
        dict(two_d_mode=False, odom0_config=mask(2, 3, 4, 6, 7), imu0_config=mask(5, 11, 14)),
        WARN,
        'imu0_configuration',
        'gravity',
    ),
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


@pytest.mark.parametrize(
    'changes, level, key, words', MISTAKES, ids=lambda v: '+'.join(v) if isinstance(v, dict) else None
)
def test_a_mistake_is_told_with_its_remedy(changes, level, key, words):
    findings = [f for f in found(sound(**changes)) if f.key == key and words in f.sentence]
    assert len(findings) == 1, found(sound(**changes))
    assert findings[0].level == level
    assert findings[0].sentence.rstrip(')').endswith('.')


def test_every_fault_is_told_at_once_and_errors_come_first():
    findings = sorted_findings(found(sound(frequency=-1, odom0_config=[1], world_frame='x')))
    assert len(findings) == 3
    findings = sorted_findings(found(sound(frequenzy=1, two_d_mode=False)))
    assert [f.level for f in findings] == sorted((f.level for f in findings), reverse=True)
    assert findings[0].level == ERROR and findings[-1].level == WARN


def test_a_turned_imu_may_measure_yaw_with_another_axis():
    findings = [f for f in found(sound(imu0_config=mask(10))) if f.key == 'YAW_configuration']
    assert [f.level for f in findings] == [WARN] and 'mounted turned' in findings[0].sentence


FILTER = [
    'frequency',
    'sensor_timeout',
    'two_d_mode',
    'map_frame',
    'odom_frame',
    'base_link_frame',
    'base_link_frame_output',
    'world_frame',
    'tf_prefix',
    'publish_tf',
    'invert_tf',
    'publish_acceleration',
    'permit_corrected_publication',
    'transform_time_offset',
    'transform_timeout',
    'print_diagnostics',
    'gravitational_acceleration',
    'debug',
    'debug_out_file',
    'smooth_lagged_data',
    'history_length',
    'reset_on_time_jump',
    'predict_to_current_time',
    'use_control',
    'stamped_control',
    'control_timeout',
    'control_config',
    'acceleration_limits',
    'deceleration_limits',
    'acceleration_gains',
    'deceleration_gains',
    'dynamic_process_noise_covariance',
    'process_noise_covariance',
    'initial_estimate_covariance',
    'initial_state',
    'disabled_at_startup',
    'alpha',
    'kappa',
    'beta',
]
GATES = ['pose_rejection_threshold', 'twist_rejection_threshold']
INPUTS = {
    'odom': ['differential', 'relative', 'pose_use_child_frame', *GATES],
    'pose': ['differential', 'relative', 'rejection_threshold'],
    'twist': ['rejection_threshold'],
    'imu': [
        'differential',
        'relative',
        'remove_gravitational_acceleration',
        'linear_acceleration_rejection_threshold',
        *GATES,
    ],
}


def peer_parameters():
    """Names of all parameters of the peer's nodes with one input of each kind, but for the topics."""
    return FILTER + [
        f'{each}0_{option}'
        for each, options in INPUTS.items()
        for option in ('config', 'queue_size', 'nodelay', *options)
    ]


@pytest.mark.parametrize('kind', ['ekf', 'ukf'])
def test_nonsense_in_any_parameter_of_the_peer_is_refused_by_name(kind):
    params = {name: [None] for name in peer_parameters()}
    params.update({each + '0': each for each in INPUTS}, use_control=True)
    findings = found(params, kind)
    told = ' '.join(f.sentence for f in findings if f.level == ERROR)
    # These take any value, and have no effect that could go wrong; use_control holds a value here.
    free = {each + '0_nodelay' for each in INPUTS} | {'use_control'}
    assert {name for name in peer_parameters() if name not in told} <= free
    assert all(f.level == ERROR for f in findings)


@pytest.mark.parametrize('kind', ['ekf', 'ukf'])
def test_no_parameter_of_the_peer_is_taken_for_a_misspelt_one(kind):
    params = dict.fromkeys(peer_parameters(), False)
    params.update({each + '0': each for each in INPUTS})
    params.update(
        {
            each + '0_config': mask(*used)
            for each, used in dict(odom=[6, 7], pose=[0, 1], twist=[11], imu=[5, 11]).items()
        }
    )
    for name in peer_parameters():
        if name.endswith('_threshold') or name in (
            'frequency',
            'sensor_timeout',
            'history_length',
            'transform_time_offset',
            'alpha',
            'transform_timeout',
            'gravitational_acceleration',
            'control_timeout',
            'kappa',
            'beta',
        ):
            params[name] = 0.1 if name == 'control_timeout' else 5.0 if name != 'transform_timeout' else 0.01
        elif name.endswith('_queue_size'):
            params[name] = 10
        elif name.endswith(('_frame', '_frame_output')) and 'child' not in name:
            params[name] = {'map_frame': 'map', 'base_link_frame': 'base', 'base_link_frame_output': 'base_out'}.get(
                name, 'odom'
            )
        elif name.endswith(('_limits', '_gains')):
            params[name] = [1.0] * 6
        elif name.endswith('_covariance') and name != 'dynamic_process_noise_covariance':
            params[name] = [0.1] * 15
    params.update(
        initial_state=[0.0] * 15,
        two_d_mode=True,
        use_control=True,
        control_config=[True] + [False] * 5,
        tf_prefix='robot',
        debug_out_file='trace.txt',
        smooth_lagged_data=True,
        print_diagnostics=True,
    )
    config, findings = check_config.check(params, kind)
    assert config is not None, findings
    assert not [f for f in findings if 'is no parameter' in f.sentence or 'ignored' in f.sentence], findings
    assert config.world_frame == 'robot/odom' and config.control.mask[0] and config.input('imu0').twist_threshold == 5.0
