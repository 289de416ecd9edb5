"""The obstacle layer: costmap_2d's own tests rebuilt from their description on the ten by ten map, and laws of marking
and clearing."""

import dataclasses
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import FREE, LETHAL, UNKNOWN
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.costmaps.observations import Observation

sys.path.append(str(Path(__file__).resolve().parent))
from ten_by_ten import AT_ORIGIN, count, make, see  # noqa: E402  pylint: disable=wrong-import-position

# -- costmap_2d's obstacle tests -------------------------------------------------------------------------------


def test_one_point_adds_one_obstacle_to_the_maps_twenty():
    costmap, layer = make()
    see(layer, 0.0, 0.0, 0.5, (0.0, 0.0, 0.5))
    costmap.update(0.0, AT_ORIGIN)
    assert count(costmap, LETHAL) == 21


def test_rays_clear_what_was_seen_but_not_the_map():
    costmap, layer = make()
    costmap.update(0.0, AT_ORIGIN)
    assert count(costmap, LETHAL) == 20
    see(layer, 9.5, 9.5, 0.5, (0.5, 0.5, 0.5))
    costmap.update(0.1, AT_ORIGIN)
    assert count(costmap, LETHAL) == 21
    for i in range(10):
        layer.costs[i, i] = LETHAL
    costmap.update(0.2, AT_ORIGIN)
    assert count(costmap, LETHAL) == 21 and count(costmap, FREE) == 79


def test_rays_of_three_points_in_a_line_do_not_wipe_one_another_out():
    costmap, layer = make(static=False, track_unknown=True)
    for place in (3.0, 5.0, 7.0):
        see(layer, place, place, 1.0)
    costmap.update(0.0, AT_ORIGIN)
    assert (count(costmap, LETHAL), count(costmap, UNKNOWN), count(costmap, FREE)) == (3, 92, 5)


def test_points_that_are_too_high_are_no_obstacles():
    costmap, layer = make(static=False, track_unknown=True)
    see(layer, 0.0, 5.0, 0.4)
    see(layer, 1.0, 5.0, 2.2)
    costmap.update(0.0, AT_ORIGIN)
    assert count(costmap, LETHAL) == 1


def test_the_same_point_seen_again_is_one_obstacle():
    costmap, layer = make()
    for _ in range(3):
        see(layer, 0.0, 0.0)
    for t in (0.0, 0.1):
        costmap.update(t, AT_ORIGIN)
        assert count(costmap, LETHAL) == 21


def test_a_point_on_an_obstacle_of_the_map_adds_none():
    costmap, layer = make()
    see(layer, 9.5, 0.0)
    costmap.update(0.0, AT_ORIGIN)
    assert count(costmap, LETHAL) == 20


# -- clear_costmap_recovery's tests, by the lethal cells that are left ---------------------------------------------


@pytest.mark.parametrize(
    'distance, layers, left',
    [
        (3.0, ['obstacles'], 20),
        (20.0, ['obstacles'], 22),
        (20.0, [], 22),
        (3.0, ['obstacles', 'static_map'], 0),
        (12.0, ['obstacles', 'static_map'], 6),
    ],
)
def test_what_clearing_outside_a_square_leaves(distance, layers, left):
    costmap, layer = make(track_unknown=True)
    see(layer, 5.0, 0.0, 0.5, (0.0, 0.0, 0.5))
    see(layer, 0.0, 5.0, 0.5, (0.0, 0.0, 0.5))
    costmap.update(0.0, AT_ORIGIN)
    assert count(costmap, LETHAL) == 22
    layer.forget_observations()
    half = 0.5 * distance
    assert sorted(costmap.clear_area(-half, -half, half, half, False, layers)) == sorted(layers)
    costmap.update(0.1, AT_ORIGIN)
    assert count(costmap, LETHAL) == left


# -- laws ------------------------------------------------------------------------------------------------------

inside = st.floats(0.01, 9.99)
outside = st.floats(-30.0, 40.0)


