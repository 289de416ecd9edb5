#!/usr/bin/env python3
"""filter_bag with navsat_transform_node, gps_outages and check_config on its parameters, from their command lines.

The recorded drive (robot_localization's test1.bag) is looked for in $SARA_SHARED_DATA, else in ../shared/data beside
the repository; without it its test is skipped.
"""

import json
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import rosbag
import rospkg
import rospy
import rostest
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, NavSatFix

from sara_localization.gps.utm import Utm, Zone

PACKAGE = Path(rospkg.RosPack().get_path('sara_localization'))
SHARED = Path(os.environ.get('SARA_SHARED_DATA', PACKAGE.resolve().parents[1].parent / 'shared' / 'data'))
HUSKY_IMU = '0 -0.3 0.52 -1.570796327 0 1.570796327 base_link imu_link'
HERE = (48.1, 11.6)
SECONDS, SPEED, RATE = 50, 1.0, 0.05
PARAMS = """
frequency: 20
two_d_mode: true
world_frame: odom
odom0: odom
odom0_config: [false, false, false, false, false, false, true, true, false, false, false, false, false, false, false]
odom1: odometry/gps
odom1_config: [true, true, false, false, false, false, false, false, false, false, false, false, false, false, false]
imu0: /imu
imu0_config: [false, false, false, false, false, true, false, false, false, false, false, true, false, false, false]
"""
NO_YAW = 'false, false, false, false, false, false'
HEADING = """
imu1: gps/heading
imu1_config: [false, false, false, false, false, true, false, false, false, false, false, false, false, false, false]
"""
NAVSAT = 'frequency: 10\nyaw_offset: 1.5707963\nmagnetic_declination_radians: 0.0\nzero_altitude: true\n'


def tool(name, *arguments):
    return subprocess.run(['rosrun', 'sara_localization', name, *map(str, arguments)], capture_output=True, text=True)


def circle(path, bias=0.0, lost=0):
    """A drive along a circle with exact sensors; the IMU says 0 facing north, the antenna is 0.5 m ahead. bias: of the
    gyro, rad/s; lost: how many messages there are before the first fix.
    """
    grid = Utm(Zone.of(*HERE))
    east, north = grid.forward(*HERE)
    convergence, radius = grid.convergence(*HERE), SPEED / RATE
    with rosbag.Bag(str(path), 'w') as bag:
        for k in range(20 * SECONDS + 1):
            t = 0.05 * k
            stamp, yaw = rospy.Time.from_sec(1.5e9 + t), RATE * t
            odom, imu = Odometry(), Imu()
            odom.header.stamp, odom.header.frame_id, odom.child_frame_id = stamp, 'odom', 'base_link'
            odom.twist.twist.linear.x = SPEED
            odom.twist.covariance = [1e-4 if i % 7 == 0 else 0.0 for i in range(36)]
            bag.write('/odom', odom, stamp)
            imu.header.stamp, imu.header.frame_id = stamp, 'base_link'
            told = yaw - convergence - math.pi / 2
            imu.orientation.z, imu.orientation.w = math.sin(told / 2), math.cos(told / 2)
            imu.angular_velocity.z = RATE + bias
            imu.orientation_covariance = imu.angular_velocity_covariance = [1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4]
            bag.write('/imu', imu, stamp)
            if k % 10 == 5:
                x, y = radius * math.sin(yaw) + 0.5 * math.cos(yaw), radius * (1 - math.cos(yaw)) + 0.5 * math.sin(yaw)
                fix = NavSatFix()
                fix.header.stamp, fix.header.frame_id = stamp, 'gps'
                fix.latitude, fix.longitude = grid.inverse(east + x, north + y)
                if k < 10 * lost:
                    fix.status.status, fix.latitude, fix.longitude = -1, 0.0, 0.0
                fix.position_covariance, fix.position_covariance_type = [0.25, 0, 0, 0, 0.25, 0, 0, 0, 1.0], 2
                bag.write('/fix', fix, stamp)
                velocity, true = TwistStamped(), yaw - convergence
                velocity.header = fix.header
                ahead, aside = SPEED, 0.5 * RATE
                velocity.twist.linear.x = ahead * math.cos(true) - aside * math.sin(true)
                velocity.twist.linear.y = ahead * math.sin(true) + aside * math.cos(true)
                bag.write('/gps/vel', velocity, stamp)


class GpsBagTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.params, self.navsat = self.folder / 'params.yaml', self.folder / 'navsat.yaml'
        self.params.write_text(PARAMS)
        self.navsat.write_text(NAVSAT)
        self.bag, self.out = self.folder / 'in.bag', self.folder / 'out.bag'

    def options(self):
        antenna = '0.5 0 0 0 0 0 base_link gps'
        given = ['--params', self.params, '--navsat', self.navsat, '--fix', 'fix', '--imu', '/imu']
        return [*given, '--static-tf', antenna]

    def test_every_fix_comes_out_where_the_filter_has_the_robot(self):
        circle(self.bag)
        run = tool('filter_bag', self.bag, self.out, *self.options())
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn('magnetic_declination_radians 0.00000', run.stderr)
        self.assertEqual(json.loads(run.stdout.splitlines()[-1])['gps'], {'fixes': 100, 'converted': 100})
        track, worst = [], 0.0
        with rosbag.Bag(str(self.out)) as bag:
            for topic, msg, _ in bag.read_messages(topics=['odometry/filtered', 'odometry/gps']):
                place = msg.header.stamp.to_sec(), msg.pose.pose.position.x, msg.pose.pose.position.y
                if topic == 'odometry/filtered':
                    track.append(place)
                else:
                    near = min(track, key=lambda other: abs(other[0] - place[0]))
                    worst = max(worst, math.dist(near[1:], place[1:]))
        self.assertLess(worst, 0.3)

    def test_velocities_tell_the_yaw(self):
        circle(self.bag)
        self.params.write_text(PARAMS + HEADING)
        self.navsat.write_text(NAVSAT + 'velocity_heading: true\n')
        run = tool('filter_bag', self.bag, '-', *self.options())
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn('imu1 (gps/heading): 99 used', run.stderr)  # the first comes before the world frame is known
        *_, yaw = json.loads(run.stdout.splitlines()[-1])['final']
        self.assertAlmostEqual(yaw, RATE * SECONDS - 0.5 * math.pi, delta=0.05)  # the IMU's, which is 0 facing north

    def test_outages_are_judged(self):
        circle(self.bag)
        run = tool('gps_outages', self.bag, *self.options(), '--windows', 2, '--seconds', 10)
        self.assertEqual(run.returncode, 0, run.stderr)
        result = json.loads(run.stdout.splitlines()[-1])
        self.assertEqual(len(result['errors']), 2)
        self.assertLess(result['worst'], 0.5)
        for driven in result['driven']:
            self.assertAlmostEqual(driven, 10.0 * SPEED, delta=0.5)

    def test_the_receiver_s_heading_is_withheld_with_its_fixes(self):
        circle(self.bag, bias=0.03)
        covariance = [10.0 if i == 5 else 1e-9 for i in range(15)]
        rate_alone = PARAMS.replace('imu0_config: [false, false, false, false, false, true', 'imu0_config: [' + NO_YAW)
        self.params.write_text(f'{rate_alone}{HEADING}initial_estimate_covariance: {covariance}\n')
        self.navsat.write_text(NAVSAT + 'velocity_heading: true\n')
        run = tool('gps_outages', self.bag, *self.options(), '--windows', 3, '--seconds', 12)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertGreater(json.loads(run.stdout.splitlines()[-1])['median'], 1.0)  # 12 s at 1 m/s, turned by 0.36 rad

    def test_places_without_a_fix_are_no_reference(self):
        circle(self.bag, lost=3)
        run = tool('filter_bag', self.bag, '-', *self.options(), '--reference', '/fix')
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertLess(json.loads(run.stdout.splitlines()[-1])['rmse'], 1.0)

    def test_the_input_is_not_overwritten_by_another_name(self):
        circle(self.bag)
        before, link = self.bag.read_bytes(), self.folder / 'link.bag'
        link.symlink_to(self.bag)
        run = tool('filter_bag', link, self.bag, *self.options())
        self.assertIn('OUT.bag must be another file', run.stderr)
        self.assertEqual(self.bag.read_bytes(), before)

    def test_what_cannot_be_used_is_refused_in_a_sentence(self):
        circle(self.bag)
        self.params.write_text(PARAMS.replace('odometry/gps', 'odometry/other'))
        for name, out in (('filter_bag', [self.out]), ('gps_outages', [])):
            run = tool(name, self.bag, *out, *self.options())
            self.assertEqual(run.returncode, 1)
            self.assertIn('no input of the filter is /odometry/gps', run.stderr.splitlines()[-1])
        self.params.write_text(PARAMS)
        run = tool('gps_outages', self.bag, *self.options(), '--seconds', 1000)
        self.assertIn('the drive is too short', run.stderr)
        self.navsat.write_text('frequency: 0')
        run = tool('filter_bag', self.bag, self.out, *self.options())
        self.assertIn('frequency is 0', run.stderr)

    def test_check_config_knows_the_node_s_parameters(self):
        run = tool('check_config', self.navsat)
        self.assertEqual((run.returncode, run.stdout), (0, 'nothing to mend was found\n'))
        self.navsat.write_text('yaw_offset: 90.0\nmagnetic_declination_radians: 3.5\n')
        run = tool('check_config', self.navsat)
        self.assertEqual(run.returncode, 0)
        self.assertEqual(run.stdout.count('it counts in radians'), 2)

    @unittest.skipUnless((SHARED / 'bags' / 'test1.bag').exists(), 'the recorded drive is not here')
    def test_every_fix_of_the_recorded_drive_comes_out(self):
        examples = PACKAGE / 'config' / 'examples'
        run = tool(
            'filter_bag',
            SHARED / 'bags' / 'test1.bag',
            '-',
            *('--params', examples / 'husky_gps.yaml', '--navsat', examples / 'husky_navsat.yaml'),
            *('--fix', '/fix', '--static-tf', HUSKY_IMU, '--reference', '/fix'),
        )
        self.assertEqual(run.returncode, 0, run.stderr)
        result = json.loads(run.stdout.splitlines()[-1])
        self.assertEqual(result['gps'], {'fixes': 989, 'converted': 989})
        self.assertLess(result['rmse'], 3.0)


if __name__ == '__main__':
    rostest.rosrun('sara_localization', 'gps_bag', GpsBagTest)
