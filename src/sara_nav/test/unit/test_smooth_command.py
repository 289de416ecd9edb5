"""How the robot comes to rest."""

import numpy as np
import pytest

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import LETHAL, Costmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners.local_command import BLOCKED, DRIVING
from sara_nav.pursuit.cycle import Cycle
from sara_nav.pursuit.messages import Words
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_command import SmoothCommand

SARA = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
GRID = GridGeometry(120, 80, 0.05, -1.0, -2.0)
DT = 0.1


def stopping(gap):
    """(way m until it stands, states) from 0.8 m/s with a box so far (m) before the front; None: with none."""
    costs = np.zeros(GRID.shape, np.uint8)
    if gap is not None:
        column = round((0.54 + gap - GRID.origin_x) / GRID.resolution)
        costs[36:44, column : column + 6] = LETHAL
    world, command = LocalWorld(Costmap(costs, GRID), SARA), SmoothCommand(RotateThenPursueConfig(), Words())
    command.last, way, states = (0.8, 0.0), 0.0, []
    for number in range(80):
        now = Pose2D(way, 0.0, 0.0)
        cycle = Cycle(DT * number, DT, now, now, command.last, command.last, 1.0, False, command.last[0], world)
        after = command.come_to_rest(cycle, 'comes to rest')
        command.last = after.v, after.w
        states.append(after.state)
        way += after.v * DT
        if after.v == 0.0:
            return way, states
    raise AssertionError('it does not stand')


def test_with_nothing_in_the_way_it_comes_to_rest_gently():
    way, states = stopping(None)
    assert 0.6 < way < 1.2 and set(states) == {DRIVING}
    assert stopping(2.0)[0] == way


@pytest.mark.parametrize('gap', [0.03, 0.1, 0.3, 0.5, 0.7])
def test_what_has_just_appeared_is_not_touched(gap):
    """The robot brakes harder, and stands at once where that is too late."""
    way, states = stopping(gap)
    assert way < gap and (states == [BLOCKED]) == (gap < 0.1)