@given(inside, inside, outside, outside, st.floats(0.5, 20.0))
def test_a_ray_clears_a_connected_line_that_stays_next_to_the_true_one_and_in_reach(x, y, to_x, to_y, reach):
    costmap, layer = make(
        static=False,
        track_unknown=True,
        sources=[SourceConfig('ray', clearing=True, marking=False, raytrace_range=reach)],
    )
    see(layer, to_x, to_y, 0.0, (x, y, 0.0), source='ray')
    costmap.update(0.0, None)
    rows, columns = np.nonzero(costmap.costmap.costs == FREE)
    assert [math.floor(y), math.floor(x)] in np.column_stack([rows, columns]).tolist()
    assert len(rows) == max(np.ptp(rows), np.ptp(columns)) + 1
    assert np.hypot(rows - math.floor(y), columns - math.floor(x)).max() <= math.ceil(reach)
    dx, dy = to_x - x, to_y - y
    length = math.hypot(dx, dy)
    if length > 0.0:
        off = np.abs((columns + 0.5 - x) * dy - (rows + 0.5 - y) * dx) / length
        assert off.max() < 2.0


@given(st.lists(st.tuples(outside, outside, st.floats(-1.0, 3.0)), min_size=1, max_size=30), inside, inside)
def test_points_are_marked_where_they_are_when_near_and_low_enough(points, x, y):
    source = SourceConfig('far', obstacle_range=6.0, min_obstacle_height=0.0, max_obstacle_height=2.5)
    costmap, layer = make(static=False, sources=[source], max_obstacle_height=1.5)
    layer.add_observation(Observation('far', 0.0, (x, y, 0.5), np.array(points)))
    costmap.update(0.0, None)
    expected = {
        (math.floor(px), math.floor(py))
        for px, py, pz in points
        if 0.0 <= pz <= 1.5
        and (px - x) ** 2 + (py - y) ** 2 + (pz - 0.5) ** 2 < 36.0
        and 0.0 <= px < 10.0
        and 0.0 <= py < 10.0
    }
    rows, columns = np.nonzero(costmap.costmap.costs == LETHAL)
    assert set(zip(columns.tolist(), rows.tolist())) == expected


@given(st.floats(-3.0, 13.0), st.floats(-3.0, 13.0), st.floats(-4.0, 4.0))
def test_the_footprint_is_free_wherever_the_robot_stands(x, y, yaw):
    corners = np.array([[2.0, 1.0], [2.0, -1.0], [-2.0, -1.0], [-2.0, 1.0]])
    costmap, layer = make(static=False, footprint=corners)
    layer.costs[:] = LETHAL
    costmap.update(0.0, Pose2D(x, y, yaw))
    g = costmap.geometry
    for along, aside in np.random.default_rng(0).uniform((-2.0, -1.0), (2.0, 1.0), (50, 2)):
        there = Pose2D(x, y, yaw).compose(Pose2D(along, aside, 0.0))
        cell = g.to_cell(there.x, there.y)
        if cell is not None and math.hypot(along / 2.0, aside) < 0.5:
            assert costmap.costmap.costs[cell[1], cell[0]] == FREE
    for column, row in np.ndindex(10, 10):
        local = Pose2D(x, y, yaw).inverse().compose(Pose2D(*g.to_world(column, row), 0.0))
        if abs(local.x) > 2.0 + 1.5 or abs(local.y) > 1.0 + 1.5:
            assert costmap.costmap.costs[row, column] == LETHAL


# -- parameters ------------------------------------------------------------------------------------------------


def test_combining_by_overwriting_by_the_maximum_and_not_at_all():
    found = {}
    for method in (0, 1, 99):
        costmap, layer = make(combination_method=method)
        layer.costs[:] = UNKNOWN
        layer.costs[2, 3], layer.costs[9, 9] = FREE, LETHAL
        costmap.update(0.0, None)
        found[method] = (costmap.costmap.costs[2, 3], costmap.costmap.costs[9, 9], count(costmap, LETHAL))
    assert found == {0: (FREE, LETHAL, 20), 1: (LETHAL, LETHAL, 21), 99: (LETHAL, FREE, 20)}


