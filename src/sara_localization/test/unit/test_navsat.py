"""navsat_transform_node without ROS: where fixes come out, antennas off the centre, services, and what is faulty."""

import datetime
import math

import numpy as np
import pytest
from gps_robot import ORIGIN, START, TRUE, GpsRobot

from sara_localization.geometry.rigid import IDENTITY, Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.gps.declination import declination
from sara_localization.gps.fixes import FixData, usable
from sara_localization.gps.grid import NoPlace
from sara_localization.gps.navsat import NavSat
from sara_localization.gps.navsat_config import NavSatConfig

# Where fixes come out


@pytest.mark.parametrize('world', [(0.0, 0.0, 0.0), (3.0, -2.0, 0.0), (-7.0, 1.0, 2.5)])
@pytest.mark.parametrize('arm', [(0.0, 0.0, 0.0), (0.5, 0.3, 1.0)])
def test_a_drive_comes_out_where_the_odometry_has_it(world, arm):
    robot = GpsRobot(arm, world, **TRUE).laid()
    for x, y, yaw in ((10.0, 0.0, 0.5), (10.0, 20.0, -2.0), (-30.0, 5.0, 3.0)):
        robot.x, robot.y, robot.yaw = x, y, yaw
        robot.tell()
        (answer,) = robot.tick()
        assert robot.off(answer) < 1e-5 and answer.position[2] == pytest.approx(0.0, abs=1e-6)
        assert (answer.frame_id, answer.child_frame_id) == ('odom', 'base_link')
    assert robot.said == []


@pytest.mark.parametrize('frequency', [10.0, 1.0])
def test_every_fix_comes_out_however_seldom_the_node_looks(frequency):
    robot = GpsRobot(**TRUE, frequency=frequency).laid()
    answers = []
    for _ in range(40):
        robot.now += 0.05
        robot.x += 0.05
        robot.tell()
        if robot.now % (1.0 / frequency) < 0.05:
            answers += robot.tick(0.0)
    answers += robot.tick()
    assert len(answers) == 40
    assert [answer.stamp for answer in answers] == sorted(answer.stamp for answer in answers)


@pytest.mark.parametrize('late', [0.0, 0.04, 0.3])
@pytest.mark.parametrize('turn', [1.0, -2.5])
def test_an_antenna_half_a_metre_off_does_not_move_a_robot_that_turns_on_the_spot(turn, late):
    """late: s by which odometry comes after fixes of the same time; fixes are between its stamps."""
    robot, worst, answers, waiting = GpsRobot((0.5, 0.0, 0.8), **TRUE), 0.0, 0, []
    for step in range(1200):
        robot.now = START + 0.01 * step
        robot.yaw = 0.3 + turn * 0.01 * step
        if step % 3 == 0:
            waiting.append((robot.now + late, robot.odometry(turn=turn), robot.imu()))
        while waiting and waiting[0][0] <= robot.now:
            _, odometry, imu = waiting.pop(0)
            robot.node.on_odometry(odometry)
            robot.node.on_imu(imu)
        if step % 20 == 7:
            robot.node.on_fix(robot.fix(), robot.now)
        if step % 10 == 0:
            for answer in robot.tick(0.0):
                worst, answers = max(worst, math.hypot(*answer.position[:2])), answers + 1
    assert answers >= 55 and worst <= 0.01


def test_odometry_that_ends_is_bridged_at_its_speed_for_a_second():
    robot = GpsRobot((0.5, 0.0, 0.0), **TRUE).laid()
    robot.node.on_odometry(robot.odometry(robot.now, linear=(0.0, 0.0, 0.0), turn=1.0))
    for seconds in (0.5, 0.9):
        robot.yaw = seconds
        robot.node.on_fix(robot.fix(robot.now + seconds), robot.now)
    assert robot.tick(0.95) == []  # still waited for
    first, second = robot.tick(0.1)
    assert max(math.hypot(*first.position[:2]), math.hypot(*second.position[:2])) < 0.01
    robot.node.on_fix(robot.fix(), robot.now)
    robot.tick(1.1)
    robot.node.on_fix(robot.fix(), robot.now)
    assert robot.tick(1.1) == []
    assert len(robot.said) == 1 and 'newer than all odometry: dropped' in robot.said[0]


