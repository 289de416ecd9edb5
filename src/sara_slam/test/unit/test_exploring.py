"""Exploring without ROS: frontiers, from where they are seen, which one comes next, and a whole house explored."""

import math

import numpy as np
import pytest
from slam_world import CELL, plan

from sara_common.config import ConfigError
from sara_common.planar import Pose2D
from sara_control.gate.reasons import Reason, State, sentence
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, GridGeometry
from sara_nav.lattice.config import LatticePlannerConfig
from sara_nav.lattice.planner import LatticePlanner
from sara_nav.maps.map_io import GridMap, MapError
from sara_slam.exploring import explorer as of_explorer
from sara_slam.exploring import limits
from sara_slam.exploring.choice import ByFrontiers, Choice, choose, cost
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.explorer import Explorer
from sara_slam.exploring.frontiers import frontiers, share_near
from sara_slam.exploring.ground import ground_of, updated
from sara_slam.exploring.orders import Drive, Stop
from sara_slam.exploring.orders import State as Exploring
from sara_slam.exploring.viewpoints import FARTHEST, NEAREST, Surroundings

FOOTPRINT = np.array([[0.5, 0.29], [0.5, -0.29], [-0.5, -0.29], [-0.5, 0.29]])
START = Pose2D(1.0, 1.0, 0.0)
MOST = 4.0  # m that the robot of the tests sees


def costmap(costs):
    costs = np.array(costs, np.uint8)
    return Costmap(costs, GridGeometry(costs.shape[1], costs.shape[0], CELL, 0.0, 0.0))


def hall(known=3.0):
    """A hall of 6 m x 4 m with walls, known up to an x (m)."""
    costs = np.full((80, 120), FREE)
    costs[[0, -1]] = costs[:, [0, -1]] = LETHAL
    costs[:, round(known / CELL) :] = UNKNOWN
    return costmap(costs)


def seen_from(known, pose, true):
    """Mark in `known` (int8) what is seen of the `true` cells from a pose, all round, and where the robot stands."""
    steps = np.arange(0.0, MOST, 0.5 * CELL)
    angles = np.linspace(0.0, 2.0 * math.pi, 1440)[:, None]
    columns = ((pose.x + steps * np.cos(angles)) / CELL).astype(int).clip(0, true.shape[1] - 1)
    rows = ((pose.y + steps * np.sin(angles)) / CELL).astype(int).clip(0, true.shape[0] - 1)
    hit = true[rows, columns] == 100
    clear = np.cumsum(hit, 1) == 0
    known[rows[clear], columns[clear]] = 0
    first = np.argmax(hit, 1)[hit.any(1)]
    known[rows[hit.any(1), first], columns[hit.any(1), first]] = 100


class House:
    """A robot that is at once where it is sent, in slam_world's corridor, and sees MOST m far."""

    def __init__(self, params=None, ends=lambda goal: (True, 'Goal reached.')):
        self.true, self.known = plan(), np.full(plan().shape, -1, np.int8)
        self.pose, self.now, self.ends, self.said, self.goals = START, 0.0, ends, [], []
        planner = LatticePlanner(LatticePlannerConfig())
        self.explorer = Explorer(ExploreConfig.from_params(params or {}), planner, FOOTPRINT, self.said.append)
        self.look()

    def look(self):
        seen_from(self.known, self.pose, self.true)
        height, width = self.true.shape
        self.explorer.on_costmap(ground_of(GridMap(self.known.copy(), GridGeometry(width, height, CELL, 0.0, 0.0))))

    def step(self, pose=None, hold=''):
        self.now += 1.0
        return self.explorer.step(self.now, self.pose if pose is None else pose, hold)

    def run(self, most=200):
        for _ in range(most):
            order = self.step()
            if isinstance(order, Drive):
                self.goals.append(order.pose)
                reached, text = self.ends(order.pose)
                if reached:
                    self.pose = order.pose
                    self.look()
                self.explorer.ended(self.now, reached, text)
            if self.explorer.state is Exploring.DONE:
                return
        raise AssertionError(f'not done: {self.said[-3:]}')


def test_a_frontier_is_where_free_space_borders_on_the_unknown():
    (found,) = frontiers(hall(), 0.5)
    assert found.size == pytest.approx(78 * CELL) and np.allclose(found.points[:, 0], 3.0 - 0.5 * CELL)
    assert found.middle == pytest.approx((2.975, 2.0), abs=0.03)
    assert frontiers(hall(), 4.0) == [] and frontiers(hall(6.0), 0.5) == []


