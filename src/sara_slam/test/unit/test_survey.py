"""Exploring by range sensors with wide cones: what they hear of the border on the unknown, and from where most."""

import math

import numpy as np
import pytest
from slam_world import CELL
from test_exploring import FOOTPRINT, START, House, costmap, hall

from sara_common.config import ConfigError
from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import FREE, LETHAL, UNKNOWN, Grid, GridGeometry
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.lattice.planner import LatticePlanner
from sara_slam.exploring import survey as survey_module
from sara_slam.exploring import tried_places
from sara_slam.exploring.cones import (
    FREE_CELL,
    RAYS,
    UNKNOWN_CELL,
    WALL_CELL,
    Cells,
    borders_heard,
    mark_seen,
    strides,
)
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.explorer import Explorer
from sara_slam.exploring.frontiers import frontiers
from sara_slam.exploring.ground import with_obstacles
from sara_slam.exploring.orders import Drive, State
from sara_slam.exploring.survey import AGAIN, Survey
from sara_slam.exploring.wall_normals import normals

CONE = math.radians(60.0)
FANS = [
    (0.5, 0.2, 0.0),
    (0.5, -0.2, 0.0),
    (-0.5, 0.0, 3.14),
    (0.3, 0.3, 1.57),
    (-0.3, 0.3, 1.57),
    (0.3, -0.3, -1.57),
    (-0.3, -0.3, -1.57),
]
AROUND = [(x, y, yaw) for x, y, yaw in ((0.4, 0.0, 0.0), (0.0, 0.3, 1.57), (0.0, -0.3, -1.57), (-0.4, 0.0, 3.14))]


def heard(kinds, sensor, farthest=1.5):
    """Indices of the cells (row, column) of borders that a sensor (x, y, axis) hears; the borders' normal is -x."""
    kinds = np.array(kinds, np.uint8)
    toward, aside = -np.ones(kinds.shape, np.float32), np.zeros(kinds.shape, np.float32)
    cells = Cells(kinds, toward, aside, strides(kinds), Grid(0.0, 0.0, CELL))
    places, far = np.empty((1, RAYS), np.int32), np.empty((1, RAYS), np.float32)
    borders_heard(cells, np.array([[*sensor, 0.5 * CONE]]), farthest, places, far)
    return sorted({divmod(int(place), kinds.shape[1]) for place in places[places >= 0]})


def strip(known=1.0):
    """Free up to an x (m), unknown beyond."""
    kinds = np.full((60, 60), FREE_CELL)
    kinds[:, round(known / CELL) :] = UNKNOWN_CELL
    return kinds


def survey(sensors=AROUND):
    found = Survey(1.5)
    for mount in sensors:
        found.add_sensor(mount, CONE)
    return found


def planner():
    found = LatticePlanner(LatticePlannerConfig())
    found.set_footprint(FOOTPRINT)
    return found


def test_a_border_is_heard_where_a_sensor_faces_it_squarely():
    cells = heard(strip(), (0.2, 1.5, 0.0))
    assert cells and all(column == 19 for _, column in cells)
    assert all(abs((row + 0.5) * CELL - 1.5) < 0.8 * math.tan(0.41) + CELL for row, _ in cells)
    assert heard(strip(), (0.2, 1.5, math.radians(70.0))) == []
    assert heard(strip(2.0), (0.2, 1.5, 0.0)) == []  # farther than it reaches
    assert heard(strip(0.3), (0.2, 1.5, 0.0))  # a wall beyond is farther off than the border
    assert heard(strip(), (2.0, 1.5, 0.0)) == []  # it sits in the unknown