def test_a_tilted_antenna_counts():
    robot = GpsRobot((0.0, 0.0, 2.0), **TRUE).laid()
    tilted = quaternion_from_rpy(0.2, 0.0, 0.0)
    robot.node.on_odometry(robot.odometry(orientation=tilted))
    robot.node.on_fix(robot.fix(), robot.now)
    (answer,) = robot.tick()
    assert answer.position[:2] == pytest.approx((0.0, 2.0 * math.sin(0.2)), abs=1e-6)


def test_the_covariance_is_turned_with_the_world():
    robot = GpsRobot(world=(0.0, 0.0, math.pi / 2), **TRUE).laid()
    robot.node.on_odometry(robot.odometry())
    robot.node.on_fix(robot.fix(covariance=np.diag([1.0, 9.0, 16.0])), robot.now)
    (answer,) = robot.tick()
    assert np.diag(answer.pose_covariance)[:3] == pytest.approx([9.0, 1.0, 16.0], rel=2e-2)
    assert np.diag(answer.pose_covariance)[3:].min() >= 1e6  # a fix says nothing of angles


# Headings


def test_the_heading_holds_although_imu_fix_and_odometry_are_of_different_times():
    """While the robot turns and drives: what the C++ node takes is the latest of each."""
    robot = GpsRobot((0.4, 0.0, 0.0), (1.0, 2.0, 0.7), **TRUE)
    for step in range(60):
        robot.now, robot.yaw, robot.x = START + 0.02 * step, 1.5 * 0.02 * step, 0.02 * step
        robot.node.on_odometry(robot.odometry(linear=(0.0, 0.0, 0.0)))
        if step == 3:
            robot.node.on_imu(robot.imu(robot.now))
        if step == 40:
            robot.node.on_fix(robot.fix(), robot.now)
    robot.tick()
    robot.x, robot.y, robot.yaw = 50.0, 50.0, 0.0
    robot.tell()
    (answer,) = robot.tick()
    assert robot.off(answer) < 1e-3


def test_declination_comes_from_the_model_for_place_and_date_and_is_told():
    robot = GpsRobot()
    robot.tell(imu=False)
    east = declination(*ORIGIN, datetime.date(2023, 11, 14))
    robot.node.on_imu(robot.imu(offset=-east))  # the needle points east of north: the IMU's angle is too large
    assert len(robot.tick()) == 1
    assert f'{math.degrees(east):.2f} deg east by the magnetic model of 2023-11-14' in robot.informed[0]
    assert len(robot.informed) == 1
    robot.x = 1000.0
    robot.tell()
    assert robot.off(robot.tick()[0]) < 1e-3


def test_simulated_time_takes_today_s_declination():
    robot = GpsRobot()
    robot.now = 12.0
    robot.tell()
    assert len(robot.tick()) == 1 and '2026-11-25' in robot.informed[0]


@pytest.mark.parametrize('params', [{'magnetic_declination_radians': 0.3}, {'yaw_offset': 0.3, **TRUE}])
def test_the_user_s_own_angles_are_added_as_in_the_cpp_node(params):
    robot = GpsRobot(**params)
    robot.tell(imu=False)
    robot.node.on_imu(robot.imu(offset=0.3))
    robot.tick()
    robot.x = 100.0
    robot.tell()
    assert robot.off(robot.tick()[0]) < 1e-6
    assert 'magnetic_declination_radians' in robot.informed[0] and 'model' not in robot.informed[0]


def test_use_odometry_yaw_takes_the_odometry_s_heading_and_needs_no_imu():
    robot = GpsRobot(use_odometry_yaw=True, **TRUE)
    robot.world = Transform.from_xyz_rpy(5.0, 0.0, yaw=-robot.convergence)  # its yaw counts from true east
    robot.tell(imu=False)
    assert not robot.node.needs_imu and len(robot.tick()) == 1
    robot.x, robot.y = 30.0, 40.0
    robot.tell(imu=False)
    assert robot.off(robot.tick()[0]) < 1e-6


def test_an_imu_s_mounting_counts():
    robot = GpsRobot(**TRUE)
    robot.buffer.set_transform('base_link', 'imu_link', Transform.from_xyz_rpy(yaw=1.2))
    robot.tell(imu=False)
    robot.node.on_imu(robot.imu(frame_id='/imu_link', offset=-1.2))
    robot.tick()
    robot.x = 100.0
    robot.tell()
    assert robot.off(robot.tick()[0]) < 1e-6


# Datum, services, outputs


