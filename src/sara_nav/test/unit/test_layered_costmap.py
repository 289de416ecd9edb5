"""Layered costmaps: only what changed is computed, and that gives what computing everything would; rolling;
clearing.
"""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import FREE, LETHAL, UNKNOWN, InflationConfig, StaticLayerConfig, inflate
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorConfig, RangeSensorLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.costmaps.observations import Observation
from sara_nav.grids.footprint import circle_footprint, radii
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap, MapError

ROUND = circle_footprint(0.3)


def grid_map(cells, resolution=0.1, origin=(0.0, 0.0)):
    cells = np.asarray(cells, np.int8)
    return GridMap(cells, GridGeometry(cells.shape[1], cells.shape[0], resolution, *origin))


def make(layers, footprint=ROUND, **parameters):
    return LayeredCostmap(
        CostmapConfig(**dict(dict(resolution=0.1, width=6.0, height=6.0), **parameters)), layers, footprint
    )


def reading(x, y, yaw, distance, t=0.0, source='/sonar', fov=0.6):
    return RangeReading(source, t, x, y, yaw, distance, 0.1, 2.5, fov)


def everything_anew(costmap, t, pose):
    """Return the costs after all cells were computed once more."""
    costmap.touch_all()
    costmap.update(t, pose)
    return costmap.costmap.costs.copy()


@settings(max_examples=40)
@given(
    st.integers(0, 10**6), st.booleans(), st.booleans(), st.permutations(['static', 'range', 'obstacles', 'inflation'])
)
def test_computing_what_changed_gives_what_computing_everything_gives(seed, rolling, unknown_too, order):
    rng = random.Random(seed)
    kinds = {
        'static': StaticLayer('static', StaticLayerConfig()),
        'range': RangeSensorLayer('range'),
        'inflation': InflationLayer('inflation', InflationConfig(0.4, 3.0, unknown_too)),
        'obstacles': ObstacleLayer(
            'obstacles',
            ObstacleConfig(
                track_unknown_space=rng.random() < 0.5,
                combination_method=rng.choice([0, 1]),
                sources=(SourceConfig('scan', clearing=True, observation_persistence=rng.choice([0.0, 2.0])),),
            ),
        ),
    }
    costmap = make([kinds[name] for name in order], rolling_window=rolling, track_unknown_space=rng.random() < 0.5)
    values = np.array([rng.choices([0, 100, -1], [8, 1, 1])[0] for _ in range(2400)]).reshape(40, 60)
    kinds['static'].set_map(grid_map(values, origin=(-1.0, 0.5)))
    pose = Pose2D(2.0, 2.0, 0.0)
    for step in range(8):
        pose = Pose2D(pose.x + rng.uniform(-0.8, 0.8), pose.y + rng.uniform(-0.8, 0.8), rng.uniform(-3.0, 3.0))
        for _ in range(rng.randrange(3)):
            kinds['range'].add_range(reading(pose.x, pose.y, rng.uniform(-4.0, 4.0), rng.uniform(0.1, 3.0), step))
        for _ in range(rng.randrange(2)):
            points = [[pose.x + rng.uniform(-4.0, 4.0), pose.y + rng.uniform(-4.0, 4.0), 0.5] for _ in range(20)]
            kinds['obstacles'].add_observation(Observation('scan', step, (pose.x, pose.y, 0.5), np.array(points)))
        if rng.random() < 0.3:
            kinds['static'].update_map(rng.randrange(30), rng.randrange(20), np.full((5, 6), rng.choice([0, 100, -1])))
        costmap.update(float(step), pose)
        found = costmap.costmap.costs.copy()
        assert (found == everything_anew(costmap, float(step), pose)).all()


@pytest.mark.parametrize('rolling', [False, True])
def test_a_free_margin_holds_for_maps_and_their_updates(rolling):
    layer = StaticLayer('static', StaticLayerConfig(free_margin=0.25))
    costmap = make([layer], rolling_window=rolling)
    values = np.full((40, 60), -1)
    values[:, :20] = 0
    layer.set_map(grid_map(values))
    resolution = layer.mapped()[1].resolution
    reach = int(0.25 / resolution)
    assert (layer.costs[:, : 20 + reach] == FREE).all() and (layer.costs[:, 20 + reach :] == UNKNOWN).all()
    layer.update_map(30, 5, [[0]])
    assert layer.costs[5, 30 + reach] == FREE and layer.costs[5, 31 + reach] == UNKNOWN
    assert costmap.free_margin == 0.25 and make([StaticLayer('static')]).free_margin == 0.0
    assert make([InflationLayer('inflation', InflationConfig(0.5))]).free_margin == 0.0