def test_small_patches_of_unknown_cells_and_obstacles_beside_the_unknown_are_no_frontiers():
    ground = hall(6.0)
    ground.costs[20:28, 20:28] = UNKNOWN
    assert frontiers(ground, 0.5) == []
    ground.costs[20:40, 20:40] = UNKNOWN
    (found,) = frontiers(ground, 0.5)
    assert found.size == pytest.approx(80 * CELL)
    ground.costs[18:42, 18:42] = np.where(ground.costs[18:42, 18:42] == UNKNOWN, UNKNOWN, INSCRIBED)
    assert frontiers(ground, 0.5) == []


def test_how_much_of_a_frontier_is_left_on_a_later_map():
    ground = hall()
    (before,) = frontiers(ground, 0.5)
    assert share_near(before, [before]) == 1.0
    ground.costs[1:40, 60:100] = FREE  # half of it was seen
    assert share_near(before, frontiers(ground, 0.5)) == pytest.approx(0.5, abs=0.1)
    assert share_near(before, []) == 0.0


def test_values_of_maps_and_of_costmaps():
    values = np.array([[-1, 0, 98, 99, 100, -5, 127]], np.int8)
    ground = ground_of(GridMap(values, GridGeometry(7, 1, CELL, 0.0, 0.0)))
    assert ground.costs.tolist() == [[UNKNOWN, FREE, FREE, INSCRIBED, LETHAL, LETHAL, LETHAL]]
    assert updated(ground, 1, 0, np.array([[100, -1]], np.int8)).costs[0, :3].tolist() == [UNKNOWN, LETHAL, UNKNOWN]
    with pytest.raises(MapError, match='turned'):
        ground_of(GridMap(values, ground.geometry, 0.3))
    for x, y in ((6, 0), (-1, 0), (0, 1)):
        with pytest.raises(MapError, match='does not lie'):
            updated(ground, x, y, np.zeros((1, 2), np.int8))


def test_a_frontier_is_looked_at_from_where_the_robot_fits_and_nothing_is_between():
    ground = hall()
    around = Surroundings(ground, START, FOOTPRINT)
    assert around.way_to(2.0, 1.0) == pytest.approx(1.0, abs=0.1)
    assert around.way_to(4.0, 1.0) == around.way_to(-9.0, 0.0) == math.inf  # unknown; off the map
    (found,) = frontiers(ground, 0.5)
    views = around.views(found, 3)
    assert len(views) == 3
    for view in views:
        assert NEAREST <= math.dist(view.pose[:2], found.middle) <= FARTHEST
        assert not LocalWorld(ground, FOOTPRINT, True).collides(view.pose)
        towards = math.atan2(found.middle[1] - view.pose.y, found.middle[0] - view.pose.x)
        assert abs(towards - view.pose.yaw) < 0.71
    ground.costs[:, 16:18] = LETHAL  # a wall between the robot and all of it
    assert Surroundings(ground, Pose2D(0.45, 1.0, 1.57), FOOTPRINT).views(found, 3) == []


def test_the_cheapest_frontier_is_chosen_by_way_turn_and_size():
    config = ExploreConfig()
    assert cost(config, 2.0, -1.0, 1.0) == pytest.approx(2.0 + 0.5 - 0.3)
    ground = hall()
    ground.costs[1:30, 1:7] = UNKNOWN  # behind the robot, shorter and as near
    ground.costs[30:, :40] = LETHAL
    start = Pose2D(1.5, 0.75, 0.0)
    ahead, behind = frontiers(ground, 0.5)
    around, planner = Surroundings(ground, start, FOOTPRINT), LatticePlanner(LatticePlannerConfig())
    planner.set_footprint(FOOTPRINT)
    assert choose(config, planner, around, start, [ahead, behind]).frontier is ahead
    assert choose(config, planner, around, start, [behind]).frontier is behind
    assert choose(config, planner, around, start, []) is None


def test_a_house_is_explored_to_its_end_and_the_robot_goes_home():
    house = House()
    house.run()
    free = (house.true == 0) & (house.known != -1)
    assert np.count_nonzero(free) > 0.97 * np.count_nonzero(house.true[2:-2, 2:-2] == 0) and house.known[100, 140] == -1
    assert house.pose == START and house.said[-1] == 'Back where it began.'
    assert any(line.startswith('Explored: ') and 'm driven' in line for line in house.said)
    assert 4 < len(house.goals) < 40


NO_WAY = 'Failed to find a valid plan. Even after executing recovery behaviors.'