def test_a_datum_is_the_origin_of_the_world():
    robot = GpsRobot(wait_for_datum=True, datum=[ORIGIN[0], ORIGIN[1], 0.0])
    x, y, z = robot.node.from_ll(*ORIGIN)
    assert (x, y, z) == pytest.approx((0.0, 0.0, ORIGIN[2]), abs=1e-6)
    assert 'no declination' in robot.informed[0]  # the user's heading is the true one
    x, y, _ = robot.node.from_ll(ORIGIN[0] + 1e-4, ORIGIN[1], 0.0)
    assert (x, y) == pytest.approx((0.0, 11.12), abs=0.01)


def test_a_datum_by_the_service_turns_the_world():
    robot = GpsRobot()
    robot.node.set_datum(*ORIGIN, quaternion_from_rpy(0.0, 0.0, math.pi / 2))
    x, y, z = robot.node.from_ll(ORIGIN[0] + 1e-4, ORIGIN[1], ORIGIN[2] + 2.0)
    assert (x, y, z) == pytest.approx((11.12, 0.0, 2.0), abs=0.01)
    robot.tell(imu=False)
    assert len(robot.tick()) == 1 and robot.node.waiting_for() == ''


@pytest.mark.parametrize('params', [{}, {'use_local_cartesian': True}])
def test_there_and_back(params):
    robot = GpsRobot(world=(3.0, 4.0, 1.0), **params, **TRUE).laid()
    rng = np.random.default_rng(0)
    for point in rng.uniform(-3000.0, 3000.0, (50, 3)):
        place = robot.node.to_ll(tuple(point))
        assert robot.node.from_ll(*place) == pytest.approx(tuple(point), abs=1e-5)
    assert robot.node.from_ll(*ORIGIN[:2], math.nan)[2] == 0.0  # altitude not known: on the ground


def test_local_cartesian_is_true_to_scale_and_has_no_convergence():
    robot = GpsRobot(use_local_cartesian=True, wait_for_datum=True, datum=[0.0, 2.99, 0.0])
    x, _, _ = robot.node.from_ll(0.0, 3.0, 0.0)
    assert x == pytest.approx(math.radians(0.01) * 6378137.0, abs=1e-3)
    assert robot.node.world.convergence == 0.0
    flat = GpsRobot(wait_for_datum=True, datum=[0.0, 2.99, 0.0])
    assert flat.node.from_ll(0.0, 3.0, 0.0)[0] == pytest.approx(0.9996 * x, abs=1e-3)


def test_the_neighbouring_zone_goes_on_without_a_jump():
    """robot_localization's UtmTest."""
    robot = GpsRobot()
    robot.node.set_datum(1.0, 4.0, 0.0, IDENTITY.rotation)
    first, same, beyond = (robot.node.from_ll(10.0, longitude, 0.0) for longitude in (4.5, 5.5, 6.5))
    assert max(abs(first[k] - same[k]) for k in (0, 1)) < 120e3
    assert max(abs(first[k] - beyond[k]) for k in (0, 1)) < 2 * 120e3


def test_another_utm_zone_moves_the_transform_and_leaves_the_world_where_it_is():
    """robot_localization's UtmServiceTest, and more."""
    robot = GpsRobot(broadcast_cartesian_transform=True, broadcast_cartesian_transform_as_parent_frame=True, **TRUE)
    robot.node.set_zone('32U')
    robot.laid()
    point = robot.node.from_ll(*ORIGIN)
    robot.node.set_zone('33U')
    robot.tick()
    before, after = robot.transforms
    assert (before.parent, before.child) == ('utm', 'odom')
    assert abs(before.transform.translation[0] - after.transform.translation[0]) > 1.0
    assert abs(before.transform.rotation[2] - after.transform.rotation[2]) > 0.02
    assert robot.node.from_ll(*ORIGIN) == pytest.approx(point, abs=1e-6)
    robot.tick()
    assert len(robot.transforms) == 2  # told when it has changed
    with pytest.raises(NoPlace, match='too far from UTM zone 1 north'):
        robot.node.set_zone('1N')
    with pytest.raises(NoPlace, match='use_local_cartesian'):
        GpsRobot(use_local_cartesian=True).node.set_zone('31U')


@pytest.mark.parametrize('zero', [False, True])
@pytest.mark.parametrize('parent', [False, True])
def test_the_transform_leads_from_grid_to_world(parent, zero):
    robot = GpsRobot(
        world=(3.0, 4.0, 1.0),
        broadcast_cartesian_transform=True,
        broadcast_cartesian_transform_as_parent_frame=parent,
        zero_altitude=zero,
        cartesian_frame_id='grid',
        **TRUE,
    ).laid()
    (told,) = robot.transforms
    grid_from_world = told.transform if parent else told.transform.inverse()
    assert (told.parent, told.child) == (('grid', 'odom') if parent else ('odom', 'grid'))
    x, y, _ = grid_from_world.apply((3.0, 4.0, 0.0))
    assert (x, y) == pytest.approx((robot.east, robot.north), abs=1e-5)
    assert (told.transform.translation[2] == 0.0) == zero


