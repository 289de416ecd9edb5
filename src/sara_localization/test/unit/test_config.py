"""Reading robot_localization's parameters, and saying what is wrong with them."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from sara_common.config import ConfigError
from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.state import VX, VYAW, YAW

VX_ONLY = [i == VX for i in range(15)]
LEAST = {'odom0': '/odom', 'odom0_config': VX_ONLY}
CONFIG = Path(__file__).resolve().parents[2] / 'config'


def read(**params):
    return FilterConfig.from_params({**LEAST, **params})


def faults(**params):
    with pytest.raises(ConfigError) as caught:
        read(**params)
    return caught.value.faults


def test_defaults_are_the_peers():
    config = read()
    assert (config.frequency, config.world_frame, config.two_d_mode) == (30.0, 'odom', False)
    assert config.sensor_timeout == pytest.approx(1 / 30)
    assert config.process_noise_covariance[5, 5] == 0.06
    assert config.initial_estimate_covariance[0, 0] == 1e-9
    assert config.warnings == ()


def test_numbers_written_as_strings_are_numbers():
    diagonal = ['1e-9'] * 15
    full = np.diag([1e-9] * 15).ravel().tolist()
    for value in (diagonal, full):
        np.testing.assert_array_equal(
            read(initial_estimate_covariance=value).initial_estimate_covariance, np.eye(15) * 1e-9
        )


@pytest.mark.parametrize(
    'name, value',
    [
        ('frequency', 0),
        ('frequency', 'fast'),
        ('two_d_mode', 'perhaps'),
        ('odom0_config', [True] * 12),
        ('initial_state', [0, 0, 0]),
        ('process_noise_covariance', [1.0] * 36),
        ('process_noise_covariance', [-1.0] * 15),
        ('world_frame', 'earth'),
        ('odom_frame', 'map'),
        ('odom0_queue_size', 'many'),
        ('sensor_timeout', float('nan')),
        ('odom0', ''),
    ],
)
def test_a_fault_names_its_parameter(name, value):
    assert any(name in fault for fault in faults(**{name: value}))


def test_all_faults_are_told_at_once():
    assert len(faults(frequency=-1, two_d_mode=3, initial_state=[1])) == 3


def test_what_is_off_may_be_set_to_its_default():
    assert read(odom0_differential=False, smooth_lagged_data=False, use_control=False, history_length=0).warnings == ()


@pytest.mark.parametrize(
    'name, hint', [('frequencey', 'frequency'), ('odom2', 'without a gap'), ('imu0_config', 'no imu0')]
)
def test_what_is_ignored_is_told(name, hint):
    (warning,) = read(**{name: True}).warnings
    assert name in warning and hint in warning


def test_no_input_is_a_fault():
    with pytest.raises(ConfigError, match='no input'):
        FilterConfig.from_params({'frequency': 50})


@pytest.mark.parametrize('name, taken', [('default', {VX}), ('thesis', {0, 1, VX})])
def test_the_sets_shipped_are_sound(name, taken):
    config = FilterConfig.from_params(yaml.safe_load((CONFIG / (f'ekf_{name}.yaml')).read_text()))
    assert config.warnings == ()
    assert {i for i, used in enumerate(config.input('odom0').mask) if used} == taken
    assert {i for i, used in enumerate(config.input('imu0').mask) if used} == {YAW, VYAW}
    assert config.two_d_mode and config.publishes_map_to_odom and config.frequency == 50.0


SIX = [True, False, False, False, False, True]


def test_control_is_read_with_its_defaults():
    control = read(
        use_control=True,
        control_config=SIX,
        acceleration_limits=[2] * 6,
        deceleration_gains=[3.0] * 6,
        sensor_timeout=0.4,
    ).control
    assert control.mask == tuple(SIX) and control.timeout == 0.4 and not control.stamped
    assert control.acceleration_limits == control.deceleration_limits == (2.0,) * 6
    assert control.acceleration_gains == (1.0,) * 6 and control.deceleration_gains == (3.0,) * 6
    assert read().control is None


@pytest.mark.parametrize(
    'name, value',
    [
        ('control_config', None),
        ('control_config', [True] * 5),
        ('acceleration_limits', [1.0] * 5),
        ('deceleration_gains', [-1.0] * 6),
        ('control_timeout', -1.0),
    ],
)
def test_a_fault_of_the_control_is_named(name, value):
    params = {'use_control': True, 'control_config': SIX, name: value}
    assert any(name in fault for fault in faults(**{k: v for k, v in params.items() if v is not None}))


def test_an_axis_whose_acceleration_is_measured_is_not_controlled_and_that_is_told():
    config = read(use_control=True, control_config=SIX, imu0='/imu', imu0_config=[i == 12 for i in range(15)])
    assert config.control.mask == (False,) * 5 + (True,)
    assert any('control_config' in w and 'imu0 measures ax' in w for w in config.warnings)


def test_tf_prefix_goes_before_every_frame():
    config = read(tf_prefix='/sara', world_frame='map', map_frame='/map')
    assert (config.map_frame, config.world_frame, config.base_link_frame_output) == (
        'sara/map',
        'sara/map',
        'sara/base_link',
    )


@pytest.mark.parametrize(
    'params, words',
    [
        (dict(odom0_differential=True, odom0_relative=True), ('odom0_relative', 'no effect')),
        (dict(odom0_relative=True), ('odom0_relative', 'no effect')),
        (dict(smooth_lagged_data=True), ('history_length', '0')),
        (dict(history_length=2.0), ('smooth_lagged_data', 'off')),
        (dict(control_timeout=1.0), ('use_control', 'off')),
        (
            dict(imu0='/imu', imu0_config=[i == 5 for i in range(15)], imu0_gyro_bias='state'),
            ('imu0_gyro_bias', 'no effect'),
        ),
    ],
)
def test_what_has_no_effect_is_told_with_its_reason(params, words):
    assert any(all(word in warning for word in words) for warning in read(**params).warnings)


def test_history_length_counts_by_its_size():
    assert read(smooth_lagged_data=True, history_length=-2.0).history_length == 2.0


@pytest.mark.parametrize(
    'name, value',
    [
        ('odom0_twist_covariance', [0.0] * 6),
        ('odom0_pose_covariance', [1.0] * 5),
        ('odom0_turning_noise', [1.0, -1.0, 0.0]),
        ('imu0_gyro_bias', 'sometimes'),
        ('imu0_gyro_bias_variance', 0.0),
        ('standstill_time', 0.0),
        ('alpha', 0.0),
        ('kappa', -1.0),
    ],
)
def test_a_fault_of_an_extension_is_named(name, value):
    imu = dict(imu0='/imu', imu0_config=[i == 11 for i in range(15)]) if name.startswith('imu') else {}
    assert any(name in fault for fault in faults(**imu, **{name: value}))


def test_extensions_are_off_by_default_and_yamls_off_is_off():
    config = read(imu0='/imu', imu0_config=[i == 11 for i in range(15)], imu0_gyro_bias=False)
    assert not config.standstill.update and config.warnings == ()
    assert all(i.gyro_bias == 'off' and not i.covariances and i.turning_noise == (0.0,) * 3 for i in config.inputs)


def test_the_filter_is_one_of_two():
    assert FilterConfig.from_params({'odom0': '/o', 'odom0_config': [True] * 15, 'alpha': 0.5}, 'ukf').alpha == 0.5
    with pytest.raises(ConfigError, match='ekf, ukf'):
        FilterConfig.from_params({}, 'pf')


def test_what_is_doubtful_is_told_beside_the_faults():
    """A misspelt name leaves a fault and a warning: only the two together show what happened."""
    from sara_localization.checks import check_config
    from sara_localization.checks.findings import sorted_findings

    params = {'odom0': '/odom', 'odom0_confg': [True] * 15, 'twist0': '/t', 'twist0_config': [True] * 15}
    with pytest.raises(ConfigError) as caught:
        FilterConfig.from_params(params)
    assert len(caught.value.faults) == 1 and 'odom0_config is missing' in caught.value.faults[0]
    assert any('is odom0_config meant?' in warning for warning in caught.value.warnings)
    config, findings = check_config.check(params)
    assert config is None
    assert [f.level for f in sorted_findings(findings)] == [2, 1, 1]


def test_a_list_that_is_missing_gives_no_false_warnings():
    with pytest.raises(ConfigError) as caught:
        FilterConfig.from_params({'imu0': '/imu', 'imu0_gyro_bias': 'state', 'imu0_differential': True})
    assert caught.value.warnings == () and len(caught.value.faults) == 1
