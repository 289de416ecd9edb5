"""Recovery: what leads to it, what each behaviour does, and that it ends with the cycle in which the goal is given
up.
"""

import math

import numpy as np
import pytest

from sara_common.planar import Pose2D, wrap
from sara_nav.config.registry import UnknownPlanner
from sara_nav.costmaps.costmap import InflationConfig
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.goals.move_base_config import MoveBaseConfig
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.planners.grid_planner import GridPlanner
from sara_nav.planners.planning import PlanError
from sara_nav.pursuit.rotate_then_pursue import RotateThenPursue
from sara_nav.recovery.behaviours import (
    RECOVERIES,
    ClearCostmapConfig,
    ClearCostmapRecovery,
    RecoveryStep,
    RotateRecovery,
    RotateRecoveryConfig,
    Situation,
)

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
HOME, GOAL = Pose2D(1.5, 1.0, 0.0), Pose2D(5.0, 1.0, 0.0)
ZERO = (0.0, 0.0)
SLOW = RotateRecoveryConfig(max_vel_theta=0.8, acc_lim_theta=1.0, min_in_place_vel_theta=0.2)


def costmap(data):
    result = LayeredCostmap(
        CostmapConfig(),
        [
            StaticLayer('static'),
            RangeSensorLayer('ultrasonic'),
            InflationLayer('halo', InflationConfig(inflation_radius=0.4)),
        ],
        FOOTPRINT,
    )
    result.layers['static'].set_map(GridMap(data, GridGeometry(160, 80, 0.05, -1.0, -1.0)))
    return result


