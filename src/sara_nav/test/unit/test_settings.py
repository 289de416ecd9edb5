"""Parameters: the shipped configuration, the peers' forms of it, and that nothing is ignored in silence."""

import dataclasses
import math
import re

import numpy as np
import pytest
import yaml

from sara_common.config import ConfigError
from sara_common.platforms import load, parameters
from sara_nav.config.parameters import Parameters
from sara_nav.goals.move_base_config import MoveBaseConfig
from sara_nav.move_base.settings import read_settings
from sara_nav.recovery.behaviours import RotateRecoveryConfig

SHIPPED = parameters('sara_nav', 'sara_nav.yaml', load('sara'))


def read(tree, **above):
    return read_settings(Parameters(tree, above))


def config_of(settings, name, where='global_costmap'):
    """Return the configuration of the layer of that name."""
    return next(config for layer, _, config in getattr(settings, where).layers if layer == name)


def test_the_shipped_configuration_is_sound_and_complete():
    tree = SHIPPED
    settings = read(tree)
    assert settings.warnings == ()
    for where in ('global_costmap', 'local_costmap'):
        assert getattr(settings, where).footprint.max(axis=0) == pytest.approx([0.55, 0.30])
        assert config_of(settings, 'inflation_layer', where).inflation_radius == 0.75
    topics = config_of(settings, 'ultrasonic', 'local_costmap').topics  # as in the thesis, not in the global one
    assert len(topics) == 8 and '/SJO_range' not in topics
    assert settings.move_base.transform_tolerance == 0.5
    for name, planner in (('LatticePlanner', settings.global_planner), ('RotateThenPursue', settings.local_planner)):
        assert set(tree[name]) == {field.name for field in dataclasses.fields(planner.config)}
        assert all(tree[name][k] == getattr(planner.config, k) for k in tree[name])


def test_nobody_spins_who_carries_somebody():
    settings = read(SHIPPED)
    behaviours = settings.recoveries.make(settings.move_base)
    assert [(b.name, b.plugin_name.split('/')[1]) for b in behaviours] == [
        ('clear_far', 'ClearCostmapRecovery'),
        ('back_out', 'BackOutRecovery'),
        ('back_out_again', 'BackOutRecovery'),
        ('ask_for_help', 'AskForHelp'),
        ('back_out_and_forget', 'BackOutRecovery'),
    ]
    assert (
        settings.move_base.stuck_timeout > 0.0
        and settings.move_base.recovery_memory > 0.0
        and settings.move_base.replan_when_blocked
    )
    machine = settings.make_move_base()
    far = behaviours[0]
    assert far.layers(machine.local_costmap) == far.layers(machine.global_costmap) == ['ultrasonic']
    assert [b.config.forget for b in behaviours if hasattr(b.config, 'forget')] == [False, False, True]


def test_no_parameters_give_the_peers_defaults():
    settings = read({})
    assert settings.warnings == ()
    assert settings.move_base == MoveBaseConfig(transform_tolerance=0.3)
    assert (settings.move_base.controller_patience, settings.move_base.clearing_radius) == (15.0, 0.46)
    assert config_of(settings, 'inflation_layer').inflation_radius == 0.55
    assert np.hypot(*settings.global_costmap.footprint.T).max() == pytest.approx(0.47, abs=0.01)
    assert settings.global_frame == settings.local_frame == 'map' and settings.robot_base_frame == 'base_link'
    behaviours = settings.recoveries.make(settings.move_base)
    assert [b.name for b in behaviours] == [
        'conservative_reset',
        'rotate_recovery',
        'aggressive_reset',
        'rotate_recovery',
    ]
    assert behaviours[0].config.reset_distance == 3.0 and behaviours[2].config.reset_distance == pytest.approx(1.84)
    assert behaviours[1].config == RotateRecoveryConfig()


