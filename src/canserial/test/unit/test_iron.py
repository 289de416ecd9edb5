"""The compass's calibration: ellipses, turns on the spot, and turns that give none."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canserial.calibration.iron import Iron, IronError, fitted_ellipse
from canserial.calibration.turns import FACING_SIGMA, MOUNTING_SIGMA, Turns

HORIZONTAL, DOWN, NORTH = 25.7, 37.1, 1.6
NOISE = 0.25


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-200.0, 200.0),
    st.floats(-200.0, 200.0),
    st.floats(5.0, 60.0),
    st.floats(1.0, 2.0),
    st.floats(0.0, math.pi),
)
def test_an_ellipse_without_noise_is_found_exactly(x, y, radius, ratio, turned):
    angles = np.linspace(0.0, math.tau, 50)
    axes = np.column_stack((radius * np.cos(angles), radius / ratio * np.sin(angles)))
    c, s = math.cos(turned), math.sin(turned)
    points = axes @ np.array(((c, s), (-s, c))) + (x, y)
    found = fitted_ellipse(points)
    assert found.centre == pytest.approx((x, y), abs=1e-4)
    assert found.ratio == pytest.approx(ratio, rel=1e-5)
    assert np.linalg.norm((points - found.centre) @ found.matrix.T, axis=1) == pytest.approx(1.0, abs=1e-6)
    assert found.matrix == pytest.approx(found.matrix.T)


@pytest.mark.parametrize(
    'points',
    [
        np.ones((30, 2)),
        np.column_stack((np.arange(30.0), 2.0 * np.arange(30.0))),
        np.full((30, 2), np.nan),
        np.zeros((3, 2)),
    ],
)
def test_what_is_no_ellipse_is_told(points):
    with pytest.raises(IronError):
        fitted_ellipse(points)


class Robot:
    """A magnetometer on a robot that turns; the robot's iron and what its motors add at full effort."""

    offset, iron = np.array((40.0, -25.0, 30.0)), np.array(((1.05, 0.04, 0.02), (-0.03, 0.94, 0.01), (0.05, 0.02, 1.0)))
    motors = np.array((0.6, -1.1, 0.4))

    def __init__(self, seed=0, iron=None):
        self.random, self.yaw = np.random.default_rng(seed), 0.7
        self.iron = self.iron if iron is None else iron

    def measured(self, effort=0.0, noise=NOISE):
        angle = NORTH - self.yaw
        body = HORIZONTAL * np.array((math.cos(angle), math.sin(angle), 0.0)) - (0.0, 0.0, DOWN)
        return tuple(self.iron @ (body + effort * self.motors) + self.offset + self.random.normal(0.0, noise, 3))

    def turn(self, turns, sides=(1, -1), whole=1.02, gyro=1.0, lean=0.0):
        angle = 0.0
        turns.add(self.measured(), 0.0, (0.0, 0.0, 0.0), (0.0, 0.0))
        for side in sides:
            for _ in range(round(whole * 200)):
                step = side * math.tau / 200
                self.yaw += step
                angle += gyro * step
                turns.add(self.measured(0.5 * side), angle, (lean * side, 0.0, 0.5 * side), (0.5 * side, -0.5 * side))
        return turns


def worst_heading(robot, iron):
    """Constant and varying error of the heading all round, rad."""
    errors = []
    for robot.yaw in np.linspace(0.0, math.tau, 40):
        x, y, _ = iron.corrected(robot.measured(noise=0.0))
        errors.append(math.remainder(NORTH - math.atan2(y, x) - robot.yaw, math.tau))
    return float(np.mean(errors)), float(np.abs(errors - np.mean(errors)).max())


