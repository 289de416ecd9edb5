"""Plans that take longer than a control cycle: a zero goes out first; one from where the robot was is made anew."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from sara_common.planar import Pose2D

sys.path.append(str(Path(__file__).parent))
from test_move_base import GOAL, Perfect, make  # noqa: E402  pylint: disable=wrong-import-position


class Slow:
    """Another planner, whose plans take some time (s) on the test's clock, in which the robot coasts on (m/s)."""

    def __init__(self, planner):
        self.planner, self.config = planner, planner.config
        self.robot, self.takes, self.coasts = None, 0.0, 0.0

    def plan(self, costmap, start, goal):
        plan = self.planner.plan(costmap, start, goal)
        self.robot.t += self.takes
        self.robot.pose = self.robot.pose.advance(self.coasts, 0.0, self.takes)
        return plan


def under_way():
    """A robot that drives, and its planner, which is quick until it is told otherwise."""
    machine = make()
    planner = Slow(machine.global_planner)
    machine.reconfigure(machine.config, planner)
    planner.robot = robot = Perfect(machine)
    assert machine.set_goal(GOAL, 0.0) == ''
    robot.go(40)
    assert robot.command[0] > 0.3 and machine.counters.plans == 1
    return robot, planner


def test_a_zero_goes_out_before_a_plan_that_may_take_long():
    robot, planner = under_way()
    machine, said = robot.move_base, []
    machine.before_planning = lambda: said.append(machine.counters.plans)
    machine.replan()
    robot.go(1)
    assert said == [1]  # there is no valid plan
    machine.config = replace(machine.config, planner_frequency=2.0)
    robot.go(30)
    assert said == [1] and machine.counters.plans >= 4  # all is well
    planner.takes = 0.3
    while robot.t < 6.0:
        robot.go(1)
    assert said[1:] == list(range(said[1], machine.counters.plans))  # from the second long one on


@pytest.mark.parametrize('active', [True, False])
def test_a_planner_that_is_asked_itself_knows_the_footprint_and_a_robot_on_its_way_waits(active):
    machine, said = make(), []
    machine.before_planning = lambda: said.append(True)
    told = []
    machine.global_planner.set_footprint = told.append
    plan, text = machine.plans.of_planner(Pose2D(1.0, 1.0, 0.0), GOAL, active)
    assert len(plan) > 2 and text == '' and len(said) == active
    assert len(told) == 1 and told[0] is machine.global_costmap.footprint


@pytest.mark.parametrize('takes, coasts, more', ((0.1, 0.4, 0), (0.6, 0.0, 0), (0.6, 0.4, 1)))
def test_a_long_plan_that_begins_where_the_robot_is_no_more_is_made_anew(takes, coasts, more):
    robot, planner = under_way()
    planner.takes, planner.coasts = takes, coasts
    robot.move_base.replan()
    robot.go(1)
    planner.coasts = 0.0  # it has come to rest by the next
    assert robot.go(3).status == 'active'
    assert robot.move_base.counters.plans == 2 + more
    assert robot.go(900, 'succeeded').status == 'succeeded'


def test_it_is_made_anew_until_the_robot_has_come_to_rest():
    robot, planner = under_way()
    planner.takes, planner.coasts = 0.6, 0.2
    robot.move_base.replan()
    assert all(robot.go(1).plan is not None for _ in range(5))


def test_a_turn_meanwhile_counts_as_well():
    robot, planner = under_way()
    planner.takes = 0.6
    robot.move_base.replan()
    robot.go(1)
    robot.pose = robot.pose._replace(yaw=robot.pose.yaw + 0.1)
    robot.go(1)
    assert robot.move_base.counters.plans == 3
