"""navsat_transform_node's parameters, config/navsat.yaml, and check_config on them and on filters with odometry/gps."""

from pathlib import Path

import pytest
import yaml

from sara_common.config import ConfigError
from sara_common.diagnostics import ERROR, OK, WARN
from sara_localization.checks.check_config import check
from sara_localization.checks.navsat_settings import check_navsat, is_for_navsat
from sara_localization.gps.navsat_config import NavSatConfig

PACKAGE = Path(__file__).resolve().parents[2]
TEXT = (PACKAGE / 'config' / 'navsat.yaml').read_text()
OURS = yaml.safe_load(TEXT)


def test_the_file_of_all_parameters_holds_their_defaults_and_nothing_is_wrong_with_it():
    assert NavSatConfig.from_params(OURS) == NavSatConfig() and check_navsat(OURS) == [] and is_for_navsat(OURS)
    missing = [name for name in NavSatConfig.__dataclass_fields__ if f'{name}:' not in TEXT]
    assert missing == ['warnings']


@pytest.mark.parametrize('name', ['ekf_default.yaml', 'ekf_thesis.yaml', 'amcl.yaml'])
def test_another_node_s_file_is_not_taken_for_one(name):
    assert not is_for_navsat(yaml.safe_load((PACKAGE / 'config' / name).read_text()))


def test_names_and_defaults_of_the_cpp_node():
    config = NavSatConfig.from_params(
        {
            'broadcast_utm_transform': True,
            'broadcast_utm_transform_as_parent_frame': 'true',
            'use_local_cartesian': 1,
            'datum': [55.944904, '-3.186693', 0.0, 'map', 'base_link'],
            'wait_for_datum': True,
            'frequency': '30',
        }
    )
    assert config.broadcast_cartesian_transform and config.broadcast_cartesian_transform_as_parent_frame
    assert config.cartesian_frame_id == 'local_enu' and config.datum == (55.944904, -3.186693, 0.0)
    assert config.frequency == 30.0 and len(config.warnings) == 3


@pytest.mark.parametrize(
    'params, hint',
    [
        ({'use_manual_datum': True}, 'wait_for_datum'),
        ({'force_user_utm': True}, 'setUTMZone'),
        ({'tf_prefix': 'a'}, 'frames are those of the messages'),
        ({'yaw_ofset': 1.0}, 'ignored'),
    ],
)
def test_a_name_that_is_none_is_told_with_what_would_do(params, hint):
    (said,) = NavSatConfig.from_params(params).warnings
    assert hint in said


@pytest.mark.parametrize(
    'params',
    [
        {'frequency': 0.0},
        {'frequency': float('nan')},
        {'delay': -1.0},
        {'yaw_offset': 'north'},
        {'magnetic_declination_radians': [1.0]},
        {'zero_altitude': 2},
        {'datum': [1.0, 2.0]},
        {'datum': [91.0, 0.0, 0.0]},
        {'datum': [85.0, 0.0, 0.0]},
        {'datum': [1.0, 0.0, float('inf')]},
        {'datum': 'here'},
        {'cartesian_frame_id': ''},
        {'assumed_sigma': 0.0},
    ],
)
def test_what_cannot_work_is_refused_in_words(params):
    with pytest.raises(ConfigError) as refused:
        NavSatConfig.from_params(params)
    assert len(refused.value.faults) == 1 and next(iter(params)) in refused.value.faults[0]
    assert [finding.level for finding in check_navsat(params)] == [ERROR]


@pytest.mark.parametrize(
    'params, key',
    [
        ({'magnetic_declination_radians': 2.5}, 'magnetic_declination_radians'),
        ({'yaw_offset': 90.0}, 'yaw_offset'),
        ({'yaw_offset': 0.7}, 'yaw_offset'),
        ({'datum': [1.0, 2.0, 0.0]}, 'datum'),
        ({'datum': [1.0, 2.0, 0.0], 'wait_for_datum': True, 'magnetic_declination_radians': 0.1}, 'datum'),
        ({'broadcast_cartesian_transform_as_parent_frame': True}, 'broadcast_cartesian_transform'),
        ({'use_odometry_yaw': True, 'wait_for_datum': True}, 'use_odometry_yaw'),
        ({'transform_timeout': 2.0}, 'transform_timeout'),
    ],
)
def test_what_is_probably_not_meant_is_told_in_one_sentence(params, key):
    (finding,) = check_navsat({**OURS, **params})
    assert (finding.level, finding.key) == (WARN, key) and finding.sentence.endswith('.')


@pytest.mark.parametrize('offset', [1.5707963, -1.57, 3.1416, 0.1])
def test_usual_yaw_offsets_are_right(offset):
    assert check_navsat({'yaw_offset': offset}) == []


def filter_with_gps(**changes):
    flags = lambda *used: [k in used for k in range(15)]
    params = {
        'frequency': 30,
        'two_d_mode': True,
        'world_frame': 'odom',
        'odom0': '/odom',
        'odom0_config': flags(6, 7, 11),
        'odom1': '/odometry/gps',
        'odom1_config': flags(0, 1),
        'imu0': '/imu/data',
        'imu0_config': flags(5, 11),
    }
    return check({**params, **{k: flags(*v) if k.endswith('_config') else v for k, v in changes.items()}})[1]


def test_a_filter_that_takes_odometry_gps_as_it_should_is_left_alone():
    assert [finding for finding in filter_with_gps() if finding.level] == []


def test_a_gate_and_a_correlation_time_are_suggested():
    gate, correlation = filter_with_gps()
    assert gate.level == correlation.level == OK
    assert 'odom1_pose_rejection_threshold' in gate.sentence and 'odom1_pose_correlation_time' in correlation.sentence
    assert filter_with_gps(odom1_pose_rejection_threshold=3.5, odom1_pose_correlation_time=60.0) == []


@pytest.mark.parametrize(
    'changes, level, key, words',
    [
        ({'odom1_differential': True}, ERROR, 'odom1_configuration', 'odom1_differential is true'),
        ({'odom1_relative': True}, ERROR, 'odom1_configuration', 'odom1_relative is true'),
        ({'odom1_config': (0,)}, ERROR, 'odom1_configuration', 'x and y are not both used'),
        ({'odom1_config': (0, 1, 5)}, ERROR, 'odom1_configuration', 'knows nothing of yaw'),
        ({'odom1_config': (0, 1, 6)}, ERROR, 'odom1_configuration', 'knows nothing of vx'),
        ({'imu0_config': (11,)}, WARN, 'initial_estimate_covariance', 'no input measures yaw itself'),
        ({'odom0_config': (11,)}, WARN, 'VX_configuration', 'no input measures vx'),
    ],
)
def test_the_usual_mistakes_with_odometry_gps_are_found(changes, level, key, words):
    found = [finding for finding in filter_with_gps(**changes) if (finding.level, finding.key) == (level, key)]
    assert len(found) == 1 and words in found[0].sentence