@pytest.mark.parametrize('seed', range(5))
def test_two_turns_give_a_heading_within_a_degree(seed):
    robot = Robot(seed)
    found = robot.turn(Turns(), gyro=0.98, lean=0.01).result(HORIZONTAL, DOWN, 1.08, 0.7, NORTH)
    constant, varying = worst_heading(robot, found.iron)
    assert abs(constant) < math.radians(0.5) and varying < math.radians(0.5)
    assert found.iron.gain == pytest.approx(1.08 / 0.98, rel=2e-3)
    assert found.iron.lean == pytest.approx((0.02, 0.0), abs=1e-9)
    assert found.residual == pytest.approx(NOISE, rel=0.3) and found.iron.yaw_sigma < FACING_SIGMA + 0.3
    assert iron_motors(robot, found.iron) == pytest.approx(found.iron.motors, abs=0.15)
    robot.yaw = 2.0
    assert found.iron.corrected(robot.measured(noise=0.0))[2] == pytest.approx(-DOWN, abs=0.1)


def iron_motors(robot, iron):
    """uT that the motors add to corrected fields at full effort, forward and left."""
    robot.yaw = 0.0
    with_motors, without = (np.array(iron.corrected(robot.measured(effort, noise=0.0))) for effort in (1.0, 0.0))
    return tuple((with_motors - without)[:2])


def test_without_a_known_heading_the_constant_error_stays_and_is_owned():
    robot = Robot()
    found = robot.turn(Turns()).result(HORIZONTAL, DOWN, 1.0, None, NORTH)
    assert found.iron.yaw_sigma == MOUNTING_SIGMA and worst_heading(robot, found.iron)[1] < math.radians(0.5)


def test_what_is_missing_is_counted_down():
    turns = Turns()
    assert turns.missing == (math.tau, math.tau)
    Robot().turn(turns, sides=(1,), whole=0.5)
    left, right = turns.missing
    assert left == pytest.approx(math.pi, abs=0.6) and right == math.tau
    turns.add((math.nan, 0.0, 0.0), 0.0, (0.0, 0.0, 0.5), (0.0, 0.0))
    assert turns.missing == (left, right)


@pytest.mark.parametrize(
    'change, sentence',
    [
        ({'sides': (1,)}, 'of the turn to the right are missing'),
        ({'sides': (-1,)}, 'of the turn to the left are missing'),
        ({'whole': 0.6}, 'are missing'),
        ({'gyro': -1.0}, 'do not turn alike'),
        ({'gyro': 0.5, 'whole': 2.1}, 'do not turn alike'),
    ],
)
def test_turns_that_give_no_calibration_are_told(change, sentence):
    with pytest.raises(IronError, match=sentence):
        Robot().turn(Turns(), **change).result(HORIZONTAL, DOWN, 1.0, None, NORTH)


@pytest.mark.parametrize(
    'iron, horizontal, sentence',
    [
        (np.diag((2.5, 1.0, 1.0)), HORIZONTAL, 'times as strong to one side'),
        (np.eye(3), 9.0, 'the place is wrong'),
        (np.zeros((3, 3)), HORIZONTAL, '.'),
    ],
)
def test_a_field_that_is_not_the_earth_s_gives_none(iron, horizontal, sentence):
    with pytest.raises(IronError, match=sentence):
        Robot(iron=iron).turn(Turns()).result(horizontal, DOWN, 1.0, None, NORTH)


def test_a_field_that_changes_meanwhile_gives_none():
    robot = Robot()
    turns = robot.turn(Turns(), sides=(1,))
    robot.offset = robot.offset + (0.0, 9.0, 0.0)
    with pytest.raises(IronError, match='away from cars and steel|do not turn alike'):
        robot.turn(robot.turn(turns, sides=(1,)), sides=(-1,)).result(HORIZONTAL, DOWN, 1.0, None, NORTH)


def test_a_calibration_that_cannot_be_is_named():
    iron = Iron((1.0, math.nan, 0.0), (1.0,) * 8, 500.0, 37.0, lean=(0.5, 0.0), yaw_sigma=-1.0)
    text = '; '.join(iron.faults())
    assert all(name in text for name in ('offset', 'matrix', 'horizontal', 'lean', 'yaw_sigma'))
    assert Iron((0.0,) * 3, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), 25.0, 37.0).faults() == []