@pytest.mark.parametrize('tries', [1, 2, 11, 12])
def test_the_way_home_is_tried_twelve_times_and_then_it_is_said_that_there_is_none(tries):
    """What bars it may be forgotten meanwhile, or gone."""
    house, ends, times = House(), iter([NO_WAY] * tries), []

    def ended(goal):
        text = next(ends, 'Goal reached.') if goal == START else 'Goal reached.'
        times.extend([house.now] if goal == START else [])
        return text != NO_WAY, text

    house.ends = ended
    house.run(600)
    there = tries < 12
    assert house.goals.count(START) == tries + there and (house.pose == START) == there
    assert all(10.0 <= later - earlier <= 11.0 for earlier, later in zip(times, times[1:]))
    assert house.said[-1] == ('Back where it began.' if there else f'It did not get back to where it began: {NO_WAY}')
    assert sum(line.startswith('The way back ended') for line in house.said) == tries - (not there)


def test_the_way_home_waits_where_no_goal_would_do_and_a_stop_ends_it():
    house = House({'time_limit': 0.5})
    house.pose = house.step().pose
    assert house.step() == Drive(START)
    house.explorer.ended(house.now, False, NO_WAY)
    house.now += of_explorer.NEWS_S
    assert house.step(hold='The chair stands still.') is None and house.step() == Drive(START)
    house.explorer.ended(house.now, False, f'Goal aborted: {sentence(State.BRAKING, Reason.EMERGENCY_STOP)}')
    assert house.explorer.state is Exploring.PAUSED and house.explorer.pause('') is None


def test_it_can_stay_where_it_ends():
    house = House({'return_to_init': False})
    house.look = lambda: None  # nothing more is ever seen
    house.run()
    assert house.pose != START and house.said[-1].startswith('Explored')


def test_frontiers_that_cannot_be_reached_are_tried_twice_and_named_at_the_end():
    text = 'Failed to find a valid plan. Even after executing recovery behaviors.'
    house = House(ends=lambda goal: (False, text))
    house.run()
    left = sum('is left' in line for line in house.said)
    assert left == 2 * len(house.explorer.found) and house.pose == START
    assert any('Unknown stays what lies behind (' in line for line in house.said)
    assert all(map(house.explorer.given_up, house.explorer.found))


def test_one_that_was_looked_at_in_vain_is_looked_at_once_more_from_elsewhere():
    house = House()
    house.look = lambda: None  # nothing is ever seen
    house.run()
    places = [goal[:2] for goal in house.goals[:-1]]
    assert len(places) == len(set(places)) == 2 * len(house.explorer.found)


def test_without_map_or_pose_nothing_is_driven_to_and_what_is_under_way_is_given_up():
    said = []
    explorer = Explorer(ExploreConfig(), LatticePlanner(LatticePlannerConfig()), FOOTPRINT, said.append)
    assert explorer.step(0.0, START) is None and said == ['Exploring waits: there is no map yet']
    house = House()
    for pose in (None, Pose2D(math.nan, 0.0, 0.0), Pose2D(99.0, 0.0, 0.0)):
        assert house.explorer.step(0.0, pose) is None
    assert len(house.said) == 2 and 'not known' in house.said[0] and 'off the map' in house.said[1]
    assert house.step(hold='The chair stands still because it has just been started.') is None
    assert isinstance(house.step(), Drive)
    assert house.explorer.step(house.now + 1.0, None) == Stop() and house.explorer.step(house.now + 2.0, None) is None
    assert isinstance(house.step(), Drive)  # the pose is back


def test_whoever_else_gives_a_goal_and_the_safety_gate_make_it_pause():
    stop = sentence(State.BRAKING, Reason.EMERGENCY_STOP)
    for end in (
        lambda house: house.explorer.taken_over('This goal was canceled because another goal was recieved'),
        lambda house: house.explorer.ended(house.now, False, f'Goal aborted: {stop}'),
        lambda house: house.explorer.pause('it was asked to.'),
    ):
        house = House()
        assert isinstance(house.step(), Drive)
        end(house)
        assert 'explore/resume' in house.said[-1] and [house.step() for _ in range(20)] == [None] * 20
        house.explorer.resume()
        assert isinstance(house.step(), Drive)


def test_a_crowd_in_the_way_is_the_frontiers_fault():
    house = House()
    first = house.step()
    house.explorer.ended(house.now, False, f'Goal aborted: {sentence(State.BLOCKED, Reason.CROWD)}')
    second = house.step()
    assert isinstance(second, Drive) and second != first