def test_layers_by_name_and_parameters_in_the_old_place():
    old = read({'global_costmap': {'inflation_radius': 0.8, 'cost_scaling_factor': 3, 'robot_radius': 0.3}})
    halo = config_of(old, 'inflation_layer')
    assert (halo.inflation_radius, halo.cost_scaling_factor) == (0.8, 3.0)
    new = read(
        {
            'global_costmap': {
                'robot_radius': 0.3,
                'inflation_radius': 0.8,
                'halo': {'inflation_radius': 0.9},
                'plugins': [
                    {'name': 'sonar', 'type': 'range_sensor_layer::RangeSensorLayer'},
                    {'name': 'halo', 'type': 'costmap_2d::InflationLayer'},
                ],
            }
        }
    )
    assert config_of(new, 'halo').inflation_radius == 0.9
    assert [name for name, _, _ in new.global_costmap.layers] == ['sonar', 'halo']


def test_a_footprint_is_searched_upward_and_the_nearer_wins():
    square = '[[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]]'
    for settings in (read({}, footprint=square), read({'footprint': square})):
        assert settings.global_costmap.footprint.max() == settings.local_costmap.footprint.max() == pytest.approx(0.21)
    settings = read({'global_costmap': {'robot_radius': 0.4}}, footprint=square)
    assert len(settings.global_costmap.footprint) == 16 and len(settings.local_costmap.footprint) == 4
    assert len(read({}, robot_radius=0.4).local_costmap.footprint) == 16


def test_all_faults_are_said_at_once():
    with pytest.raises(ConfigError) as error:
        read(
            {
                'controller_frequency': 'fast',
                'planner_patience': -3,
                'base_local_planner': 'teb/Teb',
                'base_global_planner': 'sara_nav/GridPlanner',
                'GridPlanner': {'straighten_slack': 7.0},
                'recovery_behaviors': [
                    {'name': 'slow', 'type': 'move_slow_and_clear/MoveSlowAndClear'},
                    {'name': 'a', 'type': 'clear_costmap_recovery/ClearCostmapRecovery'},
                    {'name': 'a', 'type': 'rotate_recovery/RotateRecovery'},
                    'spin',
                    {'name': 'b'},
                ],
                'a': {'reset_distance': -1.0},
                'local_costmap': {'map_type': 'voxel'},
                'global_costmap': {'footprint': 'round', 'inflation_layer': {'inflation_radius': -1.0}},
            }
        )
    for text in (
        "controller_frequency is 'fast', allowed is a number",
        'planner_patience is -3',
        "'teb/Teb'",
        'straighten_slack is 7',
        "footprint is 'round'",
        'inflation_radius is -1',
        'max_vel_x to be slow',
        'two behaviours called a',
        "holds 'spin'",
        "holds {'name': 'b'}",
        'a/reset_distance is -1',
        "'voxel'",
    ):
        assert text in str(error.value)


@pytest.mark.parametrize('value', [math.inf, math.nan, 2.5])
def test_what_is_no_whole_number_is_a_fault(value):
    with pytest.raises(ConfigError, match='max_planning_retries is .*, allowed is a whole number'):
        read({'max_planning_retries': value})