def test_without_footprint_clearing_the_footprint_stays_as_seen():
    corners = np.array([[2.0, 2.0], [2.0, -2.0], [-2.0, -2.0], [-2.0, 2.0]])
    for clearing in (True, False):
        costmap, layer = make(static=False, footprint=corners, footprint_clearing_enabled=clearing)
        see(layer, 5.5, 5.5)
        costmap.update(0.0, Pose2D(5.0, 5.0, 0.0))
        assert count(costmap, LETHAL) == (0 if clearing else 1)


def test_observations_are_kept_as_long_as_asked():
    sources = [SourceConfig('brief', clearing=True), SourceConfig('long', clearing=False, observation_persistence=2.0)]
    costmap, layer = make(static=False, sources=sources)
    for name, x in (('brief', 1.5), ('long', 2.5)):
        see(layer, x, 0.5, source=name, origin=(0.5, 0.5, 0.5))
    costmap.update(0.0, None)
    see(layer, 1.5, 1.5, source='brief', origin=(0.5, 0.5, 0.5), stamp=1.0)
    layer.costs[:] = FREE
    costmap.touch_all()
    costmap.update(1.0, None)
    assert [costmap.costmap.costs[0, 1], costmap.costmap.costs[1, 1], costmap.costmap.costs[0, 2]] == [
        FREE,
        LETHAL,
        LETHAL,
    ]
    layer.costs[:] = FREE
    costmap.touch_all()
    costmap.update(2.5, None)
    assert costmap.costmap.costs[0, 2] == FREE


@pytest.mark.parametrize('persistence, kept', [(0.0, 1), (2.0, 5)])
def test_while_nothing_is_updated_no_more_observations_are_kept_than_persist(persistence, kept):
    costmap, layer = make(static=False, sources=[SourceConfig('scan', observation_persistence=persistence)])
    for k in range(100):
        see(layer, 1.5, 0.5, source='scan', stamp=0.5 * k)
    assert len(layer._seen['scan']) == kept


def test_a_layer_that_is_switched_off_keeps_nothing_and_is_not_silent_when_it_is_switched_on():
    source = SourceConfig('scan', observation_persistence=100.0, expected_update_rate=0.5)
    costmap, layer = make(static=False, sources=[source])
    see(layer, 1.5, 0.5, source='scan')
    layer.reconfigure(dataclasses.replace(layer.config, enabled=False))
    for k in range(1, 10):
        see(layer, 0.5, 1.5, source='scan', stamp=float(k))
        costmap.update(float(k), None)
    assert layer._seen['scan'] == []
    layer.reconfigure(dataclasses.replace(layer.config, enabled=True))
    costmap.update(9.1, None)
    assert costmap.current(9.1) == '' and count(costmap, LETHAL) == 0
    see(layer, 1.5, 1.5, source='scan', stamp=9.2)
    costmap.update(9.2, None)
    assert count(costmap, LETHAL) == 1


def test_a_source_that_falls_silent_is_told_of():
    costmap, layer = make(sources=[SourceConfig('scan', data_type='LaserScan', expected_update_rate=0.5)])
    costmap.update(10.0, None)
    assert costmap.current(10.4) == ''
    assert 'LaserScan on scan silent for 0.6 s (expected_update_rate 0.5 s)' in costmap.current(10.6)
    see(layer, 1.0, 1.0, source='scan', stamp=10.6)
    assert costmap.current(10.6) == ''
    costmap.update(10.7, None)
    assert costmap.current(11.0) == '' and costmap.current(11.3) != ''


