"""A differential robot on a map: closed forms of its motion, what stops it, and that nothing but a command moves it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import STEP_S, RobotConfig, ScannerConfig
from sara_sim.robot.wheel_odometry import WheelOdometry
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import World, WorldError

EXACT = {'odom_error': (0.0, 0.0), 'odom_noise': (0.0, 0.0, 0.0, 0.0)}
BLIND = {'scanners': ()}
LIVELY = {'acc_lim_x': 1000.0, 'acc_lim_theta': 1000.0}  # at once at any speed


def room():
    """6 m x 6 m within walls of one cell."""
    occupied = np.zeros((122, 122), bool)
    occupied[[0, -1], :] = occupied[:, [0, -1]] = True
    return World(occupied, origin=(-0.05, -0.05))


def robot_of(world=None, start=(3.0, 3.0, 0.0), seed=0, **config):
    return SimulatedRobot(world or World.empty(), RobotConfig(**{**BLIND, **config}), seed, start)


def drive(robot, v, w, seconds):
    """Command at 100 Hz; the poses."""
    poses = []
    for _ in range(round(seconds / STEP_S)):
        robot.command(v, w)
        robot.step()
        poses.append(robot.pose)
    return poses


@settings(max_examples=30)
@given(st.floats(-0.5, 1.0), st.floats(-1.5, 1.5))
def test_a_steady_command_drives_the_arc_of_its_velocities(v, w):
    robot = robot_of(start=(0.0, 0.0, 0.0), **LIVELY)
    drive(robot, v, w, 2.0)
    angle = 2.0 * w
    if abs(angle) > 1e-6:
        x, y = v / w * math.sin(angle), v / w * (1.0 - math.cos(angle))
    else:
        x, y = 2.0 * v, v * angle
    assert robot.pose[:2] == pytest.approx((x, y), abs=1e-6)
    assert math.remainder(robot.pose[2] - angle, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_speed_goes_up_and_down_within_its_limits():
    robot = robot_of(acc_lim_x=0.5, acc_lim_theta=2.0)
    speeds = []
    for _ in range(300):
        robot.command(5.0, 9.0)
        robot.step()
        speeds.append(robot.velocity)
    v, w = np.array(speeds).T
    time = STEP_S * np.arange(1, 301)
    assert v == pytest.approx(np.minimum(0.5 * time, 1.0))
    assert w == pytest.approx(np.minimum(2.0 * time, 1.5))
    drive(robot, -5.0, 0.0, 10.0)
    assert robot.velocity == (-0.5, 0.0)


def test_a_command_is_obeyed_until_the_watchdog_s_time():
    robot = robot_of(start=(0.0, 0.0, 0.0), **LIVELY)
    robot.command(1.0, 0.0)
    for _ in range(100):
        robot.step()
    assert robot.velocity == (0.0, 0.0)
    assert 0.18 < robot.pose[0] < 0.2 + 1e-9


def test_without_a_watchdog_it_drives_on():
    robot = robot_of(start=(0.0, 0.0, 0.0), base_watchdog_timeout=0.0, **LIVELY)
    robot.command(1.0, 0.0)
    for _ in range(1000):
        robot.step()
    assert robot.pose[0] == pytest.approx(10.0)


@settings(max_examples=30)
@given(st.sampled_from([math.nan, math.inf, -math.inf]), st.floats(-2.0, 2.0), st.booleans(), st.booleans())
def test_a_command_that_is_no_number_never_moves_it(bad, good, swapped, moving):
    robot = robot_of()
    if moving:
        drive(robot, 1.0, 0.5, 2.0)
    for _ in range(200):
        assert not robot.command(*((good, bad) if swapped else (bad, good)))
        robot.step()
    assert robot.bad_commands == 200
    assert robot.velocity == (0.0, 0.0)
    before = robot.pose, robot.odometry.pose
    for _ in range(50):
        robot.command(bad, bad)
        robot.step()
    assert (robot.pose, robot.odometry.pose) == before
    assert all(map(math.isfinite, robot.pose))


def test_a_huge_command_is_cut_to_the_limits():
    robot = robot_of(**LIVELY)
    drive(robot, 1e308, -1e308, 0.1)
    assert robot.velocity == (1.0, -1.5)


def test_nothing_moves_a_robot_that_is_not_commanded():
    robot = robot_of(room())
    for _ in range(500):
        robot.step()
    assert robot.pose == (3.0, 3.0, 0.0) and robot.odometry.pose == (0.0, 0.0, 0.0) and robot.stalls == 0


def test_a_wall_stalls_it_and_its_wheels():
    robot = robot_of(room(), size=(0.5, 0.4), **EXACT)
    drive(robot, 1.0, 0.0, 8.0)
    assert robot.stalled and robot.stalls == 1 and robot.velocity == (0.0, 0.0)
    assert 5.73 < robot.pose[0] <= 5.75 + 1e-9  # its front at the wall
    assert robot.odometry.pose[0] == pytest.approx(robot.pose[0] - 3.0)
    drive(robot, -0.5, 0.0, 4.0)
    assert not robot.stalled and robot.pose[0] < 4.5


def test_the_footprint_sits_where_its_centre_is():
    robot = robot_of(room(), size=(0.5, 0.4), centre=(-0.15, 0.0))
    drive(robot, 1.0, 0.0, 8.0)
    assert 5.88 < robot.pose[0] <= 5.90 + 1e-9


def test_an_obstacle_stops_it_and_lets_it_go():
    world = World.empty()
    world.obstacles.add(Obstacle('box', radius=0.5, at=(5.0, 3.0)))
    robot = robot_of(world, size=(0.5, 0.4))
    drive(robot, 1.0, 0.0, 4.0)
    assert robot.stalled and 4.2 < robot.pose[0] < 4.25
    drive(robot, -0.5, 0.0, 1.0)
    assert robot.pose[0] < 4.0


def test_who_walks_into_it_does_not_hold_it():
    world = World.empty()
    world.obstacles.add(Obstacle('ann', radius=0.25, path=((5.0, 3.0), (3.4, 3.0)), speed=1.0))
    robot = robot_of(world, size=(0.5, 0.4))
    for _ in range(300):
        robot.step()
    drive(robot, 0.5, 0.0, 1.0)
    assert robot.stalled
    drive(robot, -0.5, 0.0, 1.0)
    assert not robot.stalled and robot.pose[0] < 2.8


@pytest.mark.parametrize('start', [(0.1, 3.0, 0.0), (0.0, 0.0, 0.3), (math.nan, 1.0, 0.0), (1.0, math.inf, 0.0)])
def test_it_cannot_start_in_a_wall_or_nowhere(start):
    with pytest.raises(WorldError, match='the pose is'):
        robot_of(room(), start)


def test_it_cannot_start_on_an_obstacle():
    world = World.empty()
    world.obstacles.add(Obstacle('box', size=(1.0, 1.0), at=(3.0, 3.0)))
    with pytest.raises(WorldError, match='obstacle'):
        robot_of(world)


def test_lifted_elsewhere_it_stands_there_and_its_odometry_knows_nothing_of_it():
    robot = robot_of(room(), **EXACT)
    drive(robot, 0.5, 0.0, 2.0)
    before = robot.odometry.pose
    robot.place(1.0, 1.0, 2.0)
    for _ in range(30):
        robot.step()
    assert robot.pose == (1.0, 1.0, 2.0) and robot.velocity == (0.0, 0.0) and robot.odometry.pose == before
    with pytest.raises(WorldError):
        robot.place(0.1, 1.0, 2.0)
    assert robot.pose == (1.0, 1.0, 2.0)
    robot.reset()
    assert robot.pose == (3.0, 3.0, 0.0)


def test_odometry_without_error_is_the_truth():
    robot = robot_of(start=(0.0, 0.0, 0.0), **EXACT)
    drive(robot, 0.8, 0.7, 5.0)
    assert robot.odometry.pose == pytest.approx(robot.pose, abs=1e-9)


def test_the_error_of_odometry_is_a_share_of_the_way_and_of_the_turn():
    config = {'odom_error': (0.1, 0.2), 'odom_noise': (0.0, 0.0, 0.0, 0.0), **LIVELY}
    shares = []
    for seed in range(300):
        robot = robot_of(start=(0.0, 0.0, 0.0), seed=seed, **config)
        robot.odometry.move(10.0, 0.0)
        forward = robot.odometry.pose[0]
        robot.odometry.move(0.0, 1.0)
        shares.append((forward / 10.0, robot.odometry.pose[2]))
        assert robot.odometry.share == pytest.approx(shares[-1])
        robot.velocity = (0.5, 1.0)
        assert robot.measured == pytest.approx((0.5 * shares[-1][0], shares[-1][1]))
    lowest, highest = np.min(shares, axis=0), np.max(shares, axis=0)
    assert lowest == pytest.approx((0.95, 0.90), abs=0.003) and np.all(lowest >= (0.95, 0.90))
    assert highest == pytest.approx((1.05, 1.10), abs=0.003) and np.all(highest <= (1.05, 1.10))


@pytest.mark.parametrize('steps', [10, 1000])
def test_the_noise_of_odometry_grows_with_the_root_of_the_way_however_it_is_cut(steps):
    config = RobotConfig(odom_error=(0.0, 0.0), odom_noise=(0.02, 0.0, 0.0, 0.03))
    random = np.random.default_rng(5)
    straight, turned = [], []
    for _ in range(400):
        odometry = WheelOdometry(config, random)
        for _ in range(steps):
            odometry.move(4.0 / steps, 0.0)
        straight.append(odometry.pose[0])
        for _ in range(steps):
            odometry.move(0.0, 2.25 / steps)
        turned.append(odometry.pose[2])
    assert np.std(straight) == pytest.approx(0.04, rel=0.12) and np.mean(straight) == pytest.approx(4.0, abs=0.008)
    assert np.std(turned) == pytest.approx(0.045, rel=0.12)


def test_the_same_seed_and_commands_give_the_same_robot():
    def found(seed):
        robot = robot_of(room(), seed=seed, scanners=(ScannerConfig(), ScannerConfig(x=-0.1, yaw=math.pi)))
        scans = []
        for _ in range(50):
            robot.command(0.5, 0.3)
            robot.step()
            scans += [scan.ranges for _, scan in robot.scans]
        return robot.odometry.pose, np.concatenate(scans)

    (one, first), (two, second), (other, third) = found(1), found(1), found(2)
    assert one == two and np.array_equal(first, second)
    assert one != other and not np.array_equal(first, third)


def test_another_scanner_leaves_odometry_and_the_first_scanner_s_luck_alone():
    def found(count):
        robot = robot_of(room(), seed=4, scanners=(ScannerConfig(),) * count)
        scans = []
        for _ in range(40):
            robot.command(0.5, 0.3)
            robot.step()
            scans += [scan.ranges for number, scan in robot.scans if number == 0]
        return robot.odometry.pose, np.concatenate(scans)

    (one, first), (two, second) = found(1), found(2)
    assert one == two and np.array_equal(first, second)


@settings(max_examples=20)
@given(
    st.floats(0.5, 5.5), st.floats(0.5, 5.5), st.floats(-3.0, 3.0), st.floats(-0.2, 0.2), st.floats(-math.pi, math.pi)
)
def test_a_scanner_measures_the_walls_from_where_it_is_mounted(x, y, yaw, offset, turned):
    mounted = ScannerConfig(x=offset, y=0.1, yaw=turned, samples=91, sigma=0.0, range_min=0.0)
    robot = robot_of(room(), (x, y, yaw), scanners=(mounted,), size=(0.1, 0.1))
    robot.step()
    ((_, scan),) = robot.scans
    c, s = math.cos(yaw), math.sin(yaw)
    at = x + c * offset - s * 0.1, y + s * offset + c * 0.1
    angles = yaw + turned + np.linspace(-0.75 * math.pi, 0.75 * math.pi, 91)
    with np.errstate(divide='ignore', over='ignore'):
        ways = [
            np.where(d == 0.0, math.inf, (np.where(d > 0, 6.0, 0.0) - p) / d)
            for p, d in zip(at, (np.cos(angles), np.sin(angles)))
        ]
    assert scan.ranges == pytest.approx(np.minimum(*ways), abs=1e-6)


def test_scans_come_at_each_scanner_s_own_rate():
    robot = robot_of(room(), scanners=(ScannerConfig(rate=10), ScannerConfig(rate=25, sweep=0.02)))
    stamps = {0: [], 1: []}
    for _ in range(101):
        robot.step()
        for number, scan in robot.scans:
            stamps[number].append(scan.stamp)
    assert np.diff(stamps[0]) == pytest.approx(0.1) and len(stamps[0]) == 11
    assert np.diff(stamps[1]) == pytest.approx(0.04) and len(stamps[1]) == 25


def test_on_an_empty_map_a_scan_reads_infinity():
    robot = robot_of(World.empty(), scanners=(ScannerConfig(),))
    robot.step()
    assert np.all(robot.scans[0][1].ranges == math.inf)


@pytest.mark.parametrize(
    ('made', 'name'),
    [
        (lambda: RobotConfig(size=(0.4, 0.0)), 'size'),
        (lambda: RobotConfig(size=0.4), 'size'),
        (lambda: RobotConfig(centre=(math.nan, 0.0)), 'centre'),
        (lambda: RobotConfig(max_vel_x=0.0), 'max_vel_x'),
        (lambda: RobotConfig(min_vel_x=0.1), 'min_vel_x'),
        (lambda: RobotConfig(max_vel_theta=math.inf), 'max_vel_theta'),
        (lambda: RobotConfig(acc_lim_x=-1.0), 'acc_lim_x'),
        (lambda: RobotConfig(acc_lim_theta='fast'), 'acc_lim_theta'),
        (lambda: RobotConfig(base_watchdog_timeout=-0.1), 'base_watchdog_timeout'),
        (lambda: RobotConfig(odom_error=(0.1,)), 'odom_error'),
        (lambda: RobotConfig(odom_noise=(0.1, 0.1, -0.1, 0.1)), 'odom_noise'),
        (lambda: RobotConfig(scanners=({'x': 1},)), 'scanners'),
        (lambda: ScannerConfig(x=math.nan), 'x'),
        (lambda: ScannerConfig(fov=7.0), 'fov'),
        (lambda: ScannerConfig(fov=0.0), 'fov'),
        (lambda: ScannerConfig(samples=1), 'samples'),
        (lambda: ScannerConfig(samples=90.0), 'samples'),
        (lambda: ScannerConfig(rate=30), 'rate'),
        (lambda: ScannerConfig(rate=0), 'rate'),
        (lambda: ScannerConfig(sweep=0.2), 'sweep'),
        (lambda: ScannerConfig(range_min=30.0), 'range_min'),
        (lambda: ScannerConfig(range_max=0.0), 'range_max'),
        (lambda: ScannerConfig(sigma=-0.01), 'sigma'),
    ],
)
def test_a_setting_that_makes_no_sense_is_refused_by_name(made, name):
    with pytest.raises(ConfigError, match=f'^{name} is .*, allowed'):
        made()