def test_goals_that_end_for_the_robots_sake_are_tried_again_and_then_no_more():
    house = House()
    for state in (State.BRAKING, State.HELD, State.WAITING)[: of_explorer.IN_VAIN]:
        late = sentence(state, Reason.COMMANDS)
        house.now += of_explorer.RETRY_S
        assert isinstance(house.step(), Drive) and house.step(Pose2D(1.2, 1.0, 0.0)) is None
        house.explorer.ended(house.now, False, f'Goal aborted: {late}')
        assert house.step() is None
    assert house.explorer.state is Exploring.PAUSED and 'commands stopped' in house.said[-1]


def test_without_progress_another_frontier_is_driven_to():
    house = House({'progress_timeout': 5.0})
    first = house.step()
    orders = [house.step() for _ in range(8)]
    (second,) = [order for order in orders if order is not None]
    assert isinstance(second, Drive) and second != first and any('no progress for 6 s' in line for line in house.said)


@pytest.mark.parametrize(
    'way, turn, every, left',
    [(0.3, 0.6, 2, True), (1.5, 0.0, 2, True), (0.0, 3.0, 2, True), (0.1, 0.0, 99, False), (0.0, 0.2, 99, False)],
)
def test_going_to_and_fro_is_no_progress_however_far(way, turn, every, left):
    house = House({'progress_timeout': 5.0})
    first = house.step()
    for step in range(12):
        pose = START._replace(x=START.x + way * (step % every), yaw=START.yaw + turn * (step % every))
        house.now += 1.0
        order = house.explorer.step(house.now, pose)
        if order is not None:
            break
    assert (order is not None) == left and (not left or order != first)


def test_a_frontier_that_was_seen_on_the_way_is_left_for_the_next_one_without_a_stop():
    house = House()
    first = house.step()
    assert house.step() is None
    seen_from(house.known, first.pose, house.true)
    house.look()
    second = house.step()
    assert isinstance(second, Drive) and second != first


def test_the_clock_may_go_back():
    house = House({'progress_timeout': 5.0})
    house.now = 1000.0
    assert isinstance(house.step(), Drive)
    house.now = 10.0
    assert house.step() is None and sum(isinstance(house.step(), Drive) for _ in range(7)) == 1


def test_parameters_are_those_of_explore_lite_and_bad_ones_are_told():
    config = ExploreConfig.from_params({'potential_scale': 3.0, 'min_frontier_size': 0.75, 'visualise': True})
    assert config.potential_scale == 3.0 and config.warnings == ('visualise is no parameter of explore: ignored.',)
    with pytest.raises(ConfigError) as told:
        ExploreConfig.from_params({'planner_frequency': 0.0, 'gain_scale': -1.0, 'costmap_topic': '', 'visualize': 3})
    assert len(told.value.faults) >= 3 or 'visualize' in str(told.value)


def test_on_the_way_home_a_lost_pose_cancels_the_goal_and_it_is_set_out_for_again():
    house = House({'time_limit': 0.5})
    house.pose = house.step().pose
    for _ in range(of_explorer.HOME_TRIES + 1):
        assert house.step() == Drive(START)
        assert (
            house.explorer.step(house.now + 1.0, None) == Stop() and house.explorer.step(house.now + 2.0, None) is None
        )
    assert house.said[-1] == "Exploring waits: the robot's pose in the map is not known"


@pytest.mark.parametrize('params', [{'progress_timeout': 5.0}, {'time_limit': 5.0}, {}])
def test_while_the_gate_holds_no_other_goal_is_given_and_no_frontier_left(params):
    house, hold = House(params), sentence(State.HELD, Reason.EMERGENCY_STOP)
    first = house.step()
    house.pose = Pose2D(1.5, 1.0, 0.0)
    seen_from(house.known, first.pose, house.true)  # the frontier is gone
    house.look()
    assert [house.step(hold=hold) for _ in range(8)] == [None] * 8 and not any('left' in line for line in house.said)
    assert isinstance(house.step(), Drive)


def test_after_a_pause_it_has_as_much_time_again():
    house = House({'time_limit': 100.0})
    house.step()
    house.explorer.pause('it was asked to.')
    house.now += 200.0
    house.explorer.resume()
    assert isinstance(house.step(), Drive) and house.explorer.state is Exploring.EXPLORING