def test_observations_that_make_no_sense_are_dropped_and_counted():
    costmap, layer = make()
    costmap.update(0.0, AT_ORIGIN)
    good = Observation('far', 5.0, (0.5, 0.5, 0.5), np.array([[3.5, 3.5, 0.5]]))
    layer.add_observation(good)
    for kind, wrong in (
        ('unknown_sources', Observation('nobody', 5.0, good.origin, good.points)),
        ('bad_clouds', Observation('far', 5.0, good.origin, np.zeros(3))),
        ('bad_poses', Observation('far', 5.0, (math.nan, 0.0, 0.0), good.points)),
        ('bad_poses', Observation('far', math.inf, good.origin, good.points)),
        ('old_observations', Observation('far', 4.0, good.origin, good.points)),
        ('bad_points', Observation('far', 6.0, good.origin, np.array([[math.nan, 1.0, 0.0], [6.5, 6.5, math.inf]]))),
    ):
        before = layer.counts[kind]
        layer.add_observation(wrong)
        assert layer.counts[kind] == before + 1 and layer.problem
    costmap.update(6.0, AT_ORIGIN)
    assert count(costmap, LETHAL) == 21
    layer.add_observation(Observation('far', 7.0, (-3.0, 0.0, 0.0), np.array([[1.5, 1.5, 0.5]])))
    costmap.update(7.0, AT_ORIGIN)
    assert layer.counts['sensors_off_the_map'] == 1


def test_a_window_that_is_not_about_the_robot_yet_is_no_complaint():
    """At the start its corner is at the origin, and a scanner behind the robot's middle off it."""
    source = SourceConfig('scan', clearing=True, marking=True)
    layer = ObstacleLayer('obstacles', ObstacleConfig(sources=(source,)))
    config = CostmapConfig(rolling_window=True, width=4, height=4)
    costmap = LayeredCostmap(config, [layer], np.ones((1, 2)))
    layer.add_observation(Observation('scan', 0.0, (-0.03, 0.0, 0.2), np.array([[1.0, 0.0, 0.2]])))
    costmap.update(0.0, None)
    assert layer.counts['sensors_off_the_map'] == 0
    costmap.update(0.1, Pose2D(0.0, 0.0, 0.0))
    assert layer.counts['sensors_off_the_map'] == 0 and count(costmap, LETHAL) == 1


def test_when_time_goes_back_old_stamps_hinder_nothing():
    costmap, layer = make()
    see(layer, 1.5, 1.5, stamp=100.0)
    costmap.update(100.0, AT_ORIGIN)
    costmap.update(3.0, AT_ORIGIN)
    see(layer, 3.5, 3.5, stamp=3.0)
    costmap.update(3.1, AT_ORIGIN)
    assert layer.counts['old_observations'] == 0 and costmap.costmap.costs[3, 3] == LETHAL


def rolling(**parameters):
    """(LayeredCostmap, its ObstacleLayer) of 6 x 6 m that follows the robot, with the source scan."""
    sources = (SourceConfig('scan'),)
    layer = ObstacleLayer('obstacles', ObstacleConfig(sources=sources, footprint_clearing_enabled=False, **parameters))
    config = CostmapConfig(rolling_window=True, resolution=0.1, width=6.0, height=6.0)
    return LayeredCostmap(config, [layer], np.ones((1, 2))), layer


def test_a_rolling_window_takes_what_was_seen_along():
    costmap, layer = rolling()
    costmap.update(0.0, AT_ORIGIN)
    see(layer, 1.05, 0.55, source='scan')
    costmap.update(0.1, AT_ORIGIN)
    layer.forget_observations()
    for step in range(6):
        costmap.update(0.2 + step, Pose2D(0.4 * step, -0.3 * step, 0.0))
        assert costmap.costmap.cost_at(1.05, 0.55) == LETHAL and count(costmap, LETHAL) == 1


# -- what the map shows already ----------------------------------------------------------------------------------


@given(st.floats(0.05, 9.95), st.floats(0.05, 9.95), st.floats(0.0, 1.0))
def test_a_point_marks_nothing_where_the_map_explains_it(x, y, tolerance):
    """ten_by_ten's obstacles are cells of a metre: what is within the tolerance of one adds none."""
    costmap, layer = make(ignore_mapped=True, mapped_tolerance=tolerance)
    occupied = np.argwhere(costmap.layers['static_map'].costs == LETHAL)
    off = min(
        math.hypot(max(abs(x - column - 0.5) - 0.5, 0.0), max(abs(y - row - 0.5) - 0.5, 0.0))
        for row, column in occupied
    )
    see(layer, x, y)
    costmap.update(0.0, AT_ORIGIN)
    assert int((layer.costs == LETHAL).sum()) == (off > tolerance)


