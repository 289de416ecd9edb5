"""Parameters: the shipped configuration, the peers' forms of it, and that nothing is ignored in silence."""
import pathlib
import re

import numpy as np
import pytest
import yaml

from sara_nav.move_base import MoveBaseConfig
from sara_nav.parameters import ParameterError, Parameters
from sara_nav.settings import read_settings

SHIPPED = pathlib.Path(__file__).parents[2] / 'config' / 'sara_nav.yaml'


def read(tree, **found):
    return read_settings(Parameters(tree), **found)


def test_the_shipped_configuration_is_sound_and_complete():
    tree = yaml.safe_load(SHIPPED.read_text())
    settings = read(tree)
    assert settings.warnings == ()
    assert settings.footprint.max(axis=0) == pytest.approx([0.55, 0.30])
    assert settings.inflation.inflation_radius == 0.75 and settings.move_base.transform_tolerance == 0.5
    for name, config in (('GridPlanner', settings.global_planner.config),
                         ('RotateThenPursue', settings.local_planner.config)):
        assert set(tree[name]) == set(config.__dataclass_fields__)
        assert all(tree[name][k] == getattr(config, k) for k in tree[name]), 'the file and the defaults differ'


def test_no_parameters_give_the_peers_defaults():
    settings = read({})
    assert settings.warnings == ()
    assert settings.move_base == MoveBaseConfig(transform_tolerance=0.3)
    assert settings.inflation.inflation_radius == 0.55
    assert np.hypot(*settings.footprint.T).max() == pytest.approx(0.47, abs=0.01)
    assert settings.global_frame == 'map' and settings.robot_base_frame == 'base_link'


def test_layers_by_name_and_parameters_in_the_old_place():
    old = read({'global_costmap': {'inflation_radius': 0.8, 'cost_scaling_factor': 3, 'robot_radius': 0.3}})
    assert (old.inflation.inflation_radius, old.inflation.cost_scaling_factor) == (0.8, 3.0)
    new = read({'global_costmap': {
        'robot_radius': 0.3, 'inflation_radius': 0.8, 'halo': {'inflation_radius': 0.9},
        'plugins': [{'name': 'sonar', 'type': 'range_sensor_layer::RangeSensorLayer'},
                    {'name': 'halo', 'type': 'costmap_2d::InflationLayer'}]}})
    assert new.inflation.inflation_radius == 0.9
    assert any('sonar' in w and 'not built' in w for w in new.warnings)


def test_a_footprint_is_searched_upward_and_the_nearer_wins():
    square = '[[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]]'
    assert read({}, footprint=square).footprint.max() == pytest.approx(0.21)
    assert read({'footprint': square}).footprint.max() == pytest.approx(0.21)
    assert len(read({'global_costmap': {'robot_radius': 0.4}}, footprint=square).footprint) == 16
    assert len(read({}, robot_radius=0.4).footprint) == 16


def test_all_faults_are_said_at_once():
    with pytest.raises(ParameterError) as error:
        read({'controller_frequency': 'fast', 'planner_patience': -3, 'base_local_planner': 'teb/Teb',
              'GridPlanner': {'straighten_slack': 7.0},
              'global_costmap': {'footprint': 'round', 'inflation_layer': {'inflation_radius': -1.0}}})
    for text in ("controller_frequency is 'fast' but must be a number", 'planner_patience is -3', "'teb/Teb'",
                 'straighten_slack is 7', "footprint is 'round'", 'inflation_radius is -1'):
        assert text in str(error.value)


@pytest.mark.parametrize('tree, text', [
    ({'oscillation_timeout': 10.0}, 'oscillation_timeout has no effect: oscillation detection: not built'),
    ({'recovery_behaviors': [{'name': 'a', 'type': 'b'}]}, 'recovery_behaviors has no effect'),
    ({'local_costmap': {'width': 4}}, 'local_costmap/width has no effect'),
    ({'TrajectoryPlannerROS': {'sim_time': 4.0}}, 'TrajectoryPlannerROS/sim_time has no effect'),
    ({'global_costmap': {'rolling_window': True}}, 'rolling_window has no effect'),
    ({'controler_frequency': 10.0}, 'controler_frequency is not known .* controller_frequency meant')])
def test_what_has_no_effect_is_said(tree, text):
    with_footprint = dict(tree, footprint='[[1, 1], [1, -1], [-1, -1], [-1, 1]]')
    with_footprint['inflation_layer'] = {}
    warnings = read(with_footprint).warnings

    assert any(re.search(text, w) for w in warnings), warnings


@pytest.mark.parametrize('tree', [{'oscillation_timeout': 0.0}, {'recovery_behaviors': []}, {'shutdown_costmaps': False},
                                  {'global_costmap': {'rolling_window': False}}])
def test_values_that_change_nothing_are_not_worth_a_warning(tree):
    assert read(tree).warnings == ()


def test_an_inflation_narrower_than_the_robot_is_warned_of():
    warnings = read({'global_costmap': {'robot_radius': 0.4, 'inflation_radius': 0.2}}).warnings
    assert any('inflation_radius' in w for w in warnings)
