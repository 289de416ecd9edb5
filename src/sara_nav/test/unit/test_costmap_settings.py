"""Costmaps from parameters: costmap_2d's names in both forms, the footprint's, and that faults are named."""

import dataclasses
import math

import numpy as np
import pytest

from sara_nav.config.parameters import Parameters
from sara_nav.costmaps.costmap_settings import read_costmap
from sara_nav.costmaps.layered_costmap import CostmapConfig
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig
from sara_nav.costmaps.layers.range_sensor import RangeSensorConfig
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap

K = 'global_costmap/'


def read(tree, **given):
    parameters = Parameters({'global_costmap': tree})
    return read_costmap(parameters, K, **given), parameters


def sound(tree, **given):
    settings, parameters = read(tree, **given)
    assert parameters.faults == []
    return settings


def faults(tree, **given):
    return read(tree, **given)[1].faults


def plugins(*kinds):
    return [{'name': f'l{i}', 'type': kind} for i, kind in enumerate(kinds)]


# -- costmap_2d's footprint tests, rebuilt from their description --------------------------------------------------


def test_an_unpadded_footprint_from_a_string():
    settings = sound({'footprint': '[[1, 1], [-1, 1], [-1, -1]]', 'footprint_padding': 0})
    assert settings.footprint.tolist() == [[1, 1], [-1, 1], [-1, -1]]


def test_a_padded_footprint_from_a_string():
    settings = sound({'footprint': '[[1, 1], [-1, 1], [-1, -1]]', 'footprint_padding': 0.5})
    assert settings.footprint.tolist() == [[1.5, 1.5], [-1.5, 1.5], [-1.5, -1.5]]


def test_a_radius_gives_sixteen_corners():
    settings = sound({'robot_radius': 10, 'footprint_padding': 0})
    assert settings.footprint.shape == (16, 2)
    assert settings.footprint[0].tolist() == [10.0, 0.0]
    assert settings.footprint[4] == pytest.approx([0.0, 10.0], abs=1e-4)


def test_a_footprint_from_a_list():
    corners = [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]
    assert sound({'footprint': corners, 'footprint_padding': 0}).footprint.tolist() == corners


def test_a_footprint_in_the_costmaps_own_namespace_and_above():
    corners = '[[1, 2], [3, 4], [5, 6]]'
    assert sound({'footprint': corners, 'footprint_padding': 0}).footprint.tolist() == [[1, 2], [3, 4], [5, 6]]
    parameters = Parameters({'footprint': corners, 'global_costmap': {'footprint_padding': 0}})
    assert read_costmap(parameters, K).footprint.tolist() == [[1, 2], [3, 4], [5, 6]]
    above = Parameters({'global_costmap': {'footprint_padding': 0}}, {'footprint': corners})
    assert read_costmap(above, K).footprint.tolist() == [[1, 2], [3, 4], [5, 6]]
    assert sound({'footprint_padding': 0}, footprint=corners).footprint.tolist() == [[1, 2], [3, 4], [5, 6]]


@pytest.mark.parametrize(
    'bad',
    [
        [[0.1, 0.1], [-0.1, 0.1, 77.0], [-0.1, -0.1], [0.1, -0.1]],
        'round',
        [[0, 0], [1, 1]],
        '[1, 2.2], [.3, -4e4]]',
        '[[1, 2.2], [.3, -4e4]',
        '[1, 2.2], [.3, -4e4]',
    ],
)
def test_a_malformed_footprint_is_a_fault(bad):
    assert any('footprint' in fault for fault in faults({'footprint': bad}))


def test_without_footprint_and_radius_the_robot_is_round():
    settings = sound({})
    assert settings.footprint.shape == (16, 2)
    assert settings.footprint[0] == pytest.approx([0.47, 0.0], abs=1e-4)


# -- the rest ------------------------------------------------------------------------------------------------------


def test_the_defaults_are_the_peers():
    settings = sound(
        {
            'plugins': plugins(
                'costmap_2d::StaticLayer',
                'costmap_2d::ObstacleLayer',
                'range_sensor_layer::RangeSensorLayer',
                'costmap_2d::InflationLayer',
            )
        }
    )
    assert dataclasses.astuple(settings.config) == (
        'map',
        'base_link',
        False,
        False,
        False,
        0.3,
        5.0,
        0.0,
        10.0,
        10.0,
        0.05,
        0.0,
        0.0,
    )
    static, obstacles, ranges, inflation = [config for _, _, config in settings.layers]
    assert (static.track_unknown_space, static.lethal_cost_threshold, static.unknown_cost_value) == (True, 100, -1)
    assert (static.trinary_costmap, static.use_maximum, static.first_map_only) == (True, False, False)
    assert (static.map_topic, static.subscribe_to_updates) == ('map', False)
    assert obstacles == ObstacleConfig(True, 2.0, 1, False, 0.2)
    assert (inflation.inflation_radius, inflation.cost_scaling_factor, inflation.inflate_unknown) == (0.55, 10.0, False)
    assert ranges == RangeSensorConfig()
    assert (ranges.use_decay, ranges.clear_on_max_reading) == (True, True), 'ours; the peer has both off'
    assert (settings.footprint_topic, settings.published_footprint_topic) == ('footprint', 'footprint')


