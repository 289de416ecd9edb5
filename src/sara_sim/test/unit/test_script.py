"""A script drives a robot where it says, and a recorded drive holds all that a localiser needs."""

import math

import numpy as np
import pytest

from sara_sim.robot.recording import recorded
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import RobotConfig, ScannerConfig
from sara_sim.robot.script import Along, Face, Go, Script
from sara_sim.world.world import World

START = (1.0, 1.0, 0.0)


def drive(*motions, seconds=60.0, seed=0, scanners=(), rate=20):
    robot = SimulatedRobot(World.empty(), RobotConfig(scanners=scanners), seed, START)
    script = Script(motions)
    return robot, script, list(recorded(robot, script, seconds, rate))


def test_it_drives_along_its_points_and_faces_where_it_is_told():
    points = ((5.0, 1.0), (5.0, 4.0), (1.0, 4.0))
    robot, script, moments = drive(Along(points, speed=0.8), Face(-1.0))
    assert script.done and robot.velocity == (0.0, 0.0)
    assert math.dist(robot.pose[:2], points[-1]) < 0.08 and robot.pose[2] == pytest.approx(-1.0, abs=0.02)
    path = np.array([moment.truth[:2] for moment in moments])
    for corner in points[:2]:
        assert np.hypot(*(path - corner).T).min() < 0.3
    assert max(moment.velocity[0] for moment in moments) <= 0.8 + 1e-9


def test_it_goes_for_as_long_as_it_is_told():
    robot, script, _ = drive(Go(2.0, w=0.5), Go(1.0), Go(2.0, v=-0.2), seconds=10.0)
    assert script.done
    assert robot.pose[2] == pytest.approx(1.0, abs=0.02)
    assert math.dist(robot.pose[:2], START[:2]) == pytest.approx(0.4, abs=0.01)


def test_a_script_that_is_over_leaves_the_robot_standing():
    robot, script, moments = drive(seconds=2.0)
    assert script.done and robot.pose == START and len(moments) == 40


def test_moments_come_at_their_rate_with_the_scans_in_between():
    scanners = (ScannerConfig(rate=10), ScannerConfig(x=-0.1, yaw=math.pi, rate=5, sweep=0.05))
    _, _, moments = drive(Go(3.0, v=0.5), seconds=2.0, scanners=scanners)
    assert [moment.t for moment in moments] == pytest.approx(np.arange(1, 41) * 0.05)
    stamps = {0: [], 1: []}
    for moment in moments:
        for number, sweep in moment.scans:
            assert not sweep.fault and moment.t - 0.1 < sweep.stamp <= moment.t and len(sweep.ranges) == 541
            stamps[number].append(sweep.stamp)
    assert stamps[0] == pytest.approx(np.arange(21) * 0.1) and stamps[1] == pytest.approx(np.arange(10) * 0.2)


def test_another_seed_drives_the_same_way_and_believes_another():
    _, _, one = drive(Along(((3.0, 2.0),)), seconds=5.0, seed=1)
    _, _, same = drive(Along(((3.0, 2.0),)), seconds=5.0, seed=1)
    _, _, other = drive(Along(((3.0, 2.0),)), seconds=5.0, seed=2)
    assert [m.odometry for m in one] == [m.odometry for m in same]
    assert [m.truth for m in one] == [m.truth for m in other]
    assert one[-1].odometry != other[-1].odometry


@pytest.mark.parametrize('rate', [0, 30, 20.0, -10])
def test_a_rate_that_steps_cannot_keep_is_refused(rate):
    with pytest.raises(ValueError, match='rate is'):
        drive(rate=rate)
