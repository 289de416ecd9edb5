"""Poses and walls solved together, where not all readings are of their wall's line."""

import numpy as np
import pytest

from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.wall_graph import Evidence, Solved, optimise

STEP, NODES, AHEAD, ASIDE = 0.15, 41, 8.0, 1.5
"""m from pose to pose along x; how many; x of a wall ahead; m to one at the left."""


def solved(readings, first_step=STEP):
    """What comes of readings (node, wall, m) of a robot that drives on along x by odometry without an error, the walls
    ahead and at the left being known. first_step: m, of the first guess.
    """
    node, wall, ranges = (np.array(column) for column in zip(*readings))
    relations = np.tile((STEP, 0.0, 0.0), (NODES - 1, 1))
    poses = np.zeros((NODES, 3))
    poses[:, 0] = first_step * np.arange(NODES)
    walls = np.array([(np.pi, -AHEAD), (-0.5 * np.pi, -ASIDE)])
    evidence = Evidence(relations, node, wall, np.zeros((len(node), 2)), ranges, np.array([False, True]), 0)
    return optimise(SonarConfig(), Solved(poses, walls, np.zeros(2)), evidence)


def good(nodes):
    return [(node, 0, AHEAD - STEP * node) for node in nodes] + [(node, 1, ASIDE) for node in nodes]


def along(found):
    """(NODES,) m that the poses are off along x."""
    return found.poses[:, 0] - STEP * np.arange(NODES)


def test_what_is_as_it_was_heard_stays():
    found = solved(good(range(NODES)))
    assert np.abs(along(found)).max() < 1e-6
    assert np.abs(found.walls - [(np.pi, -AHEAD), (-0.5 * np.pi, -ASIDE)]).max() < 1e-6


@pytest.mark.parametrize('sign', (-1.0, 1.0))
@pytest.mark.parametrize('longest', (0.08, 0.15, 0.25))
def test_echoes_of_a_walls_end_bend_no_map(longest, sign):
    """Where the foot of the sensor lies beyond the end of the wall, its end is heard, which is farther off: here by
    three times as many readings as tell of the wall itself.
    """
    last = range(NODES - 6, NODES)
    ends = [
        (node, 0, AHEAD - STEP * node + sign * more) for node in last for more in np.linspace(0.0, longest, 120) if more
    ]
    found = solved(good(range(NODES)) + good(last) * 39 + ends)
    assert np.abs(along(found)).max() < 0.02


def test_a_first_guess_that_is_far_off_is_drawn_to_what_was_heard():
    found = solved(good(range(NODES)), 1.02 * STEP)
    assert np.abs(along(found)).max() < 1e-3