def corridor(narrow=False):
    """Return a map 8 m long, 4 m wide; ``narrow``: 0.9 m wide about y = 1, too narrow to turn in."""
    data = np.zeros((80, 160), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    if narrow:
        data[:31] = data[49:] = 100
    return data


def make(recoveries=(), data=None, planner=None, **config):
    data = corridor() if data is None else data
    return MoveBase(
        MoveBaseConfig(**config), costmap(data), costmap(data), planner or GridPlanner(), RotateThenPursue(), recoveries
    )


def see(machine, t, distance, x=None, y=1.0, yaw=0.0):
    """Have a sensor at the robot's front see something, in both costmaps; three readings are believed."""
    for costmap_ in (machine.global_costmap, machine.local_costmap):
        for _ in range(3):
            costmap_.layers['ultrasonic'].add_range(
                RangeReading('front', t, HOME.x + 0.5 if x is None else x, y, yaw, distance, 0.16, 2.5, 1.0)
            )


class NoWay(GridPlanner):
    """A planner without a way as long as it is told so."""

    blocked = True

    def plan(self, costmap_, start, goal):
        if self.blocked:
            raise PlanError('no way today')
        return super().plan(costmap_, start, goal)


class Noted:
    """A behaviour that takes some cycles and turns a little meanwhile."""

    def __init__(self, name, cycles, log):
        self.name, self.cycles, self.log, self.left = name, cycles, log, 0

    def start(self, situation):
        self.left = self.cycles
        self.log.append(self.name)

    def missing(self, *_):
        return []

    def update(self, situation):
        self.left -= 1
        return RecoveryStep((0.0, 0.3), self.left <= 0, self.name)


class Robot:
    """Does exactly what it is told."""

    def __init__(self, machine, pose=HOME):
        self.machine, self.pose, self.t, self.command, self.results = machine, pose, 0.0, ZERO, []

    def go(self, steps, until=lambda result: False):
        for _ in range(steps):
            result = self.machine.step(self.t, self.pose, self.command, self.t)
            self.results.append(result)
            self.command = result.command
            self.pose = self.pose.advance(*self.command, 0.05)
            self.t += 0.05
            if until(result):
                break
        return result


# -- the machine
# -------------------------------------------------------------------------------------------------------


def test_behaviours_run_in_their_order_and_then_the_goal_is_aborted_in_the_peers_words():
    log = []
    robot = Robot(make([Noted('one', 3, log), Noted('two', 1, log)], planner=NoWay(), planner_patience=1.0))
    robot.machine.set_goal(GOAL, 0.0)
    last = robot.go(400, until=lambda r: r.status == 'aborted')
    assert log == ['one', 'two']
    assert last.text.startswith('Failed to find a valid plan. Even after executing recovery behaviors.')
    assert 'planner_patience' in last.text and 'no way today' in last.text and last.command == ZERO
    announced = [r.recovery for r in robot.results if r.recovery]
    assert announced == [(0, 2, 'one'), (1, 2, 'two')]
    assert sum(r.command != ZERO for r in robot.results) == 2, 'the last cycle of a behaviour stands'
    assert robot.machine.counters.recoveries == 2


def test_a_way_found_begins_the_list_anew():
    log, planner = [], NoWay()
    robot = Robot(make([Noted('one', 1, log), Noted('two', 1, log)], planner=planner, planner_patience=0.5))
    robot.machine.set_goal(GOAL, 0.0)
    robot.go(60, until=lambda r: r.recovery)
    planner.blocked = False
    robot.go(5)
    planner.blocked = True
    robot.pose = Pose2D(robot.pose.x, robot.pose.y + 1.0, 0.0)  # off its path, so that it plans
    robot.go(60, until=lambda r: r.recovery)
    assert log == ['one', 'one']


@pytest.mark.parametrize('retries, tries', [(0, 1), (2, 3)])
def test_max_planning_retries_end_planning_before_patience_does(retries, tries):
    machine = make(planner=NoWay(), planner_patience=60.0, max_planning_retries=retries)
    robot = Robot(machine)
    machine.set_goal(GOAL, 0.0)
    last = robot.go(200, until=lambda r: r.status == 'aborted')
    assert machine.counters.failed_plans == tries and 'max_planning_retries' in last.text


def test_without_recovery_the_goal_is_aborted_at_once():
    log = []
    robot = Robot(make([Noted('one', 1, log)], planner=NoWay(), planner_patience=1.0, recovery_behavior_enabled=False))
    robot.machine.set_goal(GOAL, 0.0)
    last = robot.go(100, until=lambda r: r.status == 'aborted')
    assert not log and last.text.startswith('Failed to find a valid plan.')
    assert robot.t < 2.5


def test_an_obstacle_that_was_never_there_is_cleared_and_the_goal_reached():
    """The sensor's ghost fills the corridor's width ahead; without clearing there is no way."""
    data = corridor(narrow=True)
    blocked = Robot(make((), data, planner_patience=2.0))
    see(blocked.machine, 0.0, 0.6)
    blocked.machine.set_goal(GOAL, 0.0)
    assert blocked.go(200, until=lambda r: r.status != 'active').text.startswith('Failed to find a valid')
    clear = ClearCostmapRecovery('clear', ClearCostmapConfig(reset_distance=0.0))
    robot = Robot(make([clear], data, planner_patience=2.0))
    see(robot.machine, 0.0, 0.6)
    robot.machine.set_goal(GOAL, 0.0)
    last = robot.go(900, until=lambda r: r.status != 'active')
    assert (last.status, last.text) == ('succeeded', 'Goal reached.')
    assert robot.machine.counters.recoveries == 1


def test_what_is_cleared_is_clear_before_the_next_command():
    """A ghost before the robot that only the local costmap holds, slow to be updated: one clearing is enough."""
    machine = make(
        [ClearCostmapRecovery('clear', ClearCostmapConfig(reset_distance=0.0)), Noted('two', 1, [])],
        corridor(narrow=True),
        controller_patience=1.0,
    )
    machine.local_costmap.reconfigure(CostmapConfig(update_frequency=0.1))
    robot = Robot(machine)
    machine.set_goal(GOAL, 0.0)
    robot.go(20)
    for _ in range(3):
        machine.local_costmap.layers['ultrasonic'].add_range(
            RangeReading('front', robot.t, robot.pose.x + 0.5, 1.0, 0.0, 0.3, 0.16, 2.5, 1.0)
        )
    machine.local_costmap.update(robot.t, robot.pose)
    last = robot.go(900, until=lambda r: r.status != 'active')
    assert last.text == 'Goal reached.'
    assert [r.recovery for r in robot.results if r.recovery] == [(0, 2, 'clear')]


def test_oscillation_leads_to_recovery_and_in_the_end_to_the_peers_word():
    log = []
    machine = make([Noted('one', 1, log)], oscillation_timeout=2.0, oscillation_distance=0.5)
    machine.set_goal(GOAL, 0.0)
    for cycle in range(300):  # a robot that does not get on, whatever it is told
        result = machine.step(0.05 * cycle, HOME, ZERO)
        if result.status != 'active':
            break
    assert log == ['one']
    assert result.text.startswith('Robot is oscillating. Even after executing recovery behaviors.')
    assert 4.0 < 0.05 * cycle < 4.5


def test_a_robot_that_gets_on_does_not_oscillate():
    robot = Robot(make(oscillation_timeout=3.0, oscillation_distance=0.5))
    robot.machine.set_goal(GOAL, 0.0)
    assert robot.go(600, until=lambda r: r.status != 'active').text == 'Goal reached.'


@pytest.mark.parametrize('give_up, status', [('cancel', 'preempted'), ('abort', 'aborted')])
def test_every_cycle_of_every_behaviour_can_be_the_last(give_up, status):
    """Cancelled or aborted in whichever cycle of recovery, the very next command is zero, and nothing follows."""
    seen = 0
    for cycles in range(0, 180, 11):
        robot = Robot(
            make([RotateRecovery('turn', SLOW), ClearCostmapRecovery('clear')], planner=NoWay(), planner_patience=0.5)
        )
        robot.machine.set_goal(GOAL, 0.0)
        robot.go(100, until=lambda r: r.recovery)
        robot.go(1 + cycles)
        seen += robot.command != ZERO
        robot.machine.cancel(robot.t) if give_up == 'cancel' else robot.machine.abort('Enough.')
        result = robot.go(1)
        assert (result.status, result.command) == (status, ZERO)
        after = robot.go(3)
        assert (after.status, after.command) == ('idle', ZERO)
    assert seen > 10


def test_a_pose_that_is_lost_while_turning_stops_and_aborts():
    machine = make([RotateRecovery('turn', SLOW)], planner=NoWay(), planner_patience=0.5)
    robot = Robot(machine)
    machine.set_goal(GOAL, 0.0)
    robot.go(100, until=lambda r: r.command != ZERO)
    result = machine.step(robot.t, None)
    assert (result.status, result.command) == ('active', ZERO)
    result = machine.step(robot.t + 1.0, None)
    assert (result.status, result.command) == ('aborted', ZERO)


def test_a_new_goal_while_recovering_is_planned_to_at_once():
    planner = NoWay()
    robot = Robot(make([RotateRecovery('turn', SLOW)], planner=planner, planner_patience=0.5))
    robot.machine.set_goal(GOAL, 0.0)
    robot.go(100, until=lambda r: r.command != ZERO)
    planner.blocked = False
    assert robot.machine.set_goal(Pose2D(3.0, 1.0, 0.0), robot.t) == ''
    result = robot.go(1)
    assert result.phase == 'controlling' and result.plan is not None


# -- clear_costmap_recovery
# ----------------------------------------------------------------------------------------------


def seen_costmaps(distance=2.0):
    machine = make()
    see(machine, 0.0, distance)
    for costmap_ in (machine.global_costmap, machine.local_costmap):
        costmap_.update(0.0, HOME)
    return machine


def lethal(costmap_):
    return int((costmap_.costmap.costs == 254).sum())


def situation(machine, pose=HOME, **changes):
    values = dict(
        t=1.0,
        dt=0.05,
        pose=pose,
        local_pose=pose,
        velocity=ZERO,
        world=machine.costmaps.around(pose, None, True),
        costmaps=machine.costmaps,
    )
    values.update(changes)
    return Situation(**values)


@pytest.mark.parametrize(
    'affected, cleared', [('both', (True, True)), ('global', (True, False)), ('local', (False, True))]
)
def test_clearing_forgets_what_sensors_saw_and_never_the_map(affected, cleared):
    machine = seen_costmaps()
    empty = make()
    empty.global_costmap.update(0.0, HOME)
    walls = lethal(empty.global_costmap)
    assert lethal(machine.global_costmap) > walls
    behaviour = ClearCostmapRecovery('clear', ClearCostmapConfig(1.0, affected_maps=affected, force_updating=True))
    step = behaviour.update(situation(machine))
    assert step.done and step.command == ZERO and 'ultrasonic' in step.text
    for costmap_, gone in zip((machine.global_costmap, machine.local_costmap), cleared):
        assert (lethal(costmap_) == walls) == gone


def test_what_lies_within_the_square_is_kept_or_with_invert_what_lies_outside():
    for distance, invert, gone in ((2.0, False, True), (2.0, True, False), (0.4, False, False), (0.4, True, True)):
        machine = seen_costmaps(distance)
        before = lethal(machine.local_costmap)
        ClearCostmapRecovery('clear', ClearCostmapConfig(3.0, invert, True)).update(situation(machine))
        assert (lethal(machine.local_costmap) < before) == gone, (distance, invert)


def test_without_force_updating_the_costmap_follows_when_it_is_due():
    machine = seen_costmaps()
    before = lethal(machine.local_costmap)
    ClearCostmapRecovery('clear', ClearCostmapConfig(1.0)).update(situation(machine))
    assert lethal(machine.local_costmap) == before
    machine.local_costmap.update(1.2, HOME)
    assert lethal(machine.local_costmap) < before


def test_layers_that_do_not_exist_are_said():
    machine = make()
    both = machine.global_costmap, machine.local_costmap
    assert ClearCostmapRecovery('clear').missing(*both) == []
    said = ClearCostmapRecovery('clear', ClearCostmapConfig(layer_names=('obstacles', 'ultrasonic'))).missing(*both)
    assert len(said) == 1 and "'obstacles'" in said[0] and 'ultrasonic' in said[0]
    said = ClearCostmapRecovery('clear', ClearCostmapConfig(layer_names=('obstacles',))).missing(*both)
    assert 'nothing to clear' in said[1]


def test_the_map_is_cleared_when_it_is_named_as_the_peer_does():
    machine = seen_costmaps()
    ClearCostmapRecovery(
        'clear', ClearCostmapConfig(1.0, layer_names=('static', 'ultrasonic'), force_updating=True)
    ).update(situation(machine))
    assert lethal(machine.global_costmap) == 0


# -- rotate_recovery
# -----------------------------------------------------------------------------------------------------


def turn(machine, behaviour, pose=HOME, cycles=400, obey=1.0):
    """Return (the last step, poses, rates) of a turn in place by a robot that does ``obey`` of what it is told."""
    poses, rates, t, rate = [pose], [0.0], 0.0, 0.0
    behaviour.start(situation(machine, pose, t=t))
    for _ in range(cycles):
        step = behaviour.update(situation(machine, poses[-1], t=t, velocity=(0.0, rate)))
        rate = step.command[1]
        rates.append(rate)
        if step.done:
            break
        poses.append(poses[-1].advance(0.0, obey * rate, 0.05))
        t += 0.05
    return step, poses, rates


@pytest.mark.parametrize('yaw', [0.0, 2.0, math.pi, -3.0])
def test_it_turns_once_about_within_its_limits_and_ends_where_it_began(yaw):
    machine = make()
    machine.local_costmap.update(0.0, HOME)
    step, poses, rates = turn(machine, RotateRecovery('turn', SLOW), Pose2D(HOME.x, HOME.y, yaw))
    assert step.done and step.command == ZERO and 'turned once about' in step.text
    turned = sum(wrap(b.yaw - a.yaw) for a, b in zip(poses, poses[1:]))
    assert abs(turned - 2.0 * math.pi) <= SLOW.yaw_goal_tolerance + 0.05 * SLOW.max_vel_theta
    assert max(rates) == pytest.approx(SLOW.max_vel_theta)
    assert max(np.diff(rates)) <= SLOW.acc_lim_theta * 0.05 + 1e-9
    braking = list(rates[1:-1])[-5:]
    assert braking == sorted(braking, reverse=True) and min(rates[1:-1]) > 0.0


def test_it_does_not_turn_where_it_would_touch_something():
    machine = make(data=corridor(narrow=True))
    machine.local_costmap.update(0.0, HOME)
    step, poses, rates = turn(machine, RotateRecovery('turn', SLOW))
    assert step.done and set(rates) == {0.0} and 'potential collision' in step.text


def test_it_stops_for_what_comes_up_while_it_turns():
    machine = make()
    machine.local_costmap.update(0.0, HOME)
    behaviour = RotateRecovery('turn', SLOW)
    behaviour.start(situation(machine, t=0.0))
    for cycle in range(20):
        step = behaviour.update(situation(machine, t=0.05 * cycle))
    assert step.command[1] > 0.5 and not step.done
    see(machine, 1.0, 0.3, x=HOME.x, y=HOME.y, yaw=math.pi / 2)
    machine.local_costmap.update(1.0, HOME)
    step = behaviour.update(situation(machine, t=1.0))
    assert step.done and step.command == ZERO and 'potential collision' in step.text


def test_a_robot_that_does_not_obey_is_given_up_on():
    machine = make()
    machine.local_costmap.update(0.0, HOME)
    config = RotateRecoveryConfig(min_in_place_vel_theta=0.8, sim_granularity=0.05)
    step, poses, _ = turn(machine, RotateRecovery('turn', config), cycles=2000, obey=0.0)
    assert step.done and 'given up' in step.text and len(poses) * 0.05 == pytest.approx(4.0 * math.pi / 0.8, abs=0.2)


def test_it_waits_until_the_robot_stands():
    machine = make()
    machine.local_costmap.update(0.0, HOME)
    behaviour = RotateRecovery('turn', SLOW)
    behaviour.start(situation(machine, t=0.0))
    step = behaviour.update(situation(machine, t=0.0, velocity=(0.3, 0.0)))
    assert not step.done and step.command == ZERO


# -- names and parameters
# ------------------------------------------------------------------------------------------------


def test_names():
    assert RECOVERIES.find('clear_costmap_recovery/ClearCostmapRecovery') is ClearCostmapRecovery
    assert RECOVERIES.find('RotateRecovery') is RotateRecovery
    with pytest.raises(UnknownPlanner, match='use clear_costmap_recovery.ClearCostmapRecovery'):
        RECOVERIES.find('move_slow_and_clear/MoveSlowAndClear')
    with pytest.raises(UnknownPlanner, match='allowed are clear_costmap'):
        RECOVERIES.find('my/Own')


@pytest.mark.parametrize(
    'config, text',
    [
        (ClearCostmapConfig(-1.0), 'reset_distance is -1'),
        (ClearCostmapConfig(math.nan), 'reset_distance is nan'),
        (ClearCostmapConfig(affected_maps='all'), "affected_maps is 'all'"),
        (ClearCostmapConfig(layer_names=(1,)), 'layer_names is'),
        (RotateRecoveryConfig(sim_granularity=0.0), 'sim_granularity is 0'),
        (RotateRecoveryConfig(max_vel_theta=math.inf), 'max_vel_theta is inf'),
    ],
)
def test_bad_parameters_are_said(config, text):
    assert any(text in fault for fault in config.faults())