@pytest.mark.parametrize('turned', [0.0, 0.5])
def test_a_wall_behind_a_border_lies_as_most_walls_do(turned):
    """A border that lies askew, where a fan ended, in a hall that is turned in its map."""
    y, x = (CELL * (np.mgrid[:120, :120] + 0.5) - 3.0).reshape(2, -1)
    x, y = math.cos(turned) * x + math.sin(turned) * y, math.cos(turned) * y - math.sin(turned) * x
    walls, beyond = np.maximum(np.abs(x), np.abs(y)) > 1.9, x + 0.4 * y > 1.0
    kinds = np.where(beyond, UNKNOWN_CELL, np.where(walls, WALL_CELL, FREE_CELL)).astype(np.uint8)
    for of, most in ((kinds, 0.03), (np.where(walls, FREE_CELL, kinds), None)):
        nx, ny = normals(of.reshape(120, 120))
        at = np.argmin(np.hypot(x - 1.05, y))
        off = math.remainder(math.atan2(ny.ravel()[at], nx.ravel()[at]) - turned - math.pi, 2.0 * math.pi)
        assert abs(off) < most if most else abs(off - math.atan(0.4)) < 0.1


def test_a_wall_that_is_nearer_in_the_cone_is_heard_instead():
    kinds = strip()
    kinds[34:60, 10:12] = WALL_CELL  # at 0.5 m, in the upper part of the cone
    assert heard(kinds, (0.1, 1.5, 0.0)) == []
    kinds = strip()
    kinds[54:60, 10:12] = WALL_CELL  # beside the cone
    assert heard(kinds, (0.1, 1.5, 0.0))


@pytest.mark.parametrize('seed', range(3))
def test_rays_hear_the_same_borders_in_long_strides_through_free_space(seed):
    random = np.random.default_rng(seed)
    kinds, angles = np.full((80, 80), FREE_CELL, np.uint8), random.uniform(-math.pi, math.pi, (80, 80))
    for kind in (WALL_CELL, UNKNOWN_CELL):
        rows, columns = random.integers(0, 80, (2, 40))
        kinds[rows, columns] = kind
    sensors = np.column_stack((random.uniform(0.0, 4.0, (999, 2)), random.uniform(-4.0, 4.0, 999), np.full(999, 0.5)))
    far_apart, found = strides(kinds), []
    for steps in (np.ones_like(far_apart), far_apart):
        cells = Cells(kinds, *(of(angles).astype(np.float32) for of in (np.cos, np.sin)), steps, Grid(0.0, 0.0, CELL))
        found.append((np.empty((999, RAYS), np.int32), np.empty((999, RAYS), np.float32)))
        borders_heard(cells, sensors, 2.0, *found[-1])
    assert far_apart.max() > 4 and (found[0][0] >= 0).sum() > 30
    assert all(np.array_equal(one, other) for one, other in zip(*found))


def test_what_is_in_sight_ends_at_walls_at_the_unknown_and_where_it_is_far():
    kinds = np.full((60, 60), FREE_CELL, np.uint8)
    kinds[:, 40:] = UNKNOWN_CELL
    kinds[20:40, 20] = WALL_CELL
    seen, flat = np.zeros(kinds.shape, bool), np.zeros(kinds.shape, np.float32)
    mark_seen(Cells(kinds, flat, flat, strides(kinds), Grid(0.0, 0.0, CELL)), np.array([[0.5, 1.5]]), 1.0, seen)
    assert seen[30, 10:20].all() and not seen[30, 20:].any()  # before and behind a wall
    assert seen[12:48, 10].all() and not seen[8, 10] and not seen[52, 10]  # 1.0 m
    mark_seen(Cells(kinds, flat, flat, strides(kinds), Grid(0.0, 0.0, CELL)), np.array([[1.5, 1.5]]), 2.0, seen)
    assert seen[30, 21:40].all() and not seen[:, 40:].any()


def test_what_has_been_passed_is_finished_first_and_when_little_time_is_left_nothing_else_is():
    ground = hall(6.0)
    ground.costs[:, :16] = UNKNOWN  # at the near end
    ground.costs[1:-1, -24:-1] = UNKNOWN  # at the far one, of which more is heard
    ends = []
    for passed in (False, True):
        found = survey()
        found.on_costmap(ground, [])
        if passed:
            found.at(Pose2D(1.5, 2.0, 1.57))
        start = Pose2D(3.0, 2.0, 0.0)
        ends.append(found.choose(planner(), FOOTPRINT, start, False).frontier.middle[0])
    assert ends[0] > 4.0 and ends[1] < 1.5
    found = survey()
    found.on_costmap(ground, [])
    found.finish(None)
    assert found.choose(planner(), FOOTPRINT, start, False) is None
    found.forget()
    assert found.choose(planner(), FOOTPRINT, start, False) is not None


