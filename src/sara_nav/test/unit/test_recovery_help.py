"""Asking for help: what is said, for how long it waits, and what ends the waiting."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners.planning import PlanError, dense_plan
from sara_nav.recovery.behaviours import RECOVERIES, Situation
from sara_nav.recovery.help import SIDES, AskForHelp, AskForHelpConfig, nearest_obstacle

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
HERE, GOAL = Pose2D(0.0, 0.0, 0.0), Pose2D(4.0, 0.0, 0.0)
PLAN = dense_plan([(0.0, 0.0), (4.0, 0.0)], 0.0)
BOX = 0.85, 0.0


def world(*places):
    """Return the LocalWorld of 8 x 8 m about the origin with a cell occupied at each place (m)."""
    costs = np.zeros((160, 160), np.uint8)
    for x, y in places:
        costs[int((y + 4) * 20), int((x + 4) * 20)] = 254
    return LocalWorld(Costmap(costs, GridGeometry(160, 160, 0.05, -4.0, -4.0)), FOOTPRINT)


class Waiting:
    """A behaviour on a robot that stands; ``blocked`` and ``planless`` say how the way is."""

    def __init__(self, blocked=False, planless=False, **config):
        self.behaviour = AskForHelp('ask', AskForHelpConfig(**dict(dict(patience=30.0), **config)))
        self.t, self.blocked, self.planless, self.plans = 10.0, blocked, planless, 0
        self.behaviour.start(self.situation())

    def situation(self):
        costmap = LayeredCostmap(CostmapConfig(), [], FOOTPRINT)
        return Situation(
            self.t,
            0.05,
            HERE,
            HERE,
            (0.0, 0.0),
            world(*([BOX] if self.blocked else [])),
            CostmapPair(costmap, costmap),
            None,
            GOAL,
            'No way was found.',
            self.plan,
        )

    def plan(self):
        self.plans += 1
        if self.planless:
            raise PlanError('none')
        return PLAN

    def wait(self, seconds):
        """Return the last step."""
        for _ in range(round(seconds * 20)):
            self.t += 0.05
            step = self.behaviour.update(self.situation())
            assert step.command == (0.0, 0.0)
            if step.done:
                break
        return step


def test_it_is_registered():
    assert RECOVERIES.find('sara_nav/AskForHelp') is AskForHelp


@pytest.mark.parametrize('how', [dict(blocked=True), dict(planless=True)])
def test_it_says_what_is_wrong_and_what_helps_until_the_way_is_free(how):
    robot = Waiting(**how)
    step = robot.wait(5.0)
    assert not step.done and step.help.startswith('Help, please: I cannot get on to (4.00, 0.00). No way was found. ')
    assert step.help in step.text and 'drive me on by hand' in step.help
    assert ('The nearest thing stands 0.33 m ahead.' in step.help) == robot.blocked
    assert step.help == robot.wait(3.0).help, 'one sentence, said once'
    robot.blocked = robot.planless = False
    step = robot.wait(1.1)
    assert step.done and not step.help


@pytest.mark.parametrize('how', [dict(blocked=True), dict(planless=True)])
def test_when_its_patience_is_over_the_next_behaviour_goes_on(how):
    """It forgets nothing itself: what stands before the robot may be where no sensor hears it now."""
    robot = Waiting(**how)
    assert not robot.wait(29.0).done
    step = robot.wait(2.0)
    assert step.done and not step.help and '30 s (patience)' in step.text


def test_it_tries_to_plan_once_a_second():
    robot = Waiting(planless=True)
    robot.wait(10.0)
    assert robot.plans in (10, 11)


def test_what_it_cannot_see_is_tried_once_more_when_its_patience_is_over():
    robot = Waiting()
    step = robot.wait(29.0)
    assert not step.done and 'see what holds me' in step.help
    step = robot.wait(2.0)
    assert step.done


@settings(max_examples=100)
@given(
    st.floats(0.05, 0.9),
    st.floats(-math.pi, math.pi),
    st.floats(-math.pi, math.pi),
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
)
def test_the_side_of_what_is_nearest_is_the_robots_own_however_it_stands(gap, bearing, yaw, x, y):
    """From the edge of the footprint's box outward at an angle; at corners the box has more than one nearest place."""
    c, s = math.cos(bearing), math.sin(bearing)
    u, v = (
        (math.copysign(0.54, c) if abs(c) > 0.5 else 0.0) + gap * c,
        (math.copysign(0.29, s) if abs(s) > 0.5 else 0.0) + gap * s,
    )
    pose = Pose2D(x, y, yaw)
    place = x + math.cos(yaw) * u - math.sin(yaw) * v, y + math.sin(yaw) * u + math.cos(yaw) * v
    found = nearest_obstacle(world(place), pose, 2.0)
    aside = max(abs(u) - 0.54, 0.0), max(abs(v) - 0.29, 0.0)
    if found is None or math.hypot(*aside) < 0.15:
        return  # within a cell or two of the footprint the side may be the next one
    assert abs(found[0] - math.hypot(*aside)) < 0.04
    there = math.atan2(math.copysign(aside[1], v), math.copysign(aside[0], u))
    named = SIDES.index(found[1]) * math.pi / 4
    assert abs(math.remainder(named - there, 2.0 * math.pi)) <= math.pi / 8 + 0.35


def test_far_things_are_not_told_of():
    assert nearest_obstacle(world((2.5, 0.0)), HERE, 1.0) is None and nearest_obstacle(world(), HERE, 1.0) is None


@pytest.mark.parametrize('values', [dict(patience=0.0), dict(look_ahead=math.nan), dict(nearby=-1.0)])
def test_parameters_are_checked(values):
    assert list(values)[0] in AskForHelpConfig(**values).faults()[0]
