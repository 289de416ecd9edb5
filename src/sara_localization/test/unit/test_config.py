"""Reading robot_localization's parameters, and saying what is wrong with them."""
from pathlib import Path

import numpy as np
import pytest
import yaml

from sara_localization.config import ConfigError, FilterConfig
from sara_localization.state import VX, VYAW, YAW

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
        np.testing.assert_array_equal(read(initial_estimate_covariance=value).initial_estimate_covariance, np.eye(15) * 1e-9)


@pytest.mark.parametrize('name, value', [
    ('frequency', 0), ('frequency', 'fast'), ('two_d_mode', 'perhaps'), ('odom0_config', [True] * 12),
    ('initial_state', [0, 0, 0]), ('process_noise_covariance', [1.0] * 36), ('process_noise_covariance', [-1.0] * 15),
    ('world_frame', 'earth'), ('odom_frame', 'map'), ('odom0_queue_size', 'many'), ('sensor_timeout', float('nan')),
    ('odom0', '')])
def test_a_fault_names_its_parameter(name, value):
    assert any(name in fault for fault in faults(**{name: value}))


def test_all_faults_are_told_at_once():
    assert len(faults(frequency=-1, two_d_mode=3, initial_state=[1])) == 3


def test_what_is_off_may_be_set_to_its_default():
    assert read(odom0_differential=False, smooth_lagged_data=False, use_control=False, history_length=0).warnings == ()


@pytest.mark.parametrize('name, hint', [('frequencey', 'frequency'), ('odom2', 'without a gap'),
                                        ('imu0_config', 'no imu0'), ('debug', 'no effect')])
def test_what_is_ignored_is_told(name, hint):
    (warning,) = read(**{name: True}).warnings
    assert name in warning and hint in warning


def test_no_input_is_a_fault():
    with pytest.raises(ConfigError, match='no input'):
        FilterConfig.from_params({'frequency': 50})


@pytest.mark.parametrize('name, taken', [('default', {VX}), ('thesis', {0, 1, VX})])
def test_the_sets_shipped_are_sound(name, taken):
    config = FilterConfig.from_params(yaml.safe_load((CONFIG / ('ekf_%s.yaml' % name)).read_text()))
    assert config.warnings == ()
    assert {i for i, used in enumerate(config.input('odom0').mask) if used} == taken
    assert {i for i, used in enumerate(config.input('imu0').mask) if used} == {YAW, VYAW}
    assert config.two_d_mode and config.publishes_map_to_odom and config.frequency == 50.0