def test_with_little_time_left_what_is_on_the_way_home_comes_first_and_nothing_that_takes_longer():
    ground = hall(6.0)
    ground.costs[:, :16] = UNKNOWN  # at home
    ground.costs[1:-1, -24:-1] = UNKNOWN  # at the other end, of which more is heard
    start, home = Pose2D(2.6, 2.0, 0.0), Pose2D(1.5, 2.0, 0.0)
    found = survey()
    found.on_costmap(ground, [])
    found.at(Pose2D(1.5, 2.0, 1.57))
    found.at(Pose2D(4.4, 2.0, 1.57))
    found.forget()

    def next_to(left, start=start):
        choice = found.on_way_home(planner(), FOOTPRINT, start, home, left)
        return choice and choice.frontier.middle[0]

    assert found.choose(planner(), FOOTPRINT, start, False).frontier.middle[0] > 4.0
    assert next_to(100.0) < 1.5 and next_to(12.0) < 1.5 and next_to(3.0) is None
    assert next_to(100.0, Pose2D(4.0, 2.0, 0.0)) > 4.0  # near: it would have to come back
    found.forget()
    assert found.choose(planner(), FOOTPRINT, start, False).frontier.middle[0] > 4.0


def test_what_makes_the_way_home_longer_than_there_is_time_for_is_not_driven_to():
    ground = hall(6.0)
    ground.costs[1:-1, -24:-1] = UNKNOWN
    found = survey()
    found.on_costmap(ground, [])
    found.at(Pose2D(4.4, 2.0, 1.57))

    def next_to(left):
        return found.on_way_home(planner(), FOOTPRINT, Pose2D(2.0, 2.0, 0.0), Pose2D(1.5, 2.0, 0.0), left)

    far = next_to(100.0).pose
    there_and_back = 4.0 + (2.0 * (far.x - 2.0)) / 0.17  # and it need not turn
    assert far.x > 2.5 and next_to(there_and_back + 1.0) and next_to(there_and_back - 3.0) is None


def test_with_little_time_left_it_stays_where_nearly_all_that_is_near_has_been_passed():
    """It has looked into a hall through its door, 2 m from the border of what is known there."""
    costs = np.full((80, 160), FREE, np.uint8)
    costs[[0, -1]] = costs[:, [0, -1]] = LETHAL
    costs[:, 60] = LETHAL
    costs[30:50, 60] = FREE
    costs[:, 94:] = UNKNOWN
    start, places = Pose2D(2.5, 2.0, 0.0), []
    for late in (False, True):
        found = survey()
        found.on_costmap(costmap(costs), [])
        for x in (1.5, 2.0, 2.5):
            found.at(Pose2D(x, 2.0, 0.0))
        found.forget()
        if late:
            found.finish(None)
        places.append(found.choose(planner(), FOOTPRINT, start, False))
    assert places[0].pose.x > 2.8 and places[1] is None
    found.at(Pose2D(2.9, 2.0, 0.0))
    assert found.choose(planner(), FOOTPRINT, start, False) is None  # it does not go on step by step
    found.forget()
    found.finish(None)
    assert 2.8 < found.choose(planner(), FOOTPRINT, start, False).pose.x < 3.2  # from 3.3 m on it is less than 90 %


def test_where_no_way_home_is_known_ways_count_as_they_are():
    ground = hall(6.0)
    ground.costs[:, :16] = UNKNOWN
    ground.costs[:, 40] = LETHAL
    start, found = Pose2D(3.5, 2.0, 0.0), survey()
    found.on_costmap(ground, [])
    found.finish(Pose2D(1.5, 2.0, 0.0))
    assert found.choose(planner(), FOOTPRINT, start, True) is None  # and no warning of NaN