def turns_home(x, params, back=0.0):
    """After how long (s) an explorer that stands at an x (m) of a hall of 8 m turns home, and what it has said. back: s
    by which the clock is set back after 50 s.
    """
    said, now, step = [], 0.0, 0
    one = Explorer(
        ExploreConfig(**params, progress_timeout=1e3), LatticePlanner(LatticePlannerConfig()), FOOTPRINT, said.append
    )
    costs = np.full((80, 200), FREE)
    costs[[0, -1]] = costs[:, [0, -1]] = LETHAL
    costs[:, 160:] = UNKNOWN
    one.on_costmap(costmap(costs))
    one.step(now, START)
    while one.state is Exploring.EXPLORING:
        step += 1
        now = 2.0 * step - (back if step > 25 else 0.0)
        one.step(now, Pose2D(x, 1.0, 0.0))
        assert step < 150
    return 2.0 * step, said


def is_due(now, way):
    """Whether now is when one with a way of so many m turns home that is to be back by 200 s."""
    due = 200.0 - limits.SPARE_S - way / limits.PACE
    return due - 2.0 <= now <= due + limits.LOOK_S


@pytest.mark.parametrize(('x', 'way'), [(1.0, 0.0), (4.0, 3.0), (7.0, 6.0)])
def test_it_turns_home_when_the_way_takes_the_time_that_is_left(x, way):
    now, said = turns_home(x, {'return_by': 200.0})
    assert is_due(now, way)
    assert any('what is left of 200 s (return_by)' in line for line in said)


@pytest.mark.parametrize('back', [0.5, 60.0, 3600.0])
def test_a_clock_that_is_set_back_gives_it_no_more_time(back):
    now, _ = turns_home(4.0, {'return_by': 200.0})
    assert abs(turns_home(4.0, {'return_by': 200.0}, back)[0] - now) <= 2.0
    assert turns_home(4.0, {'time_limit': 100.0}, back)[0] <= 104.0


def test_where_no_way_home_is_known_it_is_at_least_as_long_as_the_distance(monkeypatch):
    monkeypatch.setattr(Surroundings, 'way_to', lambda *_: math.inf)
    assert is_due(turns_home(7.0, {'return_by': 200.0})[0], 6.0)


def test_of_two_limits_the_earlier_one_holds():
    now, said = turns_home(1.0, {'return_by': 200.0, 'time_limit': 50.0})
    assert now <= 52.0 and any('time_limit of 50 s is over' in line for line in said)


def homeward(monkeypatch, params, pace=1.0, hold=''):
    """The orders of an explorer that turns home 6 m off, for lack of time if params say so, and drives at `pace`, m/s;
    what it was asked for on its way, s left each; the explorer.
    """
    asked, orders, frontier = [], [], frontiers(hall(), 0.5)[0]

    def on_way_home(_self, _planner, _footprint, start, _home, left):
        asked.append(left)
        return Choice(frontier, Pose2D(start.x, 1.5, 0.0), 0.0) if len(asked) == 1 else None

    monkeypatch.setattr(ByFrontiers, 'on_way_home', on_way_home)
    monkeypatch.setattr(of_explorer, 'NEWS_S', 2.0)
    monkeypatch.setattr(limits, 'LOOK_S', 0.0)
    one = Explorer(ExploreConfig(**params, progress_timeout=1e3), LatticePlanner(LatticePlannerConfig()), FOOTPRINT)
    costs = np.full((80, 200), FREE)
    costs[[0, -1]] = costs[:, [0, -1]] = LETHAL
    if params:
        costs[:, 160:] = UNKNOWN
    one.on_costmap(costmap(costs))
    one.step(0.0, START)
    x, now = 7.0, 0.0
    while x > 1.0 and now < 300.0:
        now += 1.0
        x -= pace if one.state is Exploring.RETURNING else 0.0
        order = one.step(now, Pose2D(x, 1.0, 0.0), hold if one.state is Exploring.RETURNING else '')
        orders += [order] if isinstance(order, Drive) else []
    return orders, asked, one


def test_on_the_way_home_it_uses_the_time_that_is_left_over(monkeypatch):
    orders, asked, one = homeward(monkeypatch, {'return_by': 200.0})
    assert asked[0] >= of_explorer.MORE_S
    assert orders[-1].pose == START, 'it turns home again'
    assert orders[-2].pose.y == 1.5 and orders[-3].pose == START


@pytest.mark.parametrize(
    ('params', 'pace', 'hold'),
    [
        ({'return_by': 200.0}, limits.PACE, ''),
        ({'return_by': 200.0}, 1.0, sentence(State.HELD, Reason.EMERGENCY_STOP)),
        ({'time_limit': 100.0}, 1.0, ''),
        ({}, 1.0, ''),
    ],
)
def test_else_it_goes_straight_home(monkeypatch, params, pace, hold):
    orders, asked, one = homeward(monkeypatch, params, pace, hold)
    assert asked == [] and one.state is Exploring.RETURNING and orders[-1].pose == START
