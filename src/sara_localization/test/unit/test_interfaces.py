"""What robot_localization's own interface tests ask of each kind of input, of both filters, one test per behaviour.

One filter with every kind of input (three odometries, two poses, a twist, four IMUs), as there; messages come at 30 or
50 Hz on a clock of the test's own.
"""

import math

import numpy as np
import pytest

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.geometry.rigid import quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import ImuData, OdometryData, PoseData, TwistData

RATE = 30.0
FILTERS = ('ekf', 'ukf')


def mask(*variables):
    return [k in variables for k in range(15)]


def parameters():
    # Angles that wander little: of a heading that is not known the UKF rightly expects less way ahead (E cos < 1).
    noise = [0.03] * 3 + [1e-4] * 3 + [0.03] * 6 + [0.01] * 3
    params = dict(frequency=RATE, world_frame='odom', publish_tf=False, process_noise_covariance=noise)
    inputs = {
        'odom0': mask(0, 2),
        'odom1': mask(6, 7, 8, 9, 10, 11),
        'odom2': mask(0, 1, 2, 3, 4, 5),
        'pose0': mask(0, 2),
        'pose1': mask(0, 1, 2, 3, 4, 5),
        'twist0': mask(6, 7, 8, 9, 10, 11),
        'imu0': mask(3, 4, 5),
        'imu1': mask(9, 10, 11),
        'imu2': mask(12, 13, 14),
        'imu3': mask(3, 4, 5),
    }
    for name, used in inputs.items():
        params[name], params[name + '_config'] = name, used
    for name in ('odom2', 'pose1', 'imu3'):
        params[name + '_differential'] = True
    params['imu2_remove_gravitational_acceleration'] = True
    return params


class Robot:
    """A filter, and a clock on which messages are given to it."""

    def __init__(self, kind):
        self.engine = FilterEngine(FilterConfig.from_params(parameters(), kind), TransformBuffer())
        self.now = 100.0
        self.output = None

    def run(self, seconds, give, rate=RATE):
        """give(stamp) at `rate` Hz, and the filter's cycles in between."""
        for _ in range(round(seconds * rate)):
            self.now += 1.0 / rate
            give(self.now)
            output = self.engine.tick(self.now + 1e-4)
            self.output = output or self.output
        return self.output

    def odometry(self, name, **values):
        return lambda stamp: self.engine.add_odometry(name, OdometryData(stamp, 'odom', 'base_link', **values))

    def pose(self, name, **values):
        return lambda stamp: self.engine.add_pose(name, PoseData(stamp, 'odom', **values))

    def twist(self, **values):
        return lambda stamp: self.engine.add_twist('twist0', TwistData(stamp, 'base_link', **values))

    def imu(self, name, **values):
        return lambda stamp: self.engine.add_imu(name, ImuData(stamp, 'base_link', **values))

    @property
    def state(self):
        return self.output.state

    def variance(self, k):
        return self.output.covariance[k, k]


@pytest.fixture(params=FILTERS)
def robot(request):
    return Robot(request.param)


def test_odometry_pose_is_taken_where_it_is_configured(robot):
    robot.run(
        5.0,
        robot.odometry('odom0', position=(20.0, 10.0, -40.0), pose_covariance=np.diag([2.0, 2.0, 2.0, 2.0, 2.0, 2.0])),
    )
    assert robot.state[0] == pytest.approx(20.0, abs=0.01) and robot.state[2] == pytest.approx(-40.0, abs=0.01)
    assert robot.state[1] == pytest.approx(0.0, abs=0.01)  # not configured
    assert robot.variance(0) < 0.5 and robot.variance(2) < 0.5


@pytest.mark.parametrize('kind', ['odom', 'twist'])
def test_a_twist_is_integrated_along_each_axis(robot, kind):
    def driven(**values):
        covariance = np.diag([1e-6] * 6)
        if kind == 'odom':
            return robot.odometry('odom1', twist_covariance=covariance, **values)
        return robot.twist(covariance=covariance, **values)

    robot.run(20.0, driven(linear=(5.0, 0.0, 0.0)))
    assert robot.state[0] == pytest.approx(100.0, abs=2.0) and robot.state[6] == pytest.approx(5.0, abs=0.1)
    robot.run(20.0, driven(linear=(0.0, 2.5, 0.0)))
    assert robot.state[1] == pytest.approx(50.0, abs=1.0) and robot.state[0] == pytest.approx(100.0, abs=2.0)
    robot.run(20.0, driven(linear=(0.0, 0.0, 1.25)))
    assert robot.state[2] == pytest.approx(25.0, abs=1.0)
    before = robot.state.copy()
    robot.run(20.0, driven(linear=(1.0, 0.0, 0.0), angular=(0.0, 0.0, math.pi / 10.0)))  # a full circle
    assert abs(robot.state[0] - before[0]) < 0.5 and abs(robot.state[1] - before[1]) < 0.5
    robot.run(5.0, driven(angular=(0.0, 0.0, math.pi / 10.0)))  # a quarter turn: forward is +y now
    before = robot.state.copy()
    robot.run(10.0, driven(linear=(1.0, 0.0, 0.0)))
    assert robot.state[1] - before[1] == pytest.approx(10.0, abs=1.0) and robot.state[0] - before[0] == pytest.approx(
        0.0, abs=1.0
    )