@pytest.mark.parametrize(
    'tree, text',
    [
        ({'RotateThenPursue': {'max_vel_x': 0.3}}, r'RotateThenPursue/ \(max_vel_x\) have no effect'),
        (
            {'DWAPlannerROS': {'sim_time': 4.0, 'vx_samples': 5}},
            r'DWAPlannerROS/ \(sim_time, vx_samples\) have no effect',
        ),
        ({'conservative_reset': {'reset_distance': 5.0}}, 'conservative_reset/reset_distance has no effect'),
        ({'rotate_recovery': {'frequency': 5.0}}, 'rotate_recovery/frequency has no effect'),
        ({'recovery_behaviors': [], 'rotate_recovery': {'sim_granularity': 0.1}}, 'rotate_recovery/ have no effect'),
        (
            {'recovery_behaviors': [{'name': 'turn', 'type': 'RotateRecovery'}]},
            'should be called rotate_recovery/RotateRecovery',
        ),
        (
            {
                'recovery_behaviors': [{'name': 'clear', 'type': 'clear_costmap_recovery/ClearCostmapRecovery'}],
                'clear': {'layer_names': ['obstacles']},
            },
            "clear/layer_names holds 'obstacles' but no affected costmap has that layer",
        ),
        ({'global_costmap': {'z_voxels': 4}}, 'z_voxels has no effect: it belongs to the voxel layer'),
        ({'restore_defaults': True}, 'restore_defaults has no effect'),
        ({'local_costmap': {'transform_tolerance': 5.0}}, 'local_costmap/transform_tolerance has no effect: it is 0.3'),
        ({'local_costmap': {'robot_base_frame': 'body'}}, 'local_costmap/robot_base_frame has no effect: it is base_'),
        (
            {'global_costmap': {'plugins': [{'name': 'slow', 'type': 'sara_nav/SpeedFilter'}]}},
            'global_costmap/slow: sara_nav/SpeedFilter has no effect there: put it into local_costmap/plugins',
        ),
        ({'TrajectoryPlannerROS': {'point_grid': {'grid_resolution': 0.2}}}, 'point_grid/ has no effect'),
        (
            {'base_local_planner': 'dwa_local_planner/DWAPlannerROS', 'DWAPlannerROS': {'global_frame_id': 'odom'}},
            'DWAPlannerROS/global_frame_id has no effect',
        ),
        ({'controler_frequency': 10.0}, 'controler_frequency is not known .* controller_frequency meant'),
    ],
)
def test_what_has_no_effect_is_said(tree, text):
    warnings = read(tree).warnings
    assert len(warnings) >= 1 and any(re.search(text, w) for w in warnings), warnings


@pytest.mark.parametrize(
    'tree',
    [
        {'oscillation_timeout': 10.0},
        {'recovery_behaviors': []},
        {'shutdown_costmaps': True},
        {'global_costmap': {'rolling_window': True}},
        {'max_planning_retries': 3},
        {'local_costmap': {'inscribed_radius': 0.3}},
        {'restore_defaults': False, 'global_costmap': {'restore_defaults': False}},
    ],
)
def test_what_has_an_effect_is_not_warned_of(tree):
    assert read(tree).warnings == ()


def test_a_turn_takes_its_limits_from_itself_then_the_classic_planner_then_the_one_that_drives():
    tree = {
        'base_local_planner': 'sara_nav/RotateThenPursue',
        'RotateThenPursue': {'max_vel_theta': 0.3, 'acc_lim_theta': 0.2},
        'TrajectoryPlannerROS': {'acc_lim_th': 0.5},
        'rotate_recovery': {'yaw_goal_tolerance': 0.2},
    }
    config = read(tree).recoveries.defaults['rotate_recovery']
    assert (config.max_vel_theta, config.acc_lim_theta, config.yaw_goal_tolerance) == (0.3, 0.5, 0.2)


def test_an_inflation_narrower_than_the_robot_is_warned_of():
    warnings = read({'global_costmap': {'robot_radius': 0.4, 'inflation_radius': 0.2}}).warnings
    assert any('inflation_radius' in w for w in warnings)


# A configuration as users of the C++ stack write it: pre-Hydro global costmap, rolling local one in odom, a scanner,
# the trajectory planner, the default recoveries. It has to load as it is.
PEERS = """
controller_frequency: 10.0
planner_frequency: 1.0
oscillation_timeout: 10.0
base_global_planner: navfn/NavfnROS
base_local_planner: base_local_planner/TrajectoryPlannerROS
footprint: [[-0.3, -0.25], [-0.3, 0.25], [0.3, 0.25], [0.3, -0.25]]
global_costmap:
  global_frame: /map
  robot_base_frame: base_link
  update_frequency: 5.0
  static_map: true
  obstacle_range: 2.5
  raytrace_range: 3.0
  inflation_radius: 0.55
  observation_sources: laser_scan_sensor
  laser_scan_sensor: {sensor_frame: laser, data_type: LaserScan, topic: scan, marking: true, clearing: true}
local_costmap:
  global_frame: odom
  robot_base_frame: base_link
  rolling_window: true
  width: 6.0
  height: 6.0
  resolution: 0.05
  static_map: false
  plugins:
    - {name: ultrasonic, type: "range_sensor_layer::RangeSensorLayer"}
    - {name: inflation_layer, type: "costmap_2d::InflationLayer"}
  ultrasonic: {topics: ["/SDI_range"], no_readings_timeout: 1.0, clear_threshold: 0.46, mark_threshold: 0.98}
TrajectoryPlannerROS:
  max_vel_x: 0.45
  min_vel_x: 0.1
  max_rotational_vel: 1.0
  min_in_place_rotational_vel: 0.4
  acc_lim_th: 3.2
  acc_lim_x: 2.5
  acc_lim_y: 2.5
  pdist_scale: 0.8
  y_vels: [-0.3, -0.1, 0.1, 0.3]
  holonomic_robot: false
NavfnROS: {allow_unknown: true, default_tolerance: 0.2, planner_window_x: 0.0}
"""


