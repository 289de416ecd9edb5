"""The tests of the C++ amcl: each simulated drive ends at its target in time and meets nothing on its way."""

import math
from dataclasses import replace

import pytest

from sara_lab.studies.amcl_drives import AMCL_TESTS, CORRECTED, map_file
from sara_sim.robot.recording import recorded
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.world.world import World


@pytest.fixture(scope='module')
def world():
    return World.from_yaml(map_file())


def test_there_are_nine_and_three_of_them_again_with_a_corrected_motion_model():
    again = {name for name, test in AMCL_TESTS.items() if test.parameters['odom_model_type'].endswith('-corrected')}
    assert len(AMCL_TESTS) == 12 and again == {f'{name}_corrected' for name in CORRECTED}
    for name in CORRECTED:
        first, second = AMCL_TESTS[name], AMCL_TESTS[f'{name}_corrected']
        assert replace(second, name=name, parameters=first.parameters) == first
        changed = {key for key in first.parameters if first.parameters[key] != second.parameters[key]}
        assert first.parameters.keys() == second.parameters.keys() and all(key.startswith('odom_') for key in changed)


@pytest.mark.parametrize('name', [name for name in AMCL_TESTS if not name.endswith('_corrected')])
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