def test_a_pose_is_taken_where_it_is_configured(robot):
    robot.run(5.0, robot.pose('pose0', position=(20.0, 10.0, -40.0), covariance=np.diag([2.0] * 6)))
    assert robot.state[0] == pytest.approx(20.0, abs=0.01) and robot.state[2] == pytest.approx(-40.0, abs=0.01)
    assert robot.state[1] == pytest.approx(0.0, abs=0.01)
    assert robot.variance(0) < 0.5 and robot.variance(2) < 0.5


@pytest.mark.parametrize('axis', range(3))
def test_an_imus_orientation_is_taken(robot, axis):
    angles = [0.0, 0.0, 0.0]
    angles[axis] = math.pi / 4
    robot.run(
        5.0, robot.imu('imu0', orientation=quaternion_from_rpy(*angles), orientation_covariance=np.diag([1e-2] * 3))
    )
    assert robot.state[3:6] == pytest.approx(angles, abs=0.1)


@pytest.mark.parametrize('axis', range(3))
def test_an_imus_rate_turns_the_robot(robot, axis):
    rates = [0.0, 0.0, 0.0]
    rates[axis] = math.pi / 10
    robot.run(
        5.0,
        robot.imu('imu1', angular_velocity=tuple(rates), angular_velocity_covariance=np.diag([1e-6] * 3)),
        rate=50.0,
    )
    assert robot.state[3 + axis] == pytest.approx(math.pi / 2, abs=0.7)
    assert robot.variance(9 + axis) < 1e-3
    others = [k for k in range(3) if k != axis]
    assert robot.state[3:6][others] == pytest.approx([0.0, 0.0], abs=0.1)


@pytest.mark.parametrize('axis', range(3))
def test_an_imus_acceleration_moves_the_robot(robot, axis):
    def accelerated(a):
        force = [0.0, 0.0, 9.80665]
        force[axis] += a
        return robot.imu(
            'imu2',
            linear_acceleration=tuple(force),
            linear_acceleration_covariance=np.diag([1e-6] * 3),
            orientation_covariance=np.eye(3),
        )

    robot.run(1.0, accelerated(1.0), rate=50.0)
    robot.run(0.7, accelerated(0.0), rate=50.0)
    assert robot.state[6 + axis] == pytest.approx(1.0, abs=0.4)
    assert robot.state[axis] == pytest.approx(1.2, abs=0.4)


@pytest.mark.parametrize('kind', ['odom2', 'pose1'])
def test_a_differential_pose_counts_only_its_changes(robot, kind):
    def at(share):
        position = (20.0 + share, 10.0 + 2.0 * share, -40.0 - 3.0 * share)
        if kind == 'odom2':
            return robot.odometry(kind, position=position, pose_covariance=np.diag([1e-3] * 6))
        return robot.pose(kind, position=position, covariance=np.diag([1e-3] * 6))

    robot.run(1.0, at(0.0))
    assert robot.state[:6] == pytest.approx([0.0] * 6, abs=0.01)
    for k in range(60):
        robot.run(1.0 / RATE, at((k + 1) / 60.0))
    robot.run(1.0, at(1.0))
    assert abs(robot.state[0] - 1.0) < 0.2 and abs(robot.state[1] - 2.0) < 0.4 and abs(robot.state[2] + 3.0) < 0.6


def test_a_differential_orientation_counts_only_its_changes(robot):
    def at(yaw):
        return robot.imu(
            'imu3', orientation=quaternion_from_rpy(0.0, 0.0, yaw), orientation_covariance=np.diag([1e-3] * 3)
        )

    robot.run(1.0, at(1.0))
    assert robot.state[3:6] == pytest.approx([0.0] * 3, abs=0.01)
    for k in range(60):
        robot.run(1.0 / RATE, at(1.0 + (k + 1) / 60.0))
    robot.run(1.0, at(2.0))
    assert robot.state[5] == pytest.approx(1.0, abs=0.1)