def test_what_could_not_be_reached_is_tried_again_a_few_times_when_nothing_else_is_left(monkeypatch):
    monkeypatch.setattr(tried_places, 'SAME_M', 99.0)  # whatever was tried, all places are near it
    monkeypatch.setattr(tried_places, 'SAME_RAD', 99.0)
    found = survey()
    found.on_costmap(hall(), [])
    first = found.choose(planner(), FOOTPRINT, START, False)
    found.tried(first, False)
    assert found.choose(planner(), FOOTPRINT, START, True) is None  # a robot under way need not
    for _ in range(survey_module.ROUNDS):
        assert found.choose(planner(), FOOTPRINT, START, False).pose == first.pose
        found.tried(first, False)
    assert found.choose(planner(), FOOTPRINT, START, False) is None
    found.tried(first, True)
    found.tried(first, False)
    assert found.choose(planner(), FOOTPRINT, START, False) is None  # it was reached once


def test_it_drives_to_where_the_sensors_face_what_is_not_known():
    ground, found = hall(), survey()
    found.on_costmap(ground, [])
    choice = found.choose(planner(), FOOTPRINT, START, False)
    points = choice.frontier.points
    assert choice.cost < 0.0 and len(points) > 5 and np.allclose(points[:, 0], 3.0 - 0.5 * CELL)
    assert choice.pose.x < 2.5 and found.stays(choice)
    off = np.hypot(points[:, 0] - choice.pose.x, points[:, 1] - choice.pose.y)
    assert off.max() < 1.5 + 0.4 + CELL


def test_less_is_expected_of_what_has_been_faced_in_vain():
    found = survey()
    found.on_costmap(hall(), [])
    choice = found.choose(planner(), FOOTPRINT, START, False)
    column, row = hall().geometry.to_cell(*choice.frontier.middle)
    assert found.expected()[row, column] == 1.0 and not found.given_up(choice.frontier)
    found.at(choice.pose)
    found.at(choice.pose)  # the robot stands: nothing new
    assert found.expected()[row, column] == AGAIN
    for turn in range(8):
        found.at(choice.pose._replace(yaw=choice.pose.yaw + 0.11 * (turn % 2)))
    assert found.stays(choice)  # for what is heard on the way there
    for share in np.tile(np.linspace(0.0, 1.0, 40), 3):
        x, y = START.x + share * (choice.pose.x - START.x), START.y + share * (choice.pose.y - START.y)
        found.at(Pose2D(x, y, math.atan2(choice.pose.y - START.y, choice.pose.x - START.x)))
    assert not found.stays(choice) and found.given_up(choice.frontier)
    found.forget()
    assert found.expected()[row, column] == 1.0


@pytest.mark.parametrize('least, again', [(0.5, True), (9.0, False)])
def test_a_frontier_that_is_left_in_the_end_is_looked_at_as_if_it_had_not_been_faced_but_once(least, again):
    found, ground = survey(), hall()
    found.on_costmap(ground, frontiers(ground, least))
    for _ in range(2):
        for x in np.arange(1.0, 2.5, 0.3):
            for turn in range(30):
                for y in (0.6, 1.0, 1.5, 2.0, 2.5, 3.0, 3.4):
                    found.at(Pose2D(x, y, 0.3 * turn))
        assert found.choose(planner(), FOOTPRINT, START, False) is None
        assert found.looks_again() == again
        choice = found.choose(planner(), FOOTPRINT, START, False)
        assert (choice is not None and choice.frontier.size > 1.0) == again
        again = False
    found.forget()
    assert found.choose(planner(), FOOTPRINT, START, False) is not None


def test_with_nothing_left_the_robot_looks_again_before_it_goes_home():
    house = Sonars()
    looks = []
    house.found.looks_again = lambda: looks.append(house.now) or False
    house.run()
    assert len(looks) == 1 and house.explorer.state is State.DONE and house.pose == START