def test_the_ray_to_a_mapped_wall_clears_all_the_same():
    costmap, layer = make(ignore_mapped=True)
    layer.costs[0, 3] = LETHAL
    see(layer, 7.5, 0.5, origin=(0.5, 0.5, 1.0))
    costmap.update(0.0, AT_ORIGIN)
    assert layer.costs[0, 3] == FREE and layer.costs[0, 7] != LETHAL


# -- what is forgotten -------------------------------------------------------------------------------------------

ONCE = SourceConfig('once', clearing=True, obstacle_range=100.0, raytrace_range=100.0)


def test_a_mark_that_is_not_made_again_is_forgotten_after_its_time():
    costmap, layer = make(static=False, sources=(ONCE,), pixel_decay=2.0)
    see(layer, 5.5, 5.5, source='once')
    see(layer, 8.5, 3.5, source='once', stamp=1.0)
    for t, left in ((1.0, {(8, 3)}), (2.9, {(8, 3)}), (3.1, set())):
        costmap.update(t, AT_ORIGIN)
        assert {(x, y) for y, x in np.argwhere(costmap.costmap.costs == LETHAL)} == left
    see(layer, 8.5, 3.5, source='once', stamp=4.0)
    costmap.update(4.0, AT_ORIGIN)
    see(layer, 8.5, 3.5, source='once', stamp=5.5)
    costmap.update(5.5, AT_ORIGIN)
    costmap.update(7.0, AT_ORIGIN)
    assert count(costmap, LETHAL) == 1, 'seen again it stays'


def test_what_was_seen_in_the_future_is_forgotten_as_if_it_was_seen_now():
    costmap, layer = make(static=False, sources=(ONCE,), pixel_decay=2.0)
    see(layer, 5.5, 5.5, stamp=1e9, source='once')
    costmap.update(0.0, AT_ORIGIN)
    layer.forget_observations()
    costmap.update(1.9, AT_ORIGIN)
    assert count(costmap, LETHAL) == 1
    costmap.update(2.1, AT_ORIGIN)
    assert count(costmap, LETHAL) == 0


@pytest.mark.parametrize('track_unknown, after', [(True, UNKNOWN), (False, FREE)])
def test_what_is_forgotten_is_what_nothing_is_known_of(track_unknown, after):
    costmap, layer = make(static=False, track_unknown=track_unknown, sources=(ONCE,), pixel_decay=2.0)
    see(layer, 5.5, 5.5, source='once')
    costmap.update(0.0, AT_ORIGIN)
    assert costmap.costmap.costs[5, 5] == LETHAL
    costmap.update(2.5, AT_ORIGIN)
    assert costmap.costmap.costs[5, 5] == after


def test_marks_that_roll_along_are_forgotten_in_time():
    costmap, layer = rolling(pixel_decay=2.0)
    costmap.update(0.0, AT_ORIGIN)
    see(layer, 1.05, 0.55, source='scan')
    costmap.update(0.1, AT_ORIGIN)
    layer.forget_observations()
    for t, marks in ((1.0, 1), (1.9, 1), (2.1, 0)):
        costmap.update(t, Pose2D(0.8 * t, -0.6 * t, 0.0))
        assert count(costmap, LETHAL) == marks


def test_who_passes_leaves_no_marks_and_what_stood_there_before_stays():
    costmap, layer = make(static=False, sources=(ONCE,), passing_memory=1.0)
    for stamp, place in ((0.0, (5.5, 5.5)), (2.0, (8.5, 3.5)), (2.5, (7.5, 3.5))):
        see(layer, *place, stamp=stamp, source='once')
        costmap.update(stamp, AT_ORIGIN)
    layer.let_pass(2.6)
    for stamp in (2.7, 3.5):
        see(layer, 6.5, 3.5, stamp=stamp, source='once')
        costmap.update(stamp, AT_ORIGIN)
        assert [tuple(cell) for cell in np.argwhere(costmap.costmap.costs == LETHAL)] == [(5, 5)]
    see(layer, 6.5, 3.5, stamp=3.7, source='once')
    costmap.update(3.7, AT_ORIGIN)
    assert costmap.costmap.costs[3, 6] == LETHAL, 'what stays is marked'


