"""check_config on two filters and navsat_transform_node in one file: what users of such set-ups get wrong."""

import copy
from pathlib import Path

import pytest
import yaml

from sara_common.diagnostics import ERROR, OK, WARN
from sara_localization.checks.node_set import check_set, is_set

OURS = yaml.safe_load((Path(__file__).resolve().parents[3] / 'sara_bringup' / 'config' / 'outdoors.yaml').read_text())
ODOM, MAP, NAVSAT = 'ekf_se_odom', 'ekf_se_map', 'navsat_transform_node'


def changed(node, remove=(), **values):
    """Our file with something else in it."""
    tree = copy.deepcopy(OURS)
    tree[node].update(values)
    for name in remove:
        del tree[node][name]
    return tree


def test_nothing_is_wrong_with_ours():
    assert is_set(OURS) and check_set(OURS) == []


def test_one_node_s_parameters_are_no_set():
    assert not is_set(OURS[MAP]) and not is_set({MAP: OURS[MAP]})


@pytest.mark.parametrize(
    ('tree', 'level', 'words'),
    [
        (changed(ODOM, world_frame='map'), ERROR, 'both have world_frame: map and publish map -> odom'),
        (changed(ODOM, world_frame='map'), ERROR, 'nobody publishes odom -> base_link'),
        (changed(MAP, world_frame='odom'), ERROR, 'ekf_se_map takes odometry/gps and has world_frame: odom'),
        (changed(ODOM, odom1='odometry/gps', odom1_config=[True] * 2 + [False] * 13), ERROR, 'ekf_se_odom takes'),
        (changed(MAP, odom1='odometry/gps', odom1_differential=True), ERROR, 'ekf_se_map: odom1_differential is true'),
        (changed(MAP, ('odom1',)), ERROR, 'no filter takes odometry/gps'),
        (changed(MAP, odom0='/odometry/local'), WARN, 'odom0 of ekf_se_map is /odometry/local, the output of a filter'),
        (changed(MAP, base_link_frame='base_footprint'), ERROR, 'base_link_frame is base_link in ekf_se_odom and'),
        (changed(ODOM, two_d_mode=False), WARN, 'two_d_mode is true in ekf_se_map alone'),
        (changed(MAP, publish_tf=False), WARN, 'does another node publish map -> odom?'),
        (changed(MAP, ('odom1_pose_rejection_threshold',)), OK, 'ekf_se_map: odom1 has no gate'),
        (changed(MAP, ('odom1_pose_correlation_time',)), OK, 'odom1_pose_correlation_time is not given'),
        (changed(NAVSAT, ('datum',), wait_for_datum=False, magnetic_declination_radians=0.0), OK, 'true north'),
        (changed(NAVSAT, wait_for_datum=False), WARN, 'datum has no effect without wait_for_datum'),
        (changed(NAVSAT, yaw_offset=90.0), WARN, 'yaw_offset is 90: it counts in radians'),
        (changed(MAP, ('imu1_orientation_correlation_time',)), WARN, '2 inputs measure yaw itself (imu0, imu1)'),
        (changed(NAVSAT, velocity_heading=False), ERROR, 'imu1 of ekf_se_map is gps/heading, which'),
        (changed(MAP, ('imu1',)), WARN, 'gives gps/heading (velocity_heading), and no filter takes it'),
        (changed(MAP, odom0_config=[1, 2]), ERROR, 'ekf_se_map: odom0_config'),
    ],
)
def test_mistakes_are_found(tree, level, words):
    found = [finding for finding in check_set(tree) if words in finding.sentence]
    assert [finding.level for finding in found] == [level], check_set(tree)


def test_the_odometry_s_yaw_must_be_measured():
    tree = changed(NAVSAT, ('datum', 'wait_for_datum'), use_odometry_yaw=True)
    assert check_set(tree) == []
    tree[MAP]['imu0_differential'] = True
    assert any('which no input measures against north' in finding.sentence for finding in check_set(tree))


def test_other_nodes_are_passed_over():
    assert check_set({**OURS, 'nmea_serial_driver': {'port': '/dev/ttyUSB0'}}) == []