def test_what_was_faced_is_known_on_a_map_that_has_grown():
    found, ground = survey(), hall()
    found.on_costmap(ground, [])
    choice = found.choose(planner(), FOOTPRINT, START, False)
    found.at(choice.pose)
    before = found.expected()
    costs = np.pad(ground.costs, ((0, 0), (10, 0)), constant_values=LETHAL)
    found.on_costmap(Costmap(costs, GridGeometry(130, 80, CELL, -10 * CELL, 0.0)), [])
    assert (before < 1.0).any() and np.array_equal(found.expected()[:, 10:], before)


def test_gaps_between_what_sensors_have_told_are_no_border_and_the_body_may_be_there():
    ground = hall(6.0)
    ground.costs[30:40, 1:-1] = UNKNOWN  # 0.5 m
    found = survey()
    found.on_costmap(ground, [])
    assert (found.ground.costs[30:40, 8:-8] == FREE).all() and not found.expected()[25:45, 8:-8].any()
    ground.costs[30:50, 1:-1] = UNKNOWN
    found.on_costmap(ground, [])
    assert (found.ground.costs == UNKNOWN).any() and found.expected().any()


@pytest.mark.parametrize(
    'rows, driven', ((range(30, 33), (False, False)), (range(30, 39), (True, False)), (range(30, 42), (True, True)))
)
def test_it_drives_for_half_a_metre_of_border_and_for_less_where_that_is_all(monkeypatch, rows, driven):
    """Of the border of a hall it hears 0.15 m, 0.45 m, and 0.60 m; it stands, or is on its way elsewhere."""
    found, ground = survey(), hall()
    found.on_costmap(ground, [])
    heard, width = found._heard, ground.geometry.width
    monkeypatch.setattr(found, '_heard', lambda poses: np.where(np.isin(heard(poses) // width, rows), heard(poses), -1))
    choices = [found.choose(planner(), FOOTPRINT, START, under_way) for under_way in (False, True)]
    assert tuple(choice is not None for choice in choices) == driven


def test_a_frontier_whose_own_cells_are_no_border_is_where_they_are(monkeypatch):
    """What is heard of a block counts though it is of cells beside those that the rays met."""
    found = survey()
    found.on_costmap(hall(), [])
    heard = found._heard

    def beside(poses):
        places = heard(poses)
        return np.where(places >= 0, places - 1, places)  # a column before the border

    monkeypatch.setattr(found, '_heard', beside)
    choice = found.choose(planner(), FOOTPRINT, START, False)
    assert choice.frontier.size >= survey_module.LEAST and np.allclose(choice.frontier.points[:, 0], 2.925)


def test_without_sensors_or_with_everything_known_there_is_nowhere_to_go():
    for found, ground in ((survey(()), hall()), (survey(), hall(6.0))):
        found.on_costmap(ground, [])
        assert found.choose(planner(), FOOTPRINT, START, False) is None


def test_a_place_that_no_plan_leads_to_or_that_was_tried_is_not_told_again():
    found = survey()
    found.on_costmap(hall(), [])
    first = found.choose(planner(), FOOTPRINT, START, False)
    found.tried(first, False)
    second = found.choose(planner(), FOOTPRINT, START, False)
    assert second.pose.distance(first.pose) >= 0.3


def test_a_place_that_was_reached_counts_as_tried_for_its_heading_alone():
    tried, poses = tried_places.TriedPlaces(), np.array([(1.0, 2.0, 0.1), (1.0, 2.0, 2.0), (1.5, 2.0, 0.0)])
    assert not tried.hold(poses).any()
    tried.add(Pose2D(1.1, 2.0, 0.0), True)
    assert tried.hold(poses).tolist() == [True, False, False]
    tried.add(Pose2D(1.1, 2.0, 2.0), False)
    assert tried.hold(poses).tolist() == [True, True, False]
    tried.clear_unreached()
    assert tried.hold(poses).tolist() == [True, False, False]
    tried.add(Pose2D(1.1, 2.0, -3.0), False, turned=True)
    assert tried.hold(poses).tolist() == [True, True, False]
    tried.clear()
    assert not tried.hold(poses).any()


def barred(ground, place):
    """What move_base goes by: on a larger grid, with an obstacle of 0.2 m about a place (x, y)."""
    rows, columns = ground.costs.shape
    costs = np.full((rows + 20, columns + 30), FREE, np.uint8)
    costs[10 : 10 + rows, 20 : 20 + columns] = ground.costs
    column, row = round(place[0] / CELL) + 20, round(place[1] / CELL) + 10
    costs[row - 2 : row + 2, column - 2 : column + 2] = LETHAL
    return Costmap(costs, GridGeometry(columns + 30, rows + 20, CELL, -20 * CELL, -10 * CELL))


def test_it_drives_to_where_move_base_knows_of_no_obstacle_and_leaves_for_elsewhere_if_one_appears_there():
    found = survey()
    found.on_costmap(hall(), [])
    first = found.choose(planner(), FOOTPRINT, START, False)
    found.on_obstacles(barred(hall(), (5.5, 3.5)))
    assert found.choose(planner(), FOOTPRINT, START, False).pose == first.pose and found.stays(first)
    there = barred(hall(), first.pose[:2])
    for _ in range(3):  # what is drawn on there for a moment does not count
        found.on_obstacles(there)
        assert found.stays(first) and found.stays(first)
        found.on_obstacles(hall())
        assert found.stays(first)
    found.on_obstacles(there)
    assert [found.stays(first) for _ in range(3)] == [True, True, False]
    second = found.choose(planner(), FOOTPRINT, START, False)
    assert second.pose != first.pose and found.stays(second)
    assert not LocalWorld(there, FOOTPRINT, False).collides(second.pose)


def test_obstacles_of_a_costmap_elsewhere_are_laid_on_the_ground_where_they_are():
    ground = hall()
    laid = with_obstacles(ground, barred(ground, (2.0, 1.0))).costs
    assert np.array_equal(np.argwhere(laid != ground.costs), [(r, c) for r in range(18, 22) for c in range(38, 42)])
    assert (laid[18:22, 38:42] == LETHAL).all()
    far = Costmap(np.full((3, 3), LETHAL, np.uint8), GridGeometry(3, 3, CELL, 50.0, 50.0))
    assert np.array_equal(with_obstacles(ground, far).costs, ground.costs)


@pytest.mark.parametrize('turned', (1, -1))
def test_nothing_is_heard_through_a_slanting_wall_of_single_cells(turned):
    """They touch by their corners alone, and nothing is known behind them."""
    rows, costs, found = np.arange(80), hall(6.0).costs, survey()
    columns = (28 + 3 * rows // 4)[::turned]
    costs[np.arange(120) > columns[:, None]] = UNKNOWN
    costs[rows, columns] = LETHAL
    found.on_costmap(costmap(costs), [])
    for yaw in np.linspace(-3.1, 3.1, 60):
        assert (found._heard(np.array([[1.2, 1.2, yaw], [1.2, 2.8, yaw]])) < 0).all()


class Sonars(House):
    """A robot that hears in narrow fans what it faces, and turns about on the spot where it comes to."""

    def __init__(self, params=None, sensors=AROUND, door=None):
        self.found, self.sensors = None, sensors
        super().__init__(params)
        self.true = np.where(hall(6.0).costs == LETHAL, 100, 0).astype(np.int8)
        if door is not None:
            self.true[:, 60:63] = 100
            self.true[door, 60:63] = 0
        self.known = np.full(self.true.shape, -1, np.int8)
        self.found = survey(sensors)
        config = ExploreConfig.from_params(params or {})
        self.explorer = Explorer(config, planner(), FOOTPRINT, self.said.append, self.found)
        self.look()

    def look(self):
        if self.found is None:
            return
        fan = np.linspace(-0.25, 0.25, 15)
        x, y, axis = np.tile(np.array(self.sensors), (17, 1)).T
        yaw = self.pose.yaw + np.repeat(np.linspace(0.0, 2.0 * math.pi, 17), len(self.sensors))
        x, y = self.pose.x + x * np.cos(yaw) - y * np.sin(yaw), self.pose.y + x * np.sin(yaw) + y * np.cos(yaw)
        angles, far = (yaw + axis)[:, None] + fan, np.arange(0.0, 1.5, 0.5 * CELL)
        columns = ((x[:, None, None] + far * np.cos(angles)[..., None]) / CELL).astype(int)
        rows = ((y[:, None, None] + far * np.sin(angles)[..., None]) / CELL).astype(int)
        rows, columns = rows.clip(0, self.true.shape[0] - 1), columns.clip(0, self.true.shape[1] - 1)
        wall = self.true[rows, columns] == 100
        told = np.cumsum(np.cumsum(wall, -1), -1) <= 1
        self.known[rows[told], columns[told]] = self.true[rows[told], columns[told]]
        costs = np.where(self.known == -1, UNKNOWN, np.where(self.known == 100, LETHAL, FREE))
        self.explorer.on_costmap(costmap(costs))


def test_a_hall_is_explored_to_its_end_and_the_robot_goes_home():
    house = Sonars()
    house.run()
    assert house.explorer.state is State.DONE and house.pose == START
    free = house.true[2:-2, 2:-2] == 0
    assert np.count_nonzero(house.known[2:-2, 2:-2][free] == 0) > 0.95 * np.count_nonzero(free)


def test_it_drives_through_a_door_of_less_than_0_80_m():
    house = Sonars(sensors=FANS, door=slice(30, 45))
    house.run()
    assert max(goal.x for goal in house.goals) > 4.0 and house.pose == START
    assert np.count_nonzero(house.known[2:-2, 64:-2] == 0) > 0.9 * house.known[2:-2, 64:-2].size


def test_when_its_time_is_over_it_drives_home():
    house = Sonars({'time_limit': 3.5})
    house.run()
    assert 1 < len(house.goals) <= 5 and house.goals[-1] == START
    assert any('time_limit' in line for line in house.said) and house.said[-1] == 'Back where it began.'
    house.explorer.resume()
    assert isinstance(house.step(), Drive) and house.said[-1].startswith('To a frontier')  # it has as much time again


def test_a_goal_under_way_is_given_up_for_home_when_its_time_is_over():
    house = Sonars({'time_limit': 2.5})
    assert isinstance(house.step(), Drive)
    order = None
    while house.now < 4.0:
        order = house.step(Pose2D(1.5, 1.0, 0.0)) or order
    assert order == Drive(START) and house.explorer.state is State.RETURNING


@pytest.mark.parametrize(
    ('params', 'fault'),
    [
        ({'sensors': 'ranges'}, 'range_topics is .*one topic or more'),
        ({'sensors': 'ranges', 'range_topics': ['a', 'a']}, 'each once'),
        ({'sensors': 'camera'}, 'sensors is .camera.'),
        ({'range_reach': 0.0}, 'range_reach is 0'),
        ({'time_limit': -1.0}, 'time_limit is -1'),
        ({'return_by': math.nan}, 'return_by is nan'),
        ({'return_by': 60.0, 'return_to_init': False}, 'allowed is 0 without return_to_init'),
    ],
)
def test_parameters_that_cannot_be_used_are_named(params, fault):
    with pytest.raises(ConfigError, match=fault):
        ExploreConfig.from_params(params)


def test_a_map_of_one_row_is_none_and_the_one_before_stays():
    config = ExploreConfig.from_params({'sensors': 'ranges', 'range_topics': ['front']})
    explorer = Explorer(config, LatticePlanner(LatticePlannerConfig()), FOOTPRINT, print, Survey(1.5))
    explorer.on_costmap(hall())
    before = explorer.found
    for shape in ((1, 40), (40, 1)):
        with pytest.raises(ValueError, match='cells is none'):
            explorer.on_costmap(Costmap(np.full(shape, FREE), GridGeometry(*shape[::-1], CELL, 0.0, 0.0)))
    assert explorer.found is before
    explorer.step(0.0, START)