def test_only_the_changed_window_grown_by_the_radius_is_computed():
    layer = StaticLayer('static')
    costmap = make([layer, InflationLayer('inflation', InflationConfig(0.5))])
    layer.set_map(grid_map(np.zeros((100, 120))))
    costmap.update(0.0, None)
    assert costmap.cells_computed == 100 * 120
    layer.update_map(50, 40, [[100, 100], [0, 0], [0, 0]])
    assert costmap.update(0.2, None) == (45, 35, 57, 48)
    assert costmap.cells_computed == 100 * 120 + 12 * 13
    assert costmap.update(0.4, None) is None
    assert costmap.cells_computed == 100 * 120 + 12 * 13
    layer.update_map(0, 0, [[100]])
    layer.update_map(110, 90, [[100]])
    costmap.update(0.6, None)
    assert costmap.cells_computed == 100 * 120 + 12 * 13 + 6 * 6 + 11 * 11


def test_a_rolling_window_computes_only_what_came_into_sight_and_what_was_next_to_what_left():
    costmap = make(
        [RangeSensorLayer('range'), InflationLayer('inflation', InflationConfig(0.5))],
        rolling_window=True,
        width=20.0,
        height=20.0,
    )
    costmap.update(0.0, Pose2D(0.0, 0.0, 0.0))
    before = costmap.cells_computed
    costmap.update(0.2, Pose2D(0.35, 0.0, 0.0))
    assert costmap.cells_computed - before == 200 * (3 + 5) + 200 * 5
    assert costmap.geometry.origin_x == pytest.approx(-9.7)


@given(st.lists(st.tuples(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0)), min_size=1, max_size=12))
@settings(max_examples=50)
def test_a_rolling_window_keeps_the_robot_within_a_cell_of_its_middle_and_stays_on_its_raster(places):
    costmap = make([], rolling_window=True, origin_x=0.03)
    for x, y in places:
        costmap.update(0.0, Pose2D(x, y, 0.0))
        g = costmap.geometry
        assert abs(g.origin_x + 3.0 - x) < 0.1 + 1e-9 and abs(g.origin_y + 3.0 - y) < 0.1 + 1e-9
        assert (g.origin_x - 0.03) / 0.1 == pytest.approx(round((g.origin_x - 0.03) / 0.1), abs=1e-6)


def test_what_a_rolling_window_still_sees_stays_where_it_is():
    layer = RangeSensorLayer('range', RangeSensorConfig(use_decay=False))
    costmap = make([layer], rolling_window=True)
    costmap.update(0.0, Pose2D(0.0, 0.0, 0.0))
    layer.add_range(reading(0.0, 0.0, 0.0, 1.05))
    for step in range(9):
        costmap.update(0.1 * step, Pose2D(0.3 * step, -0.2 * step, 0.0))
        assert costmap.costmap.cost_at(1.05, 0.0) == LETHAL


def test_a_map_gives_its_size_and_place_and_a_rolling_window_looks_it_up():
    values = np.zeros((30, 50), np.int8)
    values[10, 20] = 100
    still, rolling = StaticLayer('static'), StaticLayer('static')
    fixed = make([still])
    still.set_map(grid_map(values, origin=(-2.0, 1.0)))
    assert fixed.geometry == GridGeometry(50, 30, 0.1, -2.0, 1.0)
    window = make([rolling], rolling_window=True, resolution=0.05)
    rolling.set_map(grid_map(values, origin=(-2.0, 1.0)))
    rolling.set_frame(Pose2D(0.4, 0.2, math.pi / 2))
    for costmap in (fixed, window):
        costmap.update(0.0, Pose2D(0.0, 0.0, 0.0))
    x, y = fixed.geometry.to_world(20, 10)
    assert fixed.costmap.cost_at(x, y) == LETHAL
    there = Pose2D(0.4, 0.2, math.pi / 2).inverse().compose(Pose2D(x, y, 0.0))
    assert window.costmap.cost_at(there.x, there.y) == LETHAL
    assert (window.costmap.costs == LETHAL).sum() == 4


