"""The state machine: every way a goal can end, and that the command is zero on each."""
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_nav.costmap import InflationConfig
from sara_nav.footprint import parse_footprint
from sara_nav.geometry import Pose2D
from sara_nav.grid import GridGeometry
from sara_nav.grid_planner import GridPlanner
from sara_nav.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.layers.inflation import InflationLayer
from sara_nav.layers.static import StaticLayer
from sara_nav.map_io import GridMap
from sara_nav.move_base import MoveBase
from sara_nav.move_base_config import MoveBaseConfig
from sara_nav.rotate_then_pursue import RotateThenPursue

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
HOME = Pose2D(1.0, 1.0, 0.0)
GOAL = Pose2D(5.0, 1.0, 0.0)
ZERO = (0.0, 0.0)


def room(walled=False):
    data = np.zeros((160, 160), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    if walled:
        data[:, 80] = 100
    return GridMap(data, GridGeometry(160, 160, 0.05, -1.0, -1.0))


def costmap(grid_map, **config):
    result = LayeredCostmap(CostmapConfig(**config), [StaticLayer('static'), InflationLayer('halo', InflationConfig(
        inflation_radius=0.6))], FOOTPRINT)
    if grid_map is not None:
        result.layers['static'].set_map(grid_map)
    return result


def make(grid_map=room(), recoveries=(), planner=None, **config):
    return MoveBase(MoveBaseConfig(**config), costmap(grid_map), costmap(grid_map), planner or GridPlanner(),
                    RotateThenPursue(), recoveries)


class Perfect:
    """Drives move_base with a robot that does exactly what it is told."""

    def __init__(self, move_base, pose=HOME):
        self.move_base, self.pose, self.t, self.command = move_base, pose, 0.0, ZERO

    def go(self, steps, until=None):
        for _ in range(steps):
            result = self.move_base.step(self.t, self.pose, self.command, self.t)
            self.command = result.command
            self.pose = self.pose.advance(*self.command, 0.05)
            self.t += 0.05
            if result.status == until:
                break
        return result


def driving():
    robot = Perfect(make())
    assert robot.move_base.set_goal(GOAL, 0.0) == ''
    result = robot.go(40)
    assert result.status == 'active' and result.command[0] > 0.3
    return robot


def test_idle_commands_nothing():
    result = make().step(0.0, HOME)
    assert (result.status, result.command, result.plan) == ('idle', ZERO, None)


def test_a_goal_is_planned_at_once_and_reached():
    robot = Perfect(make())
    robot.move_base.set_goal(GOAL, 0.0)
    first = robot.move_base.step(0.0, HOME)
    assert first.status == 'active' and first.plan is not None and len(first.plan) > 50
    last = robot.go(600, until='succeeded')
    assert (last.status, last.text, last.command) == ('succeeded', 'Goal reached.', ZERO)
    assert robot.go(1).status == 'idle'
    assert robot.pose.distance(GOAL) < 0.05


def test_cancel_is_zero_in_the_next_step_in_every_phase():
    seen = set()
    for steps in range(0, 320, 4):
        robot = Perfect(make())
        robot.move_base.set_goal(Pose2D(2.0, 2.0, 3.0), 0.0)
        if steps and robot.go(steps).status != 'active':
            break
        seen.add(robot.move_base.local_planner.phase)
        robot.move_base.cancel(robot.t)
        result = robot.go(1)
        assert (result.status, result.command) == ('preempted', ZERO)
        assert robot.go(1).status == 'idle'
    assert {'turn to path', 'follow path', 'turn to goal'} <= seen


def test_cancel_without_a_goal_is_nothing():
    move_base = make()
    move_base.cancel(0.0)
    assert move_base.step(0.0, HOME).status == 'idle'


def test_a_new_goal_takes_over_without_a_stop():
    robot = driving()
    before = robot.command[0]
    robot.move_base.set_goal(Pose2D(4.5, 1.0, 0.0), robot.t)
    result = robot.go(1)
    assert result.status == 'active' and result.plan is not None and result.command[0] > before - 0.05
    assert robot.go(600, until='succeeded').status == 'succeeded'
    assert robot.move_base.counters.preempted == 1


@pytest.mark.parametrize('goal, reason', [
    (Pose2D(math.nan, 1.0, 0.0), 'NaN'), (Pose2D(1.0, 1.0, math.inf), 'NaN'), (Pose2D(100.0, 1.0, 0.0), 'off the map'),
    (Pose2D(-1.0, 3.0, 0.0), 'overlap'), (Pose2D(-0.6, 3.0, 0.0), 'overlap')])
def test_bad_goals_are_refused_and_stop_the_robot(goal, reason):
    robot = driving()
    assert reason in robot.move_base.set_goal(goal, robot.t)
    result = robot.go(1)
    assert (result.status, result.command) == ('aborted', ZERO) and reason in result.text
    assert robot.go(1).status == 'idle'


def test_a_goal_beside_a_wall_is_judged_by_its_yaw():
    assert make().refusal(Pose2D(-0.55, 3.0, math.pi / 2), 0.0) == ''
    assert 'overlap' in make().refusal(Pose2D(-0.55, 3.0, 0.0), 0.0)


def test_without_a_map_goals_are_refused():
    move_base = make(None)
    assert 'no map' in move_base.set_goal(GOAL, 0.0)
    assert move_base.step(0.0, HOME).status == 'aborted'


def test_unreachable_goals_end_after_planner_patience():
    robot = Perfect(make(room(walled=True), planner_patience=2.0))
    robot.move_base.set_goal(GOAL, 0.0)
    result = robot.go(1)
    assert (result.status, result.phase, result.command) == ('active', 'planning', ZERO) and 'no way' in result.text
    result = robot.go(200, until='aborted')
    assert result.status == 'aborted' and 'planner_patience' in result.text and result.command == ZERO
    assert 2.0 <= robot.t <= 3.2


def test_a_map_that_opens_while_planning_is_used():
    robot = Perfect(make(room(walled=True)))
    robot.move_base.set_goal(GOAL, 0.0)
    robot.go(10)
    robot.move_base.global_costmap.layers['static'].set_map(room())
    robot.move_base.local_costmap.layers['static'].set_map(room())
    assert robot.go(25).status == 'active' and robot.move_base.counters.plans == 1


def test_a_new_map_is_planned_on_at_once():
    robot = driving()
    robot.move_base.global_costmap.layers['static'].set_map(room(walled=True))
    robot.move_base.replan()
    result = robot.go(1)
    assert (result.phase, result.command) == ('planning', ZERO) and 'no way' in result.text


LOST = [(None, 0.0), (HOME, 0.6), (Pose2D(math.nan, 0.0, 0.0), 0.0), (HOME, math.nan)]


@pytest.mark.parametrize('pose, age', LOST)
def test_lost_localization_stops_at_once_and_aborts_for_good(pose, age):
    robot = driving()
    last_pose = robot.t - 0.05
    result = robot.move_base.step(robot.t, pose, ZERO, robot.t - age)
    while result.status == 'active':
        assert result.command == ZERO and 'transform_tolerance' in result.text
        robot.t += 0.05
        result = robot.move_base.step(robot.t, pose, ZERO, robot.t - age)
    assert (result.status, result.command) == ('aborted', ZERO)
    assert robot.t - last_pose <= 0.55 + 1e-9
    after = robot.go(20)
    assert (after.status, after.command) == ('idle', ZERO)


@pytest.mark.parametrize('pose, age', LOST)
def test_a_goal_given_before_there_is_a_pose_waits_for_the_patience(pose, age):
    machine = make()
    machine.set_goal(GOAL, 0.0)
    for cycle in range(20):
        result = machine.step(0.05 * cycle, pose, ZERO, 0.05 * cycle - age)
        assert (result.status, result.command) == ('active', ZERO) and 'transform_tolerance' in result.text
    assert machine.step(1.0, pose, ZERO, 1.0 - age).status == 'aborted'


def test_a_short_gap_in_localization_is_a_stop_from_which_it_speeds_up_afresh():
    robot = driving()
    assert robot.move_base.step(robot.t, None).command == ZERO
    robot.t += 0.05
    assert 0.0 < robot.go(1).command[0] <= 0.4 * 0.05 + 1e-9


def test_time_that_goes_back_ends_the_goal():
    robot = driving()
    robot.t -= 1.0
    result = robot.go(1)
    assert (result.status, result.command) == ('aborted', ZERO) and 'back' in result.text


def test_replanning_goes_on_at_planner_frequency():
    robot = Perfect(make(planner_frequency=2.0))
    robot.move_base.set_goal(GOAL, 0.0)
    robot.go(100)
    assert 9 <= robot.move_base.counters.plans <= 11
    assert robot.go(600, until='succeeded').status == 'succeeded'


def test_pushed_off_its_path_it_plans_anew():
    robot = driving()
    plans = robot.move_base.counters.plans
    robot.pose = Pose2D(robot.pose.x, robot.pose.y + 1.0, robot.pose.yaw)
    robot.go(40)
    assert robot.move_base.counters.plans == plans + 1
    assert robot.go(900, until='succeeded').status == 'succeeded'


def test_the_same_run_twice_is_the_same():
    runs = []
    for _ in range(2):
        robot = Perfect(make())
        robot.move_base.set_goal(Pose2D(4.0, 4.0, 1.0), 0.0)
        robot.go(600, until='succeeded')
        runs.append((robot.t, robot.pose))
    assert runs[0] == runs[1]


def test_bad_settings_are_all_said():
    with pytest.raises(ValueError) as error:
        make(controller_frequency=0.0, planner_patience=-1.0, max_planning_retries=-2)
    for text in ('controller_frequency is 0', 'planner_patience is -1', 'max_planning_retries is -2'):
        assert text in str(error.value)


anything = st.one_of(st.floats(-3.0, 9.0), st.sampled_from([math.nan, math.inf, -math.inf, 1e300]))
any_pose = st.builds(Pose2D, anything, anything, anything)
moves = st.one_of(st.tuples(st.just('goal'), any_pose), st.tuples(st.just('cancel'), st.none()),
                  st.tuples(st.just('step'), st.one_of(st.none(), any_pose)),
                  st.tuples(st.just('velocity'), st.tuples(anything, anything)),
                  st.tuples(st.just('jump'), st.sampled_from([-5.0, 0.0, 30.0])))


@settings(deadline=None, max_examples=150)
@given(st.lists(moves, max_size=25))
def test_whatever_comes_the_command_is_sound(script):
    """Random goals, cancels, poses, speeds and jumps of time: no exception, limits kept, zero unless active."""
    move_base, t, velocity, pose = make(), 0.0, ZERO, HOME
    for kind, value in script:
        if kind == 'goal':
            move_base.set_goal(value, t)
        elif kind == 'cancel':
            move_base.cancel(t)
        elif kind == 'velocity':
            velocity = value
        elif kind == 'jump':
            t += value
        else:
            pose = value
        result = move_base.step(t, pose, velocity, t)
        assert abs(result.command[0]) <= 0.5 + 1e-9 and abs(result.command[1]) <= 0.4 + 1e-9
        assert result.status == 'active' or result.command == ZERO
        t += 0.05