def test_layers_come_in_their_order_and_take_old_places_too():
    settings, parameters = read(
        {
            'plugins': plugins(
                'range_sensor_layer::RangeSensorLayer', 'costmap_2d::StaticLayer', 'costmap_2d::InflationLayer'
            ),
            'inflation_radius': 0.8,
            'cost_scaling_factor': 3,
            'map_topic': 'chart',
            'track_unknown_space': False,
            'l0': {'topics': ['/SDI_range', '/SDD_range'], 'ns': 'sonars', 'transform_tolerance_': 0.5},
            'l2': {'inflation_radius': 0.9},
        }
    )
    assert [name for name, _, _ in settings.layers] == ['l0', 'l1', 'l2']
    ranges, static, inflation = [config for _, _, config in settings.layers]
    assert ranges.sources() == ('sonars/SDI_range', 'sonars/SDD_range') and ranges.transform_tolerance == 0.5
    assert (static.map_topic, static.track_unknown_space) == ('chart', False)
    assert (inflation.inflation_radius, inflation.cost_scaling_factor) == (0.9, 3.0)
    assert any('inflation_radius has no effect on the layer' in text for text in parameters.warnings)
    assert parameters.left_over() == []


def test_before_hydro_the_costmaps_own_goes_before_what_a_layer_kept_and_is_moved():
    settings, parameters = read({'inflation_radius': 0.8, 'inflation_layer': {'inflation_radius': 0.9}})
    assert settings.layers[-1][2].inflation_radius == 0.8
    assert parameters.moved == {K + 'inflation_radius': K + 'inflation_layer/inflation_radius'}
    assert parameters.warnings == parameters.left_over() == []
    settings, parameters = read({'inflation_layer': {'inflation_radius': 0.9}})
    assert settings.layers[-1][2].inflation_radius == 0.9 and not parameters.moved


def test_what_belongs_to_no_layer_and_to_no_source_is_said_to():
    """A file that both costmaps load holds what one of them has no layer for, as Husky's does."""
    told = read(
        {
            'plugins': plugins('costmap_2d::ObstacleLayer'),
            'obstacle_range': 5.5,
            'l0': {
                'observation_sources': 'scan',
                'scan': {'obstacle_range': 2.0, 'raytrace_range': 3.0},
                'bump': {'a': 1},
            },
            'static': {'map_topic': '/map', 'subscribe_to_updates': True},
        }
    )[1]
    assert told.faults == told.left_over() == []
    assert told.warnings == [
        f'the parameters under {K}l0/bump/ (a) have no effect: there is no observation source of that name',
        f'the parameters under {K}static/ (map_topic, subscribe_to_updates) have no effect: '
        'there is no layer of that name',
        f'parameter {K}obstacle_range has no effect: no observation source looks for it there',
    ]
    early = read({'observation_sources': 'scan', 'scan': {'topic': 'a'}, 'obstacle_layr': {'enabled': False}})[1]
    assert early.left_over() == [] and len(early.warnings) == 1
    assert early.warnings[0].endswith('there is no layer of that name (is obstacle_layer meant?)')


@pytest.mark.parametrize(
    'tree, elsewhere',
    [
        ({}, {'footprint', 'robot_radius', 'footprint_padding'}),
        ({'footprint_padding': 0.1}, {'footprint', 'robot_radius'}),
        ({'robot_radius': 0.3}, {'footprint_padding'}),
        ({'footprint': '[[1, 1], [-1, 1], [-1, -1]]', 'footprint_padding': 0.1}, set()),
    ],
)
def test_what_of_the_footprint_is_set_elsewhere(tree, elsewhere):
    assert set(sound(tree, robot_radius=0.4).elsewhere) == elsewhere


def test_the_form_from_before_hydro():
    settings, parameters = read(
        {
            'static_map': True,
            'map_topic': 'chart',
            'observation_sources': 'scan cloud',
            'obstacle_range': 1.5,
            'scan': {'data_type': 'LaserScan', 'clearing': True, 'topic': '/base_scan', 'inf_is_valid': True},
            'cloud': {'data_type': 'PointCloud2', 'obstacle_range': 4, 'expected_update_rate': 0.5},
            'inflation_radius': 0.7,
            'track_unknown_space': True,
        }
    )
    assert parameters.faults == parameters.warnings == parameters.left_over() == []
    assert [name for name, _, _ in settings.layers] == ['static_layer', 'obstacle_layer', 'inflation_layer']
    static, obstacles, inflation = [config for _, _, config in settings.layers]
    assert static.map_topic == 'chart' and inflation.inflation_radius == 0.7 and obstacles.track_unknown_space
    scan, cloud = obstacles.sources
    assert (scan.topic, scan.data_type, scan.clearing, scan.marking, scan.inf_is_valid) == (
        '/base_scan',
        'LaserScan',
        True,
        True,
        True,
    )
    assert (scan.obstacle_range, scan.raytrace_range) == (1.5, 3.0)
    assert (cloud.name, cloud.topic, cloud.obstacle_range, cloud.expected_update_rate) == ('cloud', '', 4.0, 0.5)
    assert [name for name, _, _ in sound({}).layers] == ['obstacle_layer', 'inflation_layer']
    assert (
        len(sound({}, static_map=True).layers) == 3 and len(sound({'static_map': False}, static_map=True).layers) == 2
    )