@pytest.mark.parametrize('times', [2, 3, 5])
def test_no_obstacle_of_a_finer_map_is_lost_in_a_rolling_window(times):
    """Each single cell of the map in turn: the costmap's cell about it is lethal, unknown ones beside it or not."""
    fine = 0.1 / times
    for around in (0, -1):
        for row, column in np.ndindex(times, times):
            layer = StaticLayer('static')
            costmap = make([layer], rolling_window=True, resolution=0.1)
            values = np.full((5 * times, 5 * times), around, np.int8)
            values[2 * times + row, 2 * times + column] = 100
            layer.set_map(GridMap(values, GridGeometry(5 * times, 5 * times, fine, -0.2, -0.2)))
            costmap.update(0.0, Pose2D(0.0, 0.0, 0.0))
            assert costmap.costmap.cost_at(0.05, 0.05) == LETHAL
            assert (costmap.costmap.costs == LETHAL).sum() == 1


def test_a_cell_that_a_finer_map_knows_in_part_has_the_cost_that_is_known():
    layer = StaticLayer('static')
    costmap = make([layer], rolling_window=True, resolution=0.1)
    layer.set_map(GridMap(np.array([[-1, 0], [-1, -1]], np.int8), GridGeometry(2, 2, 0.05, 0.0, 0.0)))
    costmap.update(0.0, Pose2D(0.0, 0.0, 0.0))
    assert costmap.costmap.cost_at(0.05, 0.05) == FREE


def test_static_layers_use_maximum_and_first_map_only():
    low, high = StaticLayer('low'), StaticLayer('high', StaticLayerConfig(use_maximum=True, first_map_only=True))
    costmap = make([low, high])
    assert low.set_map(grid_map([[100, 0, -1]])) and high.set_map(grid_map([[0, 0, 0]]))
    low.reset()
    costmap.update(0.0, None)
    assert costmap.costmap.costs.tolist() == [[LETHAL, FREE, FREE]]
    assert not high.set_map(grid_map([[100, 100, 100]]))


def test_maps_and_updates_that_make_no_sense_are_refused_and_counted():
    layer = StaticLayer('static')
    costmap = make([layer])
    with pytest.raises(MapError, match='before the map'):
        layer.update_map(0, 0, [[0]])
    with pytest.raises(MapError, match='turned by 0.500 rad'):
        layer.set_map(GridMap(np.zeros((3, 3), np.int8), GridGeometry(3, 3, 0.1, 0.0, 0.0), 0.5))
    assert costmap.current(0.0) == 'no map on map yet'
    layer.set_map(grid_map(np.zeros((3, 3))))
    for x, y, values in ((-1, 0, [[0]]), (0, 3, [[0]]), (2, 0, [[0, 0]]), (0, 0, [0]), (0, 0, np.zeros((0, 0)))):
        with pytest.raises(MapError, match='does not lie on the map'):
            layer.update_map(x, y, values)
    assert costmap.current(0.0) == '' and layer.counts['bad_updates'] == 5


def test_nothing_is_made_of_poses_that_are_not_numbers():
    costmap = make([RangeSensorLayer('range')], rolling_window=True)
    costmap.update(0.0, Pose2D(1.0, 1.0, 0.0))
    origin = costmap.geometry
    for pose in (
        Pose2D(math.nan, 0.0, 0.0),
        Pose2D(0.0, math.inf, 0.0),
        Pose2D(0.0, 0.0, math.nan),
        Pose2D(1e300, 0.0, 0.0),
        None,
    ):
        costmap.update(0.1, pose)
    assert costmap.geometry == origin and costmap.bad_poses == 4


def test_updates_are_due_as_update_frequency_says():
    costmap = make([], update_frequency=5.0)
    done = []
    for k in range(201):
        t = 100.0 + 0.05 * k + (0.013 if k % 3 == 0 else 0.0)
        if costmap.due(t):
            costmap.update(t, None)
            done.append(t)
    assert len(done) in (50, 51)
    assert costmap.due(5.0), 'time went back'
    assert not make([], update_frequency=0.0).due(1.0)


