"""A robot that is carried: where it goes, what its wheels and its gyro make of it."""

import math

import numpy as np
import pytest

from sara_common.planar import wrap
from sara_lab.studies.carrying import GYRO_SCALE, WALKS, Carrier, GyroOdometry
from sara_sim.robot.recording import recorded
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.script import Along, Script
from sara_sim.world.world import World, WorldError

START = (2.0, 2.0, 0.3)
WAY = np.array(((2.0, 2.0), (5.0, 2.0), (5.0, 4.0)))  # 5 m


def robot():
    occupied = np.zeros((80, 120), bool)
    occupied[:2] = occupied[-2:] = occupied[:, :2] = occupied[:, -2:] = True
    return SimulatedRobot(World(occupied, 0.1, (0.0, 0.0)), seed=3, start=START)


def carried(turn, seconds=20.0):
    """The moments of a carry, and its carrier."""
    lifted = robot()
    carrier, moments = Carrier(lifted, WAY, turn), []
    for moment in recorded(lifted, carrier, seconds):
        moments.append(moment)
        if carrier.done:
            break
    return moments, carrier


@pytest.mark.parametrize('turn', [0.0, 2.5, -math.pi])
def test_it_is_carried_to_the_end_of_the_way_and_turned(turn):
    moments, carrier = carried(turn)
    x, y, yaw = moments[-1].truth
    assert carrier.done and (x, y) == pytest.approx(WAY[-1]) and abs(wrap(yaw - START[2] - turn)) < 1e-9
    assert moments[-1].t == pytest.approx(5.0 / WALKS, abs=0.06)
    steps = [math.dist(a.truth[:2], b.truth[:2]) for a, b in zip(moments, moments[1:])]
    assert max(steps) < 1.01 * WALKS * 0.05


def test_wheels_alone_know_nothing_of_it_and_a_gyro_knows_the_turn():
    moments, _ = carried(2.5)
    gyro = GyroOdometry(START, np.random.default_rng(1))
    poses = [gyro.add(moment) for moment in moments]
    assert {moment.odometry for moment in moments} == {(0.0, 0.0, 0.0)}
    assert poses[-1][:2] == (0.0, 0.0) and poses[-1][2] == pytest.approx(2.5, abs=2.5 * GYRO_SCALE + 0.01)


def test_driven_it_goes_where_the_robot_goes():
    driven = robot()
    gyro = GyroOdometry(START, np.random.default_rng(2))
    for moment in recorded(driven, Script([Along(((5.0, 2.0), (5.0, 5.0)))]), 12.0):
        x, y, yaw = gyro.add(moment)
    c, s = math.cos(START[2]), math.sin(START[2])
    assert math.dist((START[0] + c * x - s * y, START[1] + s * x + c * y), moment.truth[:2]) < 0.15
    assert abs(wrap(START[2] + yaw - moment.truth[2])) < 0.03


def test_whoever_carries_it_waits_while_somebody_is_in_the_way(monkeypatch):
    lifted = robot()
    carrier, place, tried = Carrier(lifted, WAY, 1.0), lifted.place, []

    def blocked(*pose):
        tried.append(pose)
        if len(tried) <= 100:
            raise WorldError('somebody stands there')
        place(*pose)

    monkeypatch.setattr(lifted, 'place', blocked)
    for moment in recorded(lifted, carrier, 10.0):
        if carrier.done:
            break
        if moment.t < 0.95:
            assert moment.truth == START
    assert moment.t == pytest.approx(1.0 + 5.0 / WALKS, abs=0.06)
