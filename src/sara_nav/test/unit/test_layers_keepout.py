"""The keep-out filter: a mask's costs on the costmap, and the way out for a robot that stands in one."""

import math
from pathlib import Path

import numpy as np
import pytest

from sara_common.planar import Pose2D
from sara_nav.config.parameters import Parameters
from sara_nav.costmaps.costmap import FREE, INSCRIBED, LETHAL, UNKNOWN, InflationConfig
from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.costmaps.costmap_settings import read_costmap
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.keepout import KeepoutConfig, KeepoutFilter
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.edits import KEEP_OUT, Edit, keep_out_mask
from sara_nav.maps.map_io import GridMap, MapError

BODY = np.array([[0.5, 0.3], [0.5, -0.3], [-0.5, -0.3], [-0.5, 0.3]])
ROOM = GridMap(np.zeros((100, 100), np.int8), GridGeometry(100, 100, 0.05, 0.0, 0.0))
HALL = Edit(KEEP_OUT, (2.0, 0.0), (3.0, 2.0))
STAIRS = Edit(KEEP_OUT, (4.0, 4.0), (4.9, 4.9))
OUTSIDE, INSIDE, BESIDE = Pose2D(1.0, 1.0, 0.0), Pose2D(2.5, 1.0, 0.0), Pose2D(1.42, 1.0, 0.0)
"""BESIDE: the front is 0.08 m before HALL."""


def mask(*places, room=ROOM):
    return keep_out_mask(room, places)


def costmap(places=(HALL, STAIRS), inflation=False, room=ROOM, config=KeepoutConfig(), **parameters):
    """(LayeredCostmap, its KeepoutFilter) over a free room; places=None: no mask came."""
    layers = [StaticLayer('static'), KeepoutFilter('keepout', config)]
    layers += [InflationLayer('inflation', InflationConfig(0.5, 1.0))] if inflation else []
    result = LayeredCostmap(CostmapConfig(resolution=0.05, **parameters), layers, BODY)
    layers[0].set_map(room)
    if places is not None:
        layers[1].set_mask(mask(*places))
    return result, layers[1]


def test_without_a_mask_nothing_waits_and_nothing_changes():
    held, layer = costmap(None)
    assert held.current(0.0) == '' and held.update(0.0, OUTSIDE) is not None
    assert not held.costmap.costs.any() and held.update(1.0, INSIDE) is None
    assert not layer.forbids(INSIDE, BODY)