@pytest.mark.parametrize(
    'wrong, named',
    [
        (dict(resolution=0.0), 'resolution'),
        (dict(resolution=math.nan), 'resolution'),
        (dict(width=0.0), 'width'),
        (dict(height=math.inf), 'height'),
        (dict(height=-3.0), 'height'),
        (dict(update_frequency=-1.0), 'update_frequency'),
        (dict(publish_frequency=math.nan), 'publish_frequency'),
        (dict(transform_tolerance=-1.0), 'transform_tolerance'),
        (dict(origin_x=math.nan), 'origin_x'),
        (dict(width=1e6, height=1e6), 'cells'),
        (dict(global_frame=''), 'global_frame'),
    ],
)
def test_parameters_that_make_no_sense_are_named(wrong, named):
    with pytest.raises(ValueError, match=named):
        make([], **wrong)


def test_size_and_footprint_can_be_changed_while_running():
    layer, around = RangeSensorLayer('range'), InflationLayer('inflation', InflationConfig(1.0, 2.0))
    costmap = make([layer, around])
    layer.add_range(reading(1.0, 3.0, 0.0, 1.0))
    costmap.update(0.0, None)
    costmap.set_footprint(circle_footprint(0.7))
    costmap.update(0.2, None)
    raw = np.where(costmap.costmap.costs == LETHAL, LETHAL, 0).astype(np.uint8)
    assert raw.any()
    assert (costmap.costmap.costs == inflate(raw, 0.1, radii(circle_footprint(0.7))[0], around.config)).all()
    costmap.reconfigure(CostmapConfig(resolution=0.2, width=4.0, height=2.0))
    costmap.update(0.4, None)
    assert costmap.costmap.costs.shape == (10, 20) and not costmap.costmap.costs.any()
    around.reconfigure(InflationConfig(0.4))
    with pytest.raises(ValueError, match='inflation_radius'):
        around.reconfigure(InflationConfig(-1.0))


@pytest.mark.parametrize('origin', (0.0, -1.0))
def test_a_map_keeps_its_size_though_it_is_the_one_that_the_parameters_ask_for(origin):
    chart = StaticLayer('static')
    costmap = make([chart])
    values = np.zeros((60, 60))
    values[3, 3] = 100
    chart.set_map(grid_map(values, origin=(origin, origin)))
    costmap.update(0.0, None)
    costmap.reconfigure(CostmapConfig(resolution=0.1, width=9.0, height=6.0))
    costmap.update(0.2, None)
    assert costmap.costmap.costs.shape == (60, 60) and costmap.costmap.costs[3, 3] == LETHAL


def test_reset_forgets_what_sensors_said_and_keeps_the_map():
    chart, layer = StaticLayer('static'), RangeSensorLayer('range')
    costmap = make([chart, layer])
    values = np.zeros((60, 60))
    values[3, 3] = 100
    chart.set_map(grid_map(values))
    layer.add_range(reading(1.0, 3.0, 0.0, 1.0))
    costmap.update(0.0, None)
    assert (costmap.costmap.costs == LETHAL).sum() > 1
    costmap.reset()
    costmap.update(0.2, None)
    assert (costmap.costmap.costs == LETHAL).sum() == 1


def test_clearing_names_layers_and_keeps_or_takes_the_inside():
    for invert in (False, True):
        layer = RangeSensorLayer('sonars/front')
        costmap = make([layer, InflationLayer('inflation')])
        for x in (1.0, 4.0):
            layer.add_range(reading(x, 3.0, 0.0, 0.55))
        costmap.update(0.0, None)
        assert costmap.costmap.cost_at(1.55, 3.0) == costmap.costmap.cost_at(4.55, 3.0) == LETHAL
        assert costmap.clear_area(0.0, 0.0, 3.0, 6.0, invert, ['obstacles', 'inflation']) == []
        assert costmap.clear_area(0.0, 0.0, 3.0, 6.0, invert, ['front']) == ['sonars/front']
        costmap.update(0.2, None)
        assert (costmap.costmap.cost_at(1.55, 3.0) == LETHAL) != invert
        assert (costmap.costmap.cost_at(4.55, 3.0) == LETHAL) == invert
    with pytest.raises(ValueError, match='finite'):
        costmap.clear_area(math.nan, 0.0, 1.0, 1.0, False, ['front'])


def test_unknown_space_is_the_ground_where_asked():
    assert (make([], track_unknown_space=True).costmap.costs == UNKNOWN).all()
    assert (make([]).costmap.costs == FREE).all()