def test_a_configuration_of_the_peers_loads_as_it_is():
    settings = read(yaml.safe_load(PEERS))
    assert (
        settings.global_planner.plugin_name == 'navfn/NavfnROS'
        and settings.global_planner.config.default_tolerance == 0.2
    )
    config = settings.local_planner.config
    assert (config.max_vel_theta, config.path_distance_bias, config.controller_frequency) == (1.0, 0.8, 10.0)
    assert (settings.global_frame, settings.local_frame) == ('map', 'odom')
    source = config_of(settings, 'obstacle_layer').sources[0]
    assert (source.topic, source.clearing, source.raytrace_range) == ('scan', True, 3.0)
    machine = settings.make_move_base()
    assert [r.name for r in machine.recoveries] == [
        'conservative_reset',
        'rotate_recovery',
        'aggressive_reset',
        'rotate_recovery',
    ]
    # Old names are said, and static_map beside plugins; nothing else is there to say.
    assert all('should be called' in w or 'static_map has no effect: plugins is given' in w for w in settings.warnings)
    assert len(settings.warnings) == 5


@pytest.mark.parametrize(
    'tree, path, said',
    [
        ({'NavfnROS': {'planner_window_x': 5.0}}, 'NavfnROS/planner_window_x', 'the whole map is planned on'),
        (
            {'TrajectoryPlannerROS': {'stop_time_buffer': 0.5}},
            'TrajectoryPlannerROS/stop_time_buffer',
            'as in the C++ planner',
        ),
        (
            {'base_local_planner': 'dwa_local_planner/DWAPlannerROS', 'DWAPlannerROS': {'acc_lim_trans': 1.0}},
            'DWAPlannerROS/acc_lim_trans',
            'as in the C++ planner',
        ),
    ],
)
def test_what_has_no_effect_in_a_planner_is_said(tree, path, said):
    warnings = [text for text in read_settings(Parameters(tree)).warnings if path in text]
    assert len(warnings) == 1 and said in warnings[0]


def test_defaults_that_have_no_effect_are_not_worth_a_word():
    assert not [
        text
        for text in read_settings(Parameters({'TrajectoryPlannerROS': {'stop_time_buffer': 0.2}})).warnings
        if 'stop_time' in text
    ]


def test_the_old_limit_of_turns_holds_both_ways():
    config = read_settings(Parameters({'TrajectoryPlannerROS': {'max_rotational_vel': 0.5}})).local_planner.config
    assert (config.min_vel_theta, config.max_vel_theta) == (-0.5, 0.5)
    config = read_settings(
        Parameters({'TrajectoryPlannerROS': {'max_rotational_vel': 0.5, 'min_vel_theta': -0.3}})
    ).local_planner.config
    assert (config.min_vel_theta, config.max_vel_theta) == (-0.3, 0.5)


def test_the_defaults_of_a_planner_that_does_not_drive_need_no_words():
    assert read({'GridPlanner': {'path_spacing': 0.05}}).warnings == ()
    assert 'GridPlanner/ (path_spacing) have no effect' in read({'GridPlanner': {'path_spacing': 0.1}}).warnings[0]