def test_sources_of_a_layer():
    settings = sound(
        {
            'plugins': plugins('costmap_2d::ObstacleLayer'),
            'raytrace_range': 6.0,
            'track_unknown_space': True,
            'l0': {
                'observation_sources': 'scan',
                'obstacle_range': 5,
                'scan': {'data_type': 'LaserScan', 'sensor_frame': 'laser'},
            },
        }
    )
    config = settings.layers[0][2]
    assert (config.sources[0].obstacle_range, config.sources[0].raytrace_range) == (5.0, 6.0)
    assert config.sources[0].sensor_frame == 'laser' and config.track_unknown_space


@pytest.mark.parametrize(
    'tree, texts',
    [
        ({'plugins': plugins('costmap_2d::VoxelLayer')}, ['costmap_2d::VoxelLayer', 'use costmap_2d::ObstacleLayer']),
        ({'map_type': 'voxel'}, ['map_type', "use 'costmap'"]),
        (
            {'plugins': plugins('my::Layer')},
            ['my::Layer', 'costmap_2d::StaticLayer', 'range_sensor_layer::RangeSensorLayer'],
        ),
        ({'plugins': [{'name': 'a'}]}, ['plugins holds']),
        ({'plugins': 'static'}, ['plugins is']),
        ({'plugins': [{'name': 'a', 'type': 'costmap_2d::StaticLayer'}] * 2}, ['names a layer twice']),
        ({'resolution': 0.0}, ['resolution is 0']),
        ({'resolution': 'fine'}, ["resolution is 'fine'"]),
        ({'width': 0}, ['width is 0']),
        ({'rolling_window': 'yes'}, ['rolling_window']),
        (
            {'inflation_layer': {'inflation_radius': -1.0, 'cost_scaling_factor': 200}},
            ['inflation_radius is -1', 'cost_scaling_factor is 200'],
        ),
        ({'obstacle_layer': {'combination_method': 7}}, ['combination_method is 7']),
        ({'observation_sources': 'a a'}, ['names a source twice']),
        (
            {'observation_sources': 'a', 'a': {'data_type': 'Sonar', 'obstacle_range': math.nan}},
            ["data_type is 'Sonar'", 'obstacle_range is nan'],
        ),
        (
            {
                'plugins': plugins('range_sensor_layer::RangeSensorLayer'),
                'l0': {'input_sensor_type': 'BAT', 'mark_threshold': 2.0, 'topics': [3], 'pixel_decay': math.nan},
            },
            ["input_sensor_type is 'BAT'", 'mark_threshold is 2', 'topics is (3,)', 'pixel_decay is nan'],
        ),
        (
            {'plugins': plugins('range_sensor_layer::RangeSensorLayer'), 'l0': {'clear_threshold': 0.9}},
            ['clear_threshold is 0.9'],
        ),
        ({'robot_radius': -1.0}, ['robot_radius is -1']),
        ({'footprint_padding': math.inf}, ['footprint_padding is inf']),
    ],
)
def test_faults_are_named(tree, texts):
    found = '; '.join(faults(tree))
    for text in texts:
        assert text in found


@pytest.mark.parametrize(
    'tree, text',
    [
        ({'plugins': [], 'static_map': True}, 'static_map has no effect: plugins'),
        ({'inflation_layer': {'inflation_radius': 0.1}}, 'less than the inscribed radius'),
        ({'update_frequency': 0.0}, 'never updated'),
        ({'observation_sources': 'a', 'a': {'inf_is_valid': True}}, 'inf_is_valid has no effect on a PointCloud'),
    ],
)
def test_what_is_hardly_meant_is_warned_of(tree, text):
    assert any(text in warning for warning in read(tree)[1].warnings)


def test_what_was_read_is_what_is_made():
    settings = sound(
        {
            'plugins': plugins('costmap_2d::StaticLayer', 'costmap_2d::InflationLayer'),
            'resolution': 0.1,
            'width': 3,
            'height': 2.5,
            'origin_x': -1.0,
            'footprint': [[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]],
        }
    )
    assert settings.make().geometry == GridGeometry(30, 25, 0.1, -1.0, 0.0)
    made = settings.make(GridMap(np.zeros((4, 6), np.int8), GridGeometry(6, 4, 0.2, 0.5, 0.5)))
    assert made.geometry == GridGeometry(6, 4, 0.2, 0.5, 0.5) and made.current(0.0) == ''
    assert made.inscribed_radius == pytest.approx(0.21)
    assert list(made.layers) == ['l0', 'l1']
    assert CostmapConfig().geometry().shape == (200, 200)
