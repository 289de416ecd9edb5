"""gps/heading: the robot's yaw in its world frame by a receiver's velocity."""

import math

import numpy as np
import pytest
from gps_robot import TRUE, GpsRobot

from sara_common.config import ConfigError
from sara_localization.geometry.rigid import yaw_from_quaternion
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.velocity_heading import VelocityData, VelocityHeading
from sara_localization.inputs.measurement import measures

SIGMA = 0.05


class Driver:
    """A robot whose world frame is laid, and its heading. yaw: from the grid's x."""

    def __init__(self, arm=(0.0, 0.0, 0.0), world=(0.0, 0.0, 0.0), yaw=0.0, **options):
        self.robot = GpsRobot(arm, world, velocity_sigma=SIGMA, **TRUE, **options).laid()
        self.robot.yaw = yaw
        self.heading = VelocityHeading(self.robot.node, self.robot.buffer, self.robot.said.append)

    def drive(self, linear, turn=0.0, off=(0.0, 0.0), **changes):
        """The heading while the robot moves so (m/s, rad/s); off: the velocity's error east, north, m/s."""
        robot = self.robot
        robot.now += 0.1
        robot.node.on_odometry(robot.odometry(linear=(*linear, 0.0), turn=turn))
        x, y, _ = robot.arm
        yaw = robot.yaw - robot.convergence
        v = np.array((linear[0] - turn * y, linear[1] + turn * x))
        east, north = np.array(((math.cos(yaw), -math.sin(yaw)), (math.sin(yaw), math.cos(yaw)))) @ v + off
        return self.heading.on_velocity(VelocityData(robot.now, '/gps', east, north)._replace(**changes))

    def off(self, heading):
        """rad by which it is not the robot's yaw in the world."""
        return math.remainder(
            yaw_from_quaternion(heading.orientation) - yaw_from_quaternion(self.robot.pose.rotation), 2 * math.pi
        )


@pytest.mark.parametrize('world', [(0.0, 0.0, 0.0), (3.0, -2.0, 2.5)])
@pytest.mark.parametrize('yaw', [0.0, 3.0, -1.5])
@pytest.mark.parametrize(
    ('linear', 'turn'), [((0.8, 0.0), 0.0), ((-0.8, 0.0), 0.0), ((0.8, 0.0), 0.6), ((0.3, -0.4), 0.0)]
)
def test_it_is_the_robot_s_yaw_forwards_backwards_sideways_and_in_curves(world, yaw, linear, turn):
    driver = Driver((-0.45, 0.20, 0.9), world, yaw)
    heading = driver.drive(linear, turn)
    assert driver.off(heading) == pytest.approx(0.0, abs=1e-4)  # a receiver's north is not the grid's
    assert heading.frame_id == 'base_link' and heading.stamp == driver.robot.now
    assert not measures(heading.angular_velocity_covariance) and not measures(heading.linear_acceleration_covariance)


def test_its_variance_is_that_of_a_velocity_across_the_way():
    rng, driver = np.random.default_rng(0), Driver()
    headings = [driver.drive((0.8, 0.0), off=rng.normal(0.0, SIGMA, 2)) for _ in range(2000)]
    used = [heading for heading in headings if heading is not None]
    variance = used[0].orientation_covariance[2, 2]
    assert variance == pytest.approx((SIGMA / 0.8) ** 2)
    assert np.mean([driver.off(heading) ** 2 for heading in used]) == pytest.approx(variance, rel=0.1)
    assert np.diag(used[0].orientation_covariance)[:2].min() >= 1e6
    assert len(used) >= 1995


def test_a_curve_makes_it_less_sure_for_receivers_smooth():
    driver = Driver()
    straight, curve = (driver.drive((0.8, 0.0), turn).orientation_covariance[2, 2] for turn in (0.0, 0.6))
    assert math.sqrt(curve - straight) == pytest.approx(0.12)


@pytest.mark.parametrize('speed', [0.0, 0.19, -0.19])
def test_a_slow_robot_has_no_course(speed):
    driver = Driver()
    assert driver.drive((speed, 0.0)) is None and driver.robot.said == []
    assert driver.drive((math.copysign(0.21, speed), 0.0)) is not None


def test_a_speed_that_is_not_the_odometry_s_is_left_out_and_said_once():
    driver = Driver()
    for _ in range(3):
        assert driver.drive((0.8, 0.0), off=(0.25, 0.0)) is None
    assert len(driver.robot.said) == 1 and 'multipath' in driver.robot.said[0].lower()
    assert driver.robot.node.accounts['velocity'].problems['other_speed'] == 3


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'stamp': 0.0}, 'no time stamp'),
        ({'stamp': math.nan}, 'no time stamp'),
        ({'stamp': 5.0}, 'clocks'),
        ({'frame_id': 'mast'}, 'no transform base_link -> mast'),
        ({'east': math.nan}, 'left out'),
        ({'north': math.inf}, 'left out'),
    ],
)
def test_what_is_faulty_is_dropped_and_said(changes, words):
    driver = Driver()
    assert driver.drive((0.8, 0.0), **changes) is None
    assert len(driver.robot.said) == 1 and words in driver.robot.said[0]
    assert driver.drive((0.8, 0.0)) is not None


def test_odometry_that_is_no_number_or_turns_too_fast_tells_nothing():
    driver = Driver()
    assert driver.drive((0.8, 0.0), turn=1e300) is None
    assert driver.drive((math.nan, 0.0), east=0.8, north=0.0) is None


def test_before_the_world_frame_is_known_there_is_none():
    robot = GpsRobot(**TRUE)
    heading = VelocityHeading(robot.node, robot.buffer)
    assert heading.on_velocity(VelocityData(robot.now, 'gps', 0.8, 0.0)) is None
    assert robot.node.accounts['velocity'].received == 1


def test_the_parameters_are_checked():
    assert not NavSatConfig().velocity_heading
    with pytest.raises(ConfigError, match='velocity_sigma'):
        NavSatConfig.from_params({'velocity_sigma': 0.0})