def test_filtered_fixes_are_the_odometry_s_pose_on_the_earth():
    robot = GpsRobot(world=(3.0, 4.0, math.pi / 2), publish_filtered_gps=True, **TRUE).laid()
    robot.x = 25.0
    covariance = np.diag([1.0, 9.0, 4.0, 0.0, 0.0, 0.0])
    robot.node.on_odometry(robot.odometry(pose_covariance=covariance))
    robot.tick()
    found, wanted = robot.filtered[-1], robot.fix()
    assert (found.latitude, found.longitude) == pytest.approx((wanted.latitude, wanted.longitude), abs=1e-9)
    assert found.altitude == pytest.approx(ORIGIN[2], abs=1e-6)
    assert np.diag(found.covariance) == pytest.approx([9.0, 1.0, 4.0], rel=2e-2)
    count = len(robot.filtered)
    robot.tick()
    assert len(robot.filtered) == count  # no new odometry
    robot.node.on_odometry(robot.odometry(pose_covariance=np.full((6, 6), math.nan)))
    robot.tick()
    assert robot.filtered[-1].covariance_type == 0 and not robot.filtered[-1].covariance.any()


def test_zero_altitude_holds_z_at_zero():
    robot = GpsRobot(zero_altitude=True, **TRUE).laid()
    robot.node.on_odometry(robot.odometry())
    robot.node.on_fix(robot.fix(altitude=700.0), robot.now)
    robot.node.on_fix(robot.fix(altitude=math.nan), robot.now)
    assert [answer.position[2] for answer in robot.tick()] == [0.0, 0.0]
    assert robot.node.from_ll(*ORIGIN[:2], 900.0)[2] == 0.0


def test_delay_is_waited_for():
    robot = GpsRobot(delay=3.0, **TRUE)
    times = []
    for _ in range(50):
        robot.tell()
        if robot.tick():
            times.append(robot.now - START)
    assert times[0] == pytest.approx(3.1, abs=0.11) and 'delay' in ''.join(robot.said)


def test_nobody_answers_before_it_is_known():
    robot = GpsRobot()
    for call in (lambda: robot.node.from_ll(*ORIGIN), lambda: robot.node.to_ll((0.0, 0.0, 0.0))):
        with pytest.raises(NoPlace, match='not known yet: waiting for odometry/filtered and imu/data and gps/fix'):
            call()
    waiting = GpsRobot(wait_for_datum=True)
    waiting.tell()
    assert waiting.tick() == [] and 'waiting for a datum' in waiting.node.waiting_for()
    with pytest.raises(NoPlace, match='not finite'):
        robot.laid().node.to_ll((math.nan, 0.0, 0.0))


@pytest.mark.parametrize(
    'datum, why',
    [
        ((math.nan, 0.0, 0.0, IDENTITY.rotation), 'latitude is nan'),
        ((89.0, 0.0, 0.0, IDENTITY.rotation), 'too near to a pole'),
        ((10.0, 0.0, 1e300, IDENTITY.rotation), 'the altitude is 1e'),
        ((10.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0)), 'stands for no rotation; w = 1 alone heads east'),
    ],
)
def test_a_datum_that_is_none_is_refused_and_the_one_before_stays(datum, why):
    robot = GpsRobot(wait_for_datum=True, datum=[10.0, 20.0, 0.0])
    with pytest.raises(NoPlace, match=why):
        robot.node.set_datum(*datum)
    assert robot.node.world.anchor[:2] == (10.0, 20.0)


# What is faulty