def test_after_the_clock_was_set_back_points_mark_and_are_forgotten_by_the_new_clock():
    costmap, layer = make(static=False, sources=(ONCE,), passing_memory=5.0, pixel_decay=2.0)
    see(layer, 5.5, 5.5, stamp=100.0, source='once')
    costmap.update(100.0, AT_ORIGIN)
    layer.let_pass(101.0)
    costmap.update(1.0, AT_ORIGIN)
    layer.time_went_back(1.0)
    see(layer, 8.5, 3.5, stamp=1.1, source='once')
    costmap.update(1.1, AT_ORIGIN)
    assert costmap.costmap.costs[3, 8] == LETHAL
    costmap.update(3.2, AT_ORIGIN)
    assert count(costmap, LETHAL) == 0


def test_times_are_kept_only_where_they_are_asked_for():
    costmap, layer = make(static=False, sources=(ONCE,))
    see(layer, 5.5, 5.5, source='once')
    costmap.update(0.0, AT_ORIGIN)
    costmap.update(1e6, AT_ORIGIN)
    assert count(costmap, LETHAL) == 1, 'never forgotten'
    layer.reconfigure(dataclasses.replace(layer.config, pixel_decay=2.0))
    costmap.update(1e6 + 0.1, AT_ORIGIN)
    assert count(costmap, LETHAL) == 0, 'nobody knows since when'
    for name in ('pixel_decay', 'passing_memory'):
        assert name in ObstacleConfig(**{name: -1.0}).faults()[0]


# -- who walks does not count --------------------------------------------------------------------------------------


def places(costmap):
    """{(x, y)} of the cells that are lethal in the costmap."""
    return {(x, y) for y, x in np.argwhere(costmap.costmap.costs == LETHAL)}


@pytest.mark.parametrize('track_unknown', [True, False])
def test_what_stands_counts_after_a_while_and_who_walks_does_not(track_unknown):
    costmap, layer = make(static=False, track_unknown=track_unknown, sources=(ONCE,), mark_after=1.0)
    for k in range(41):
        t = 0.1 * k
        walks = 1.5 + 2.0 * t, 8.5
        seen = np.array([[9.5, 4.5, 0.0], [*walks, 0.0]])
        layer.add_observation(Observation('once', t, (0.0, 0.0, 1.0), seen))
        costmap.update(t, AT_ORIGIN)
        assert places(costmap) == ({(9, 4)} if k >= 10 else set())
    assert (layer.costs == LETHAL).sum() > 1, 'the layer itself knows of both'
    for k in range(41, 61):  # who walked stands
        see(layer, 8.5, 8.5, stamp=0.1 * k, source='once')
        costmap.update(0.1 * k, AT_ORIGIN)
    assert (8, 8) in places(costmap)
    see(layer, 9.5, 9.5, stamp=6.1, source='once')
    costmap.update(6.1, AT_ORIGIN)
    assert (8, 8) not in places(costmap), 'a ray has passed there'


def test_what_is_seen_now_and_then_does_not_stand():
    costmap, layer = make(static=False, sources=(ONCE,), mark_after=1.0)
    for k in range(10):
        see(layer, 5.5, 5.5, stamp=0.7 * k, source='once')
        costmap.update(0.7 * k, AT_ORIGIN)
        assert not places(costmap)


def test_what_stands_rolls_along():
    costmap, layer = rolling(mark_after=1.0)
    for k in range(16):
        see(layer, 1.05, 0.55, stamp=0.1 * k, source='scan')
        costmap.update(0.1 * k, Pose2D(0.1 * k, -0.1 * k, 0.0))
        assert count(costmap, LETHAL) == (k >= 10)
