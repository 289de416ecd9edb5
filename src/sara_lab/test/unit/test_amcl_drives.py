"""The nine tests of the C++ amcl: each simulated drive ends at its target in time and meets nothing on its way."""

import math
from dataclasses import replace

import pytest

from sara_lab.studies.amcl_drives import AMCL_TESTS, map_file
from sara_sim.robot.recording import recorded
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.world.world import World


@pytest.fixture(scope='module')
def world():
    return World.from_yaml(map_file())


def test_there_are_nine():
    assert len(AMCL_TESTS) == 9


@pytest.mark.parametrize('name', AMCL_TESTS)
def test_a_drive_ends_at_its_target_and_touches_nothing(world, name):
    test = AMCL_TESTS[name]
    robot = SimulatedRobot(world, replace(test.robot, scanners=()), 0, test.start)
    script = test.script()
    ended = None
    for moment in recorded(robot, script, test.seconds):
        if script.done and ended is None:
            ended = moment.t
    assert ended is not None, 'it is not there in time'
    assert robot.stalls == 0
    assert math.dist(robot.pose[:2], test.target[:2]) < 0.1
    assert abs(math.remainder(robot.pose[2] - test.target[2], 2 * math.pi)) < 0.03


def test_the_two_scanners_of_rosie_look_both_ways(world):
    test = AMCL_TESTS['rosie_multilaser']
    moment = next(iter(test.drive(world, 0)))
    assert {number for number, _ in moment.scans} == {0, 1}
    assert all(not sweep.fault for _, sweep in moment.scans)