@pytest.mark.parametrize(
    'changes, kind',
    [
        ({'status': -1}, 'no_fix'),
        ({'latitude': math.nan}, 'bad_place'),
        ({'longitude': 1e300}, 'bad_place'),
        ({'altitude': math.inf}, 'no_altitude'),
        ({'altitude': 1e6}, 'bad_altitude'),
        ({'stamp': 0.0}, 'no_stamp'),
        ({'covariance': np.diag([1e9, 1.0, 1.0])}, 'huge_covariance'),
        ({'covariance': np.diag([math.inf, math.inf, math.inf])}, 'huge_covariance'),
        ({'covariance': np.diag([math.nan, math.inf, 1.0])}, 'huge_covariance'),
        ({'stamp': START + 100.0}, 'ahead'),
        ({'stamp': START - 100.0}, 'too_old'),
        ({'latitude': -89.0}, 'out_of_grid'),
    ],
)
def test_a_fix_that_is_dropped_is_told_once_in_words_and_the_next_is_used(changes, kind):
    robot = GpsRobot(**TRUE).laid()
    for _ in range(3):
        robot.node.on_odometry(robot.odometry())
        robot.node.on_fix(robot.fix(**{'stamp': robot.now, **changes}), robot.now)
        robot.tick()
    robot.tick(1.5)
    (said,) = robot.said
    assert said.startswith('fix (gps/fix): ') and robot.node.accounts['fix'].problems == {kind: 3}
    robot.tell()
    assert len(robot.tick()) == 1 and len(robot.said) == 1


@pytest.mark.parametrize(
    'changes, expected, kind',
    [
        ({'covariance': np.zeros((3, 3))}, [25.0, 25.0, 100.0], 'no_covariance'),
        ({'covariance_type': 0}, [25.0, 25.0, 100.0], 'no_covariance'),
        ({'covariance': np.diag([1.0, -1.0, 1.0])}, [25.0, 25.0, 100.0], 'bad_covariance'),
        ({'covariance': np.full((3, 3), math.nan)}, [25.0, 25.0, 100.0], 'bad_covariance'),
        ({'covariance': np.array([[1.0, 5.0, 0], [5.0, 1.0, 0], [0, 0, 4.0]])}, [1.0, 1.0, 4.0], 'bad_correlations'),
    ],
)
def test_a_fix_of_an_impossible_covariance_is_used_with_one_that_is_told(changes, expected, kind):
    robot = GpsRobot(**TRUE).laid()
    robot.node.on_odometry(robot.odometry())
    robot.node.on_fix(robot.fix(**changes), robot.now)
    (answer,) = robot.tick()
    assert np.diag(answer.pose_covariance)[:3] == pytest.approx(expected)
    assert list(robot.node.accounts['fix'].problems) == [kind] and len(robot.said) == 1


@pytest.mark.parametrize('told', [1e9, math.inf])
def test_a_fix_whose_height_is_not_known_counts_in_the_plane(told):
    robot = GpsRobot(**TRUE).laid()
    robot.node.on_odometry(robot.odometry())
    robot.node.on_fix(robot.fix(covariance=np.diag([4.0, 4.0, told])), robot.now)
    (answer,) = robot.tick()
    assert np.diag(answer.pose_covariance)[:3] == pytest.approx([4.0, 4.0, 1e6]) and not robot.said


def test_an_antenna_without_a_transform_is_waited_for_a_second_then_taken_at_the_origin():
    robot = GpsRobot(transforms=False, **TRUE)
    robot.tell()
    assert robot.tick() == [] and robot.said == []
    assert len(robot.tick(1.0)) == 1
    assert 'no transform base_link -> gps' in robot.said[0]
    robot.tell()
    assert len(robot.tick()) == 1  # no more waiting
    robot.buffer.set_transform('base_link', 'gps', Transform((0.5, 0.0, 0.0)))
    robot.tell()
    assert robot.tick()[0].position[0] == pytest.approx(-0.5, abs=1e-6)
    assert len(robot.said) == 1


@pytest.mark.parametrize('arm', [(0.0, math.nan, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, 1e6)])
def test_an_antenna_where_no_robot_has_one_is_told_and_taken_at_the_origin(arm):
    robot = GpsRobot(transforms=False, **TRUE)
    robot.buffer.set_transform('base_link', 'gps', Transform(arm))
    robot.laid()
    robot.tell()
    assert robot.off(robot.tick()[0]) < 1e-6
    assert len(robot.said) == 1 and 'gps is at ' in robot.said[0]


def test_altitudes_that_no_robot_has_are_refused():
    robot = GpsRobot(**TRUE).laid()
    for call in (lambda: robot.node.from_ll(*ORIGIN[:2], 1e15), lambda: robot.node.to_ll((0.0, 0.0, 1e300))):
        with pytest.raises(NoPlace, match='the altitude is 1e'):
            call()


def test_fixes_without_a_frame_are_the_robot_s_own():
    robot = GpsRobot((0.0, 0.0, 0.0), transforms=False, **TRUE)
    robot.node.on_odometry(robot.odometry())
    robot.node.on_imu(robot.imu())
    robot.node.on_fix(robot.fix(frame_id=''), robot.now)
    assert len(robot.tick()) == 1 and 'no frame_id' in robot.said[0]