def test_a_keep_out_place_is_an_obstacle_that_is_inflated():
    held, _ = costmap(inflation=True)
    held.update(0.0, OUTSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == held.costmap.cost_at(4.5, 4.5) == LETHAL
    assert held.costmap.cost_at(1.8, 1.0) == INSCRIBED and held.costmap.cost_at(1.0, 3.0) == FREE


def test_a_new_mask_takes_the_place_of_the_old_one():
    held, layer = costmap([HALL])
    held.update(0.0, OUTSIDE)
    layer.set_mask(mask(STAIRS))
    held.update(1.0, OUTSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == FREE and held.costmap.cost_at(4.5, 4.5) == LETHAL
    layer.set_mask(mask())
    held.update(2.0, OUTSIDE)
    assert not held.costmap.costs.any()


def test_the_map_s_own_obstacles_and_unknown_cells_stay():
    data = np.zeros((100, 100), np.int8)
    data[10, 45], data[20, 45], data[20, 5] = 100, -1, -1
    held, _ = costmap(room=GridMap(data, ROOM.geometry))
    held.update(0.0, OUTSIDE)
    cells = held.costmap.costs[10, 45], held.costmap.costs[20, 45], held.costmap.costs[20, 5]
    assert cells == (LETHAL, LETHAL, UNKNOWN)
    held.update(1.0, INSIDE)  # the way out is no way through what is not known
    cells = held.costmap.costs[10, 45], held.costmap.costs[20, 45], held.costmap.costs[20, 5]
    assert cells == (LETHAL, UNKNOWN, UNKNOWN)


def test_shades_of_a_mask_cost_in_proportion():
    held, layer = costmap(None)
    shades = np.tile(np.array([0, 50, 100, -1], np.int8), (100, 25))
    layer.set_mask(GridMap(shades, ROOM.geometry))
    held.update(0.0, None)
    assert held.costmap.costs[0, :4].tolist() == [0, 127, 254, 0]


def test_who_stands_in_a_place_is_let_out_of_it_alone_and_not_in_again():
    held, _ = costmap()
    held.update(0.0, INSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == 252 and held.costmap.cost_at(4.5, 4.5) == LETHAL
    for k, x in enumerate(np.arange(2.5, 1.0, -0.05)):
        held.update(1.0 + k, Pose2D(x, 1.0, 0.0))
        assert held.costmap.cost_at(2.5, 1.0) == (252 if x + 0.5 > 1.9 else LETHAL), x
    held.update(99.0, BESIDE)
    assert held.costmap.cost_at(2.5, 1.0) == LETHAL


def test_who_only_grazes_a_place_does_not_open_it():
    held, _ = costmap()
    held.update(0.0, BESIDE)
    held.update(1.0, Pose2D(1.48, 1.0, 0.0))  # 0.03 m in its cells: the pose is no better known than that
    assert held.costmap.cost_at(2.5, 1.0) == LETHAL


def test_the_way_out_is_a_parameter():
    held, _ = costmap(config=KeepoutConfig(override_lethal_cost=False))
    held.update(0.0, INSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == LETHAL
    held, layer = costmap(config=KeepoutConfig(lethal_override_cost=100.0))
    held.update(0.0, INSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == 100
    layer.reconfigure(KeepoutConfig(lethal_override_cost=7.0))
    held.update(1.0, INSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == 7
    layer.reconfigure(KeepoutConfig(enabled=False))
    held.update(2.0, INSIDE)
    assert not held.costmap.costs.any() and not layer.forbids(INSIDE, BODY)
    with pytest.raises(ValueError, match='lethal_override_cost is 253.0'):
        layer.reconfigure(KeepoutConfig(lethal_override_cost=253.0))


def test_a_rolling_costmap_finds_the_places_also_in_another_frame():
    rolling, layer = costmap(rolling_window=True, width=3.0, height=3.0)
    rolling.update(0.0, OUTSIDE)
    assert rolling.costmap.cost_at(2.2, 1.0) == LETHAL and rolling.costmap.cost_at(1.9, 1.0) == FREE
    layer.set_frame(Pose2D(1.0, 0.0, 0.0))  # the costmap's frame lies 1 m east in the mask's
    rolling.update(1.0, Pose2D(0.0, 1.0, 0.0))
    assert rolling.costmap.cost_at(1.2, 1.0) == LETHAL and rolling.costmap.cost_at(0.9, 1.0) == FREE
    assert layer.forbids(Pose2D(1.5, 1.0, 0.0), BODY) and not layer.forbids(Pose2D(-0.5, 1.0, 0.0), BODY)
    layer.set_frame(Pose2D(math.nan, 0.0, 0.0))
    assert layer.counts['bad_frames'] == 1


def test_costmaps_that_are_cleared_keep_it():
    held, layer = costmap()
    held.update(0.0, OUTSIDE)
    assert held.clear_area(0.0, 0.0, 5.0, 5.0, True, ['keepout']) == []
    held.reset()
    held.update(1.0, OUTSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == LETHAL


def test_a_goal_in_a_keep_out_place_is_refused_by_name_even_from_within():
    (world, _), (local, _) = costmap(), costmap(rolling_window=True, width=3.0, height=3.0)
    pair = CostmapPair(world, local)
    pair.update(0.0, INSIDE, INSIDE)
    text = pair.refusal(Pose2D(2.4, 1.2, 0.0), True, True)
    assert text.startswith('Goal refused: (2.40, 1.20) is in a keep-out place')
    assert pair.refusal(Pose2D(1.6, 1.2, 0.0), True, True).startswith('Goal refused: (1.60, 1.20) is in a keep-out')
    assert pair.refusal(Pose2D(1.6, 1.2, 0.0), False, True) == '' and pair.refusal(OUTSIDE, True, True) == ''
    assert 'keep-out' in pair.refusal(Pose2D(2.4, 1.2, 0.0), False, True)


@pytest.mark.parametrize(
    'bad, kind',
    [
        (GridMap(ROOM.data, ROOM.geometry, 0.3), 'turned_maps'),
        (GridMap(ROOM.data, ROOM.geometry, math.nan), 'turned_maps'),
        (GridMap(ROOM.data[:50], ROOM.geometry), 'bad_maps'),
        (GridMap(ROOM.data, GridGeometry(100, 100, 1e-9, 0.0, 0.0)), 'bad_maps'),
    ],
)
def test_a_mask_that_cannot_be_is_refused_and_the_old_one_stays(bad, kind):
    held, layer = costmap()
    with pytest.raises(MapError):
        layer.set_mask(bad)
    assert layer.counts[kind] == 1
    held.update(0.0, OUTSIDE)
    assert held.costmap.cost_at(2.5, 1.0) == LETHAL


def test_it_is_read_from_parameters_by_name():
    plugins = [{'name': 'no_go', 'type': 'sara_nav/KeepoutFilter'}]
    parameters = Parameters({'c': {'plugins': plugins, 'no_go': {'mask_topic': 'areas', 'lethal_override_cost': 9}}})
    settings = read_costmap(parameters, 'c/')
    assert parameters.faults == [] and settings.layers[0][2] == KeepoutConfig(True, 'areas', True, 9.0)
    parameters = Parameters({'c': {'plugins': plugins, 'no_go': {'mask_topic': '', 'lethal_override_cost': 254}}})
    read_costmap(parameters, 'c/')
    assert len(parameters.faults) == 2
    kind = 'costmap_prohibition_layer_namespace::CostmapProhibitionLayer'
    parameters = Parameters({'c': {'plugins': [{'name': 'no_go', 'type': kind}]}})
    read_costmap(parameters, 'c/')
    assert 'use sara_nav/KeepoutFilter' in parameters.faults[0]


def test_sara_s_own_costmaps_have_it_below_the_inflation():
    import yaml

    folder = Path(__file__).resolve().parents[2] / 'config'
    plain, scan = (yaml.safe_load((folder / name).read_text()) for name in ('sara_nav.yaml', 'scan.yaml'))
    for tree in (file[name] for file in (plain, scan) for name in ('global_costmap', 'local_costmap')):
        kinds = [plugin['type'] for plugin in tree['plugins']]
        assert kinds.index('sara_nav/KeepoutFilter') == kinds.index('costmap_2d::InflationLayer') - 1
