"""What move_base does beyond its peer when the way is blocked: it plans anew early, notices that it stands, recovers on
from where it was.
"""

import numpy as np
import pytest

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import InflationConfig
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.goals.goal import BY_PLANNING, BY_STUCK, Goal
from sara_nav.goals.move_base_config import MoveBaseConfig
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.planners.grid_planner import GridPlanner
from sara_nav.pursuit.rotate_then_pursue import RotateThenPursue
from sara_nav.recovery.back_out import BackOutConfig, BackOutRecovery
from sara_nav.recovery.behaviours import ClearCostmapRecovery, RecoveryStep
from sara_nav.recovery.help import AskForHelp, AskForHelpConfig

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
HOME, GOAL = Pose2D(1.0, 1.0, 0.0), Pose2D(6.0, 1.0, 0.0)
ZERO = (0.0, 0.0)


def costmap():
    data = np.zeros((80, 180), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    result = LayeredCostmap(
        CostmapConfig(),
        [StaticLayer('static'), InflationLayer('halo', InflationConfig(inflation_radius=0.4))],
        FOOTPRINT,
    )
    result.layers['static'].set_map(GridMap(data, GridGeometry(180, 80, 0.05, -1.0, -1.0)))
    return result


class Robot:
    """Does what it is told, unless it is held."""

    def __init__(self, recoveries=(), **config):
        self.machine = MoveBase(
            MoveBaseConfig(**config), costmap(), costmap(), GridPlanner(), RotateThenPursue(), recoveries
        )
        self.pose, self.t, self.held, self.command, self.results = HOME, 0.0, False, ZERO, []
        assert self.machine.set_goal(GOAL, 0.0) == ''

    def put(self, x, y=None, value=100):
        """The map has something at x, y (m) now, all across for None; or with 0 no longer has."""
        for costmap_ in (self.machine.global_costmap, self.machine.local_costmap):
            column, row = costmap_.geometry.to_cell(x, 1.0 if y is None else y)
            costmap_.layers['static'].update_map(
                column, 1 if y is None else row, np.full((78 if y is None else 2, 2), value, np.int8)
            )
        self.machine.costmaps.wake()

    def go(self, seconds, until=lambda result: False):
        """Return the last StepResult."""
        for _ in range(round(20 * seconds)):
            result = self.machine.step(self.t, self.pose, ZERO if self.held else self.command, self.t)
            self.command = result.command
            self.results.append(result)
            if not self.held:
                self.pose = self.pose.advance(*self.command, 0.05)
            self.t += 0.05
            if until(result):
                break
        return result

    @property
    def plans(self):
        return [result.plan for result in self.results if result.plan is not None]


# -- replan_when_blocked -----------------------------------------------------------------------------------------------


def test_something_new_on_the_plan_far_ahead_is_planned_round_at_once_and_driven_round():
    robot = Robot(replan_when_blocked=True)
    robot.go(4.0)
    robot.put(4.5, 1.0)
    seen = robot.t
    robot.go(1.5, until=lambda r: r.plan is not None)
    assert robot.pose.x < 2.6 and robot.t - seen <= 1.3, 'long before the robot stands in front of it'
    assert np.hypot(robot.plans[-1][:, 0] - 4.5, robot.plans[-1][:, 1] - 1.0).min() > 0.29
    assert robot.go(60.0, until=lambda r: r.status != 'active').text == 'Goal reached.'


def test_by_default_it_drives_up_to_it_as_the_peer_does():
    robot = Robot()
    robot.go(4.0)
    robot.put(4.5, 1.0)
    robot.go(2.0)
    assert len(robot.plans) == 1


def test_what_stands_beside_the_plan_or_behind_the_robot_changes_nothing():
    robot = Robot(replan_when_blocked=True)
    robot.go(8.0)
    assert robot.pose.x > 2.5
    robot.put(4.5, 1.6)
    robot.put(robot.pose.x - 1.2, 1.0)
    robot.go(2.0)
    assert len(robot.plans) == 1


def test_while_there_is_no_way_round_it_tries_once_a_second_and_keeps_its_plan():
    robot = Robot(replan_when_blocked=True)
    robot.go(3.0)
    robot.put(4.5)
    before = robot.machine.counters.failed_plans
    robot.go(3.0)
    assert robot.machine.counters.failed_plans - before in (3, 4)
    assert robot.results[-1].phase == 'controlling'


def new_map(robot, back=False):
    """Another map comes while the robot drives; its planner then leads it back, and round, or as before."""
    robot.go(4.0)
    assert robot.command[0] > 0.3 and len(robot.plans) == 1
    x, planner = robot.pose.x, robot.machine.global_planner
    if back:
        way = np.array(
            [(x - 0.1 * k, 1.0, np.pi) for k in range(10)] + [(x + 0.1 * k, 1.8, 0.0) for k in range(-10, 40)]
        )
        planner.plan = lambda costmap_, start, goal: way
    robot.machine.replan()


def test_a_new_map_on_which_the_plan_is_still_free_does_not_turn_the_robot_back():
    robot = Robot(replan_when_blocked=True)
    new_map(robot, back=True)
    result = robot.go(1.0)
    assert len(robot.plans) == 1 and result.phase == 'controlling' and robot.command[0] > 0.4
    robot.machine.replan()
    assert robot.go(30.0, until=lambda r: r.status != 'active').text == 'Goal reached.'


@pytest.mark.parametrize('why', ['blocked', 'on', 'as the peer'])
def test_it_is_turned_back_where_the_plan_is_blocked_and_led_on_by_the_new_plan(why):
    robot = Robot(replan_when_blocked=why != 'as the peer')
    new_map(robot, back=why != 'on')
    if why == 'blocked':
        robot.put(4.5, 1.0)
    robot.go(0.1)
    assert len(robot.plans) == 2


@pytest.mark.parametrize(('aside', 'plans'), [(0.06, 1), (0.0, 2), (-0.06, 2)])
def test_a_new_plan_on_a_new_map_is_taken_but_for_one_that_leaves_less_room(aside, plans):
    """Something stands 0.16 m beside the plan that is driven."""
    robot = Robot(replan_when_blocked=True)
    robot.go(4.0)
    x = robot.pose.x
    robot.put(x + 1.0, 1.45)
    way = np.array([(x + 0.1 * k, 1.0 + aside, 0.0) for k in range(40)])
    robot.machine.global_planner.plan = lambda costmap_, start, goal: way
    robot.machine.replan()
    robot.go(0.1)
    assert len(robot.plans) == plans


def test_where_the_new_map_leaves_no_way_it_stands():
    robot = Robot(replan_when_blocked=True)
    new_map(robot)
    robot.put(4.5)
    result = robot.go(0.1)
    assert (result.phase, result.command) == ('planning', ZERO)


# -- stuck_timeout -----------------------------------------------------------------------------------------------------


class Noted:
    """A behaviour that is through at once and is remembered."""

    def __init__(self, name, log):
        self.name, self.log = name, log

    def start(self, situation):
        self.log.append(self.name)

    def missing(self, *_):
        return []

    def update(self, situation):
        return RecoveryStep(text=self.name)


def test_a_robot_that_is_told_to_move_and_stands_recovers_and_the_goal_ends_in_words():
    log = []
    robot = Robot([Noted('one', log), Noted('two', log)], stuck_timeout=3.0)
    robot.go(4.0)
    robot.held, began = True, robot.t
    last = robot.go(30.0, until=lambda r: r.status != 'active')
    assert log == ['one', 'two'] and last.status == 'aborted'
    assert (
        last.text
        == 'Robot is held. Even after executing recovery behaviors. It is told to move but has stood for 3.0 s '
        '(stuck_timeout).'
    )
    assert 9.0 <= robot.t - began <= 10.5


def test_a_robot_that_is_held_to_let_somebody_pass_is_not_stuck_until_they_have():
    log = []
    robot = Robot([Noted('one', log)], stuck_timeout=3.0)
    robot.machine.excuse_standing()  # as it sets off, too
    robot.go(4.0)
    robot.held = True
    for _ in range(20):
        robot.go(1.0)
        robot.machine.excuse_standing()
    assert log == []
    began = robot.t
    robot.go(10.0, until=lambda _: log)
    assert 3.0 <= robot.t - began <= 3.2
    robot.machine.cancel(robot.t)
    robot.machine.excuse_standing()  # nobody drives


def test_a_robot_that_waited_for_the_way_to_become_free_is_not_stuck_as_it_sets_off():
    log = []
    robot = Robot([Noted('one', log)], stuck_timeout=3.0)
    robot.go(8.0, until=lambda _: robot.pose.x > 2.0)
    x = robot.pose.x + 1.4
    robot.put(x)
    robot.go(8.0, until=lambda r: r.text and r.command == ZERO)
    robot.go(5.0)
    assert robot.results[-1].phase == 'controlling' and robot.command == ZERO
    robot.put(x, value=0)
    waited_at = robot.pose.x
    robot.go(4.0)
    assert log == [] and robot.pose.x > waited_at + 0.2
    robot.held, began = True, robot.t
    robot.go(10.0, until=lambda _: log)
    assert 3.0 <= robot.t - began <= 3.2, 'one that is held is, all the same'


def test_the_layers_of_both_costmaps_hear_that_somebody_passes_once_for_each_time():
    heard, robot = [], Robot([])
    pair = robot.machine.costmaps
    layers = [layer for costmap in (pair.world, pair.local) for layer in costmap.layers.values()]
    for layer in layers:
        layer.let_pass = heard.append
    robot.machine.excuse_standing()
    robot.machine.excuse_standing()
    robot.go(0.5)
    assert len(heard) == len(layers) > 0 and len(set(heard)) == 1
    robot.machine.excuse_standing()
    robot.go(0.5)
    assert len(heard) == 2 * len(layers)


def test_clearing_costmaps_is_passed_over_by_one_that_is_held_but_not_by_one_without_a_plan():
    recoveries = [
        ClearCostmapRecovery('clear'),
        BackOutRecovery('back'),
        ClearCostmapRecovery('again'),
        AskForHelp('ask'),
    ]
    goal = Goal(GOAL, 0.0)
    for trigger, index in ((BY_STUCK, 1), (BY_STUCK, 3), (BY_STUCK, 4)):
        goal.trigger = trigger
        goal.take_up(HOME, 1.0, recoveries)
        assert goal.recovery_index == index
    goal = Goal(GOAL, 0.0, trigger=BY_PLANNING)
    goal.take_up(HOME, 1.0, recoveries)
    assert goal.recovery_index == 0
    goal = Goal(GOAL, 0.0, trigger=BY_STUCK)
    goal.take_up(HOME, 1.0, recoveries[:1])
    assert goal.recovery_index == 0, 'it is tried where there is nothing else'


def test_by_default_it_waits_as_the_peer_does():
    robot = Robot([Noted('one', [])])
    robot.held = True
    assert robot.go(30.0).status == 'active' and not robot.machine.counters.recoveries


def test_a_robot_that_turns_slowly_or_drives_slowly_is_not_held():
    goal = Goal(GOAL, 0.0)
    for velocity in ((0.02, 0.0), (0.0, 0.04), (-0.02, 0.0)):
        pose, longest = HOME, 0.0
        for k in range(400):
            pose = pose.advance(*velocity, 0.05)
            longest = max(longest, goal.stuck_for(0.05 * k, pose, velocity))
        assert longest <= 1.2
    assert goal.stuck_for(100.0, pose, ZERO) == 0.0, 'one that is to stand is not held'


# -- what was reached, and is not any more
# -------------------------------------------------------------------------------


def turning_at_the_goal(recoveries=()):
    """A Robot whose goal is reached but for the last turn, of which half is done."""
    robot = Robot(recoveries, stuck_timeout=3.0)
    assert robot.machine.set_goal(Pose2D(3.0, 1.0, 1.5), 0.0) == ''
    robot.go(60.0, lambda _: robot.pose.distance(Pose2D(3.0, 1.0, 0.0)) < 0.05 and robot.pose.yaw > 0.75)
    assert robot.machine.active and robot.machine.local_planner.phase == 'turn to goal'
    return robot


def test_a_robot_that_recovery_moved_off_the_goal_drives_there_again():
    robot = turning_at_the_goal([BackOutRecovery('back', BackOutConfig(distance=0.5))])
    robot.held = True
    robot.go(10.0, lambda result: result.phase == 'clearing')
    robot.held = False
    robot.go(30.0, lambda result: result.phase != 'clearing')
    assert robot.pose.distance(Pose2D(3.0, 1.0, 0.0)) > 0.1
    last = robot.go(60.0, lambda result: result.status != 'active')
    assert (
        last.text == 'Goal reached.'
        and robot.pose.distance(Pose2D(3.0, 1.0, 0.0)) < 0.06
        and abs(robot.pose.yaw - 1.5) < 0.04
    )


@pytest.mark.parametrize('off', (0.25, 1.0))
def test_a_robot_that_is_pushed_off_the_goal_while_it_turns_there_drives_there_again(off):
    robot = turning_at_the_goal()
    robot.pose = Pose2D(3.0 - off, 1.0, robot.pose.yaw)
    last = robot.go(60.0, lambda result: result.status != 'active')
    assert (
        last.text == 'Goal reached.'
        and robot.pose.distance(Pose2D(3.0, 1.0, 0.0)) < 0.06
        and abs(robot.pose.yaw - 1.5) < 0.04
    )


# -- recovery_memory ---------------------------------------------------------------------------------------------------


def test_a_second_recovery_nearby_goes_on_where_the_first_ended_and_one_far_away_begins_anew():
    goal = Goal(GOAL, 0.0)
    for x, index in ((1.0, 0), (1.5, 1), (4.0, 0), (1.8, 2), (4.9, 1)):
        goal.recovery_index = 0  # what led to it was over meanwhile
        goal.take_up(Pose2D(x, 1.0, 0.0), 1.0)
        assert goal.recovery_index == index
    goal.recovery_index = 0
    goal.take_up(Pose2D(1.0, 1.0, 0.0), 0.0)
    assert goal.recovery_index == 0, 'the peer forgets'


@pytest.mark.parametrize('memory, ends', [(1.0, True), (0.0, False)])
def test_backing_out_of_the_same_place_again_and_again_ends_with_the_memory_alone(memory, ends):
    """A robot held at x = 3 backs out 1.4 m, is getting on by that, and comes to the same place again."""
    robot = Robot([BackOutRecovery('back', BackOutConfig(distance=1.4))], stuck_timeout=2.0, recovery_memory=memory)
    for _ in range(2400):
        result = robot.go(0.05)
        robot.held = robot.pose.x >= 3.0 and robot.command[0] > 0.0
        if result.status != 'active':
            break
    assert (result.status == 'aborted') == ends
    assert robot.machine.counters.recoveries == 1 if ends else robot.machine.counters.recoveries > 2


# -- the behaviours in the machine -------------------------------------------------------------------------------------


def test_help_is_asked_for_in_the_steps_results_and_where_nobody_helps_the_goal_ends_in_words():
    robot = Robot([AskForHelp('ask', AskForHelpConfig(patience=5.0))], planner_patience=1.0, recovery_memory=1.0)
    robot.put(4.5)
    robot.go(4.0)
    asked = {result.help for result in robot.results}
    assert len(asked) == 2 and '' in asked and any(text.startswith('Help, please:') for text in asked)
    last = robot.go(20.0, until=lambda r: r.status != 'active')
    assert last.status == 'aborted' and 'Even after executing recovery behaviors. No plan was found' in last.text
    assert last.help == ''


def test_when_the_way_is_cleared_it_goes_on_by_itself():
    robot = Robot([AskForHelp('ask')], planner_patience=1.0)
    robot.put(4.5)
    robot.go(4.0)
    assert robot.results[-1].help
    robot.put(4.5, value=0)
    assert robot.go(60.0, until=lambda r: r.status != 'active').text == 'Goal reached.'


def test_cancelled_while_it_backs_out_or_asks_it_stands_in_the_next_step():
    for behaviour in (BackOutRecovery('back'), AskForHelp('ask')):
        robot = Robot([behaviour], stuck_timeout=1.0)
        robot.held = True
        robot.go(2.0)
        robot.held = False
        robot.go(1.5)
        assert robot.results[-1].phase == 'clearing'
        robot.machine.cancel(robot.t)
        result = robot.machine.step(robot.t, robot.pose, ZERO, robot.t)
        assert (result.status, result.command, result.help) == ('preempted', ZERO, '')