@pytest.mark.parametrize(
    'changes, kind',
    [
        ({'orientation': (0.0, 0.0, 0.0, 0.0)}, 'bad_orientation'),
        ({'orientation': (math.nan, 0.0, 0.0, 1.0)}, 'bad_orientation'),
        ({'orientation_covariance': np.diag([-1.0, 0.0, 0.0])}, 'no_orientation'),
        ({'frame_id': 'nowhere'}, 'no_transform'),
        ({'stamp': math.nan}, 'no_stamp'),
    ],
)
def test_an_imu_of_no_use_is_told_and_waited_for(changes, kind):
    robot = GpsRobot(**TRUE)
    for _ in range(3):
        robot.tell(imu=False)
        robot.node.on_imu(robot.imu(**changes))
        assert robot.tick() == []
    assert robot.node.accounts['imu'].problems == {kind: 3} and len(robot.said) == 1
    assert robot.node.waiting_for() == 'waiting for imu/data'
    assert robot.laid()


@pytest.mark.parametrize(
    'changes, kind',
    [
        ({'frame_id': ''}, 'no_frame'),
        ({'position': (math.nan, 0.0, 0.0)}, 'not_usable'),
        ({'position': (1e300, 0.0, 0.0)}, 'not_usable'),
        ({'orientation': (0.0, 0.0, 0.0, 0.0)}, 'not_usable'),
        ({'stamp': 0.0}, 'not_usable'),
        ({'stamp': START - 100.0}, 'went_back'),
        ({'stamp': math.nan}, 'not_usable'),
        ({'frame_id': 'map'}, 'other_frame'),
    ],
)
def test_odometry_that_cannot_be_used_is_told(changes, kind):
    robot = GpsRobot(**TRUE).laid()
    robot.node.on_odometry(robot.odometry(**{'stamp': robot.now, **changes}))
    assert kind in robot.node.accounts['odometry'].problems and robot.said
    robot.tell()
    assert len(robot.tick()) == 1


@pytest.mark.parametrize('restarts', [False, True])
def test_a_clock_that_goes_back_is_told_and_a_simulation_begins_anew(restarts):
    robot = GpsRobot(restarts=restarts, **TRUE).laid()
    robot.now = START - 50.0
    robot.x = 500.0
    robot.world = Transform.from_xyz_rpy(-500.0, 0.0)
    robot.tick()
    assert 'the clock went back by 50' in ' '.join(robot.said)
    robot.tell()
    (answer,) = robot.tick()
    assert robot.off(answer) == pytest.approx(0.0 if restarts else 500.0, abs=1e-5)
    assert len(robot.informed) == (2 if restarts else 1)


def test_a_simulation_that_begins_anew_may_have_another_world_frame():
    robot = GpsRobot(restarts=True, **TRUE).laid()
    robot.now = START - 50.0
    robot.tick()
    robot.node.on_odometry(robot.odometry(frame_id='map'))
    robot.node.on_imu(robot.imu())
    robot.node.on_fix(robot.fix(), robot.now)
    assert robot.tick()[0].frame_id == 'map'


def test_fixes_that_nobody_takes_do_not_pile_up():
    robot = GpsRobot(**TRUE)
    for _ in range(1500):
        robot.node.on_fix(robot.fix(), robot.now)
    robot.tick()
    assert 'more than 1000 fixes wait' in robot.said[0] and robot.node.accounts['fix'].problems['overflow'] == 500


def test_the_node_is_no_worse_for_strange_topics():
    node = NavSat(NavSatConfig(), TransformBuffer(), topics={'fix': '/f', 'odometry': '/o', 'imu': '/i'})
    assert node.waiting_for() == 'waiting for /o and /i and /f'


@pytest.mark.parametrize('height', [0.0, -1.0, math.nan])
def test_a_fix_in_the_plane_is_as_exact_as_it_says(height):
    fix = FixData(1.0, 'gps', 2, 48.1, 11.6, math.nan, np.diag([1e-4, 4e-4, height]), 2)
    good, problems = usable(fix, True, 5.0)
    assert good.covariance.diagonal()[:2].tolist() == [1e-4, 4e-4] and not problems
    good, _ = usable(fix._replace(altitude=500.0), False, 5.0)
    assert good.covariance[0, 0] == 25.0, 'where heights count it is no covariance'
