"""Echoes that the map explains: laws over walls, cones and frames, and what the range layer makes of them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.config.parameters import Parameters
from sara_nav.costmaps.costmap import LETHAL
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.mapped_echo import Mapped, explained
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorConfig, RangeSensorLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.costmaps.observations import Observation
from sara_nav.grids.grid import Grid, GridGeometry
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base.settings import read_costmap

SIZE, HALF, TOLERANCE = 0.05, math.radians(30.0), 0.2
STEEPEST = math.radians(70.0)
HERE = Pose2D(0.0, 0.0, 0.0)
angles, places = st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0)


def grid(*cells):
    """Return a map of 8 x 8 m about the origin with these (x, y), m, occupied."""
    costs = np.zeros((160, 160), np.uint8)
    for x, y in cells:
        costs[int((y + 4.0) / SIZE), int((x + 4.0) / SIZE)] = 254
    return costs


def wall(x0, y0, xn, yn):
    """Return the map of a straight wall between two places (m)."""
    n = int(math.hypot(xn - x0, yn - y0) / (0.5 * SIZE)) + 1
    return grid(*zip(np.linspace(x0, xn, n), np.linspace(y0, yn, n)))


def known(costs, at, distance, near=False, frame=HERE, tolerance=TOLERANCE, steepest=math.pi / 2):
    """Return whether the map explains one echo, the sensor at a Pose2D of the frame."""
    mapped = Mapped(costs, Grid(-4.0, -4.0, SIZE), (frame.x, frame.y, frame.yaw), float(tolerance), math.cos(steepest))
    return bool(explained(mapped, np.array([[at.x, at.y, at.yaw, distance, HALF, 0.0]]), np.array([near]))[0])


def centre(x, y):
    """Return the centre of the cell that a place lies in."""
    return tuple((math.floor(v / SIZE) + 0.5) * SIZE for v in (x, y))


# -- the kernel --------------------------------------------------------------------------------------------------------


@given(places, places, angles, st.floats(0.3, 2.4), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), angles)
def test_what_stands_in_the_cone_explains_its_echo_however_the_pose_is_off_within_the_tolerance(
    x, y, yaw, distance, off, share, way
):
    bearing = yaw + off * HALF
    cell = centre(x + distance * math.cos(bearing), y + distance * math.sin(bearing))
    seen = math.dist(cell, (x, y))
    wrong = 0.99 * abs(share) * (TOLERANCE - 0.75 * SIZE)
    at = Pose2D(x + wrong * math.cos(way), y + wrong * math.sin(way), yaw)
    assert known(grid(cell), at, seen)
    assert known(grid(cell), at, seen, near=True)


@given(places, places, angles, st.floats(0.3, 2.0), places, places)
def test_what_is_further_than_the_tolerance_from_the_arc_explains_nothing(x, y, yaw, distance, u, v):
    cell = centre(2.0 * u, 2.0 * v)
    bearings = yaw + np.linspace(-HALF, HALF, 400)
    gap = np.hypot(x + distance * np.cos(bearings) - cell[0], y + distance * np.sin(bearings) - cell[1]).min()
    assert known(grid(cell), Pose2D(x, y, yaw), distance) == (gap <= TOLERANCE) or abs(gap - TOLERANCE) < 1e-4


@settings(max_examples=100)
@given(places, places, angles, st.floats(0.2, 2.4), places, places, angles)
def test_it_does_not_matter_which_frame_the_reading_is_in(x, y, yaw, distance, u, v, turned):
    frame, at, costs = Pose2D(u, v, turned), Pose2D(x, y, yaw), wall(1.5, -2.0, 1.5, 2.0)
    assert known(costs, at, distance, tolerance=0.2 + 1e-9) or not known(
        costs, frame.inverse().compose(at), distance, frame=frame
    )
    assert not known(costs, at, distance, tolerance=0.2 - 1e-9) or known(
        costs, frame.inverse().compose(at), distance, frame=frame
    )


@settings(max_examples=100)
@given(st.floats(0.3, 2.4), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
def test_more_tolerance_explains_more_and_nothing_is_explained_by_an_empty_map(distance, tolerance, more):
    costs = wall(1.5, -2.0, 1.5, 2.0)
    assert known(costs, HERE, distance, tolerance=tolerance + more) or not known(
        costs, HERE, distance, tolerance=tolerance
    )
    assert not known(grid(), HERE, distance) and not known(grid(), HERE, 0.16, near=True)


@pytest.mark.parametrize('turn', np.radians([0.0, 17.0, 45.0, 90.0, -120.0]))
def test_a_wall_along_the_beam_explains_nothing_but_its_end_and_its_face_do(turn):
    c, s = math.cos(turn), math.sin(turn)

    def turned(*places):
        return [v for x, y in zip(places[::2], places[1::2]) for v in (c * x - s * y, s * x + c * y)]

    axis = Pose2D(0.0, 0.0, turn)
    along = wall(*turned(-1.5, 0.4, 3.0, 0.4))
    assert known(along, axis, 1.2) and not known(along, axis, 1.2, steepest=STEEPEST), (
        'the side of a corridor throws the beam away'
    )
    assert known(wall(*turned(1.2, 0.4, 3.0, 0.4)), axis, 1.2, steepest=STEEPEST), 'the end of a wall echoes'
    assert known(wall(*turned(1.2, -1.0, 1.2, 1.0)), axis, 1.2, steepest=STEEPEST), 'a wall across the beam echoes'
    assert known(grid(turned(1.2, 0.4)), axis, 1.25, steepest=STEEPEST), 'a post echoes'


# -- the layer ---------------------------------------------------------------------------------------------------------


def make(data, rolling=False, **parameters):
    """Return (LayeredCostmap, its range layer) over a map of 8 x 8 m about the origin."""
    layer = RangeSensorLayer(
        'ultrasonic', RangeSensorConfig(**dict(dict(topics=('/a',), ignore_mapped=True), **parameters))
    )
    static = StaticLayer('static')
    result = LayeredCostmap(
        CostmapConfig(width=6.0, height=6.0, rolling_window=rolling), [static, layer], np.ones((1, 2))
    )
    static.set_map(GridMap(np.where(data == 254, 100, 0).astype(np.int8), GridGeometry(160, 160, SIZE, -4.0, -4.0)))
    result.update(0.0, HERE)
    return result, layer


def say(costmap, layer, distance, t=0.0, times=4, at=HERE):
    for _ in range(times):
        layer.add_range(RangeReading('/a', t, at.x, at.y, at.yaw, distance, 0.16, 2.5, 2.0 * HALF))
    costmap.update(t, HERE)


def door():
    """Return a wall across the way at x = 1 with a door of 0.80 m about y = 0."""
    return np.maximum(wall(1.0, -3.0, 1.0, -0.42), wall(1.0, 0.42, 1.0, 3.0))


@pytest.mark.parametrize('rolling', [False, True])
def test_the_edges_of_a_door_do_not_close_it_and_without_the_option_they_do(rolling):
    distance = math.hypot(1.0, 0.425)
    costmap, layer = make(door(), rolling)
    say(costmap, layer, distance)
    assert not (layer.probabilities > 0.5).any()
    assert costmap.costmap.cost_at(distance, 0.0) != LETHAL
    costmap, layer = make(door(), rolling, ignore_mapped=False)
    say(costmap, layer, distance)
    assert costmap.costmap.cost_at(distance, 0.0) == LETHAL


@pytest.mark.parametrize('rolling', [False, True])
def test_a_box_before_the_door_is_marked_and_cleared_when_it_is_gone(rolling):
    costmap, layer = make(door(), rolling)
    say(costmap, layer, 0.6)
    assert costmap.costmap.cost_at(0.6, 0.0) == LETHAL
    say(costmap, layer, math.hypot(1.0, 0.425), t=0.2)
    assert costmap.costmap.cost_at(0.6, 0.0) != LETHAL, (
        'what echoes from the door lets one see that the way up to it is free'
    )


def test_too_near_beside_something_of_the_map_marks_nothing_and_elsewhere_it_does():
    for x, marked in ((0.3, False), (0.5, True)):
        costmap, layer = make(wall(x, -1.0, x, 1.0))
        say(costmap, layer, -math.inf)
        assert (layer.probabilities > 0.8).any() == marked


def test_a_map_that_has_not_come_explains_nothing():
    layer = RangeSensorLayer('ultrasonic', RangeSensorConfig(topics=('/a',), ignore_mapped=True))
    costmap = LayeredCostmap(
        CostmapConfig(width=6.0, height=6.0, origin_x=-3.0, origin_y=-3.0),
        [StaticLayer('static'), layer],
        np.ones((1, 2)),
    )
    say(costmap, layer, 1.0)
    assert costmap.costmap.cost_at(1.0, 0.0) == LETHAL


def sonars_with(parameter):
    """The Parameters of a costmap that was read, of range sensors alone with a parameter set."""
    layer = {'name': 'sonars', 'type': 'range_sensor_layer::RangeSensorLayer'}
    tree = Parameters({'c': {'plugins': [layer], 'sonars': {parameter: True}}})
    read_costmap(tree, 'c/', robot_radius=0.3)
    return tree


def test_parameters_are_checked_and_one_without_a_map_is_said():
    assert RangeSensorConfig(mapped_tolerance=-0.1).faults() == [
        'mapped_tolerance is -0.1, allowed are numbers from 0 to 10'
    ]
    assert 'mapped_steepest' in RangeSensorConfig(mapped_steepest=2.0).faults()[0]
    tree = sonars_with('ignore_mapped')
    assert 'parameter c/sonars/ignore_mapped has no effect: the costmap has no costmap_2d::StaticLayer' in tree.warnings


# -- ignore_seen: what an obstacle layer has marked --------------------------------------------------------------------


def seen_door(ignore_seen, enabled=True):
    """(LayeredCostmap without a map, its range layer): a laser has seen the jambs of a door of 0.8 m at 1.4 m."""
    sonars = RangeSensorLayer('ultrasonic', RangeSensorConfig(topics=('/a',), ignore_seen=ignore_seen))
    source = SourceConfig('scan', clearing=True)
    laser = ObstacleLayer('laser', ObstacleConfig(sources=(source,), footprint_clearing_enabled=False, enabled=enabled))
    costmap = LayeredCostmap(
        CostmapConfig(width=6.0, height=6.0, origin_x=-3.0, origin_y=-3.0, resolution=0.05),
        [sonars, laser],
        np.ones((1, 2)),
    )
    jambs = np.array([[1.4, side * y, 0.25] for side in (1, -1) for y in np.arange(0.42, 1.5, 0.02)])
    laser.add_observation(Observation('scan', 0.0, (0.0, 0.0, 0.25), jambs))
    costmap.update(0.0, None)
    return costmap, sonars


@pytest.mark.parametrize(
    'ignore_seen, enabled, closed', [(True, True, False), (False, True, True), (True, False, True)]
)
def test_the_echo_of_jambs_that_a_laser_sees_does_not_close_the_door(ignore_seen, enabled, closed):
    costmap, sonars = seen_door(ignore_seen, enabled)
    echo = math.hypot(1.4, 0.42)
    for k in range(1, 6):
        sonars.add_range(RangeReading('/a', 0.2 * k, 0.0, 0.0, 0.0, echo, 0.16, 2.5, math.radians(60.0)))
        costmap.update(0.2 * k, None)
    middle = [costmap.costmap.cost_at(x, 0.0) for x in np.arange(1.3, 1.6, 0.05)]
    assert (LETHAL in middle) == closed
    assert not enabled or costmap.costmap.cost_at(1.42, 0.5) == LETHAL, 'the jamb'


def test_an_echo_of_what_the_laser_does_not_see_marks():
    costmap, sonars = seen_door(True)
    for k in range(1, 6):
        sonars.add_range(RangeReading('/a', 0.2 * k, 0.0, 0.0, 0.0, 0.9, 0.16, 2.5, math.radians(60.0)))
        costmap.update(0.2 * k, None)
    assert costmap.costmap.cost_at(0.9, 0.0) == LETHAL, "a table's edge"


def test_ignore_seen_without_an_obstacle_layer_is_said():
    tree = sonars_with('ignore_seen')
    assert 'parameter c/sonars/ignore_seen has no effect: the costmap has no costmap_2d::ObstacleLayer' in tree.warnings
