#!/usr/bin/env python3
"""filter_bag from its command line: its last line, its bag, its refusals, and the recorded drive of a Husky.

The recorded drive (robot_localization's test1.bag) is looked for in $SARA_SHARED_DATA, else in ../shared/data beside the
repository; without it that test is skipped.
"""
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rosbag
import rospkg
import rospy
import rostest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

PACKAGE = Path(rospkg.RosPack().get_path('sara_localization'))
SHARED = Path(os.environ.get('SARA_SHARED_DATA', PACKAGE.resolve().parents[1].parent / 'shared' / 'data'))
HUSKY_END, HUSKY_TOLERANCE = (-40.0454, -76.9988, -2.6974), 1.0452
PARAMS = '''
frequency: 30
two_d_mode: true
odom0: odom
odom0_config: [false, false, false, false, false, false, true, false, false, false, false, false, false, false, false]
imu0: /imu
imu0_config: [false, false, false, false, false, true, false, false, false, false, false, true, false, false, false]
'''


def filter_bag(*arguments):
    return subprocess.run(['rosrun', 'sara_localization', 'filter_bag', *map(str, arguments)], capture_output=True, text=True)


def quarter_circle(path):
    """10 s of 0.5 m/s along a circle, a quarter of it; the IMU stands upside down on its own link."""
    rate = math.pi / 2 / 10.0
    with rosbag.Bag(str(path), 'w') as bag:
        for k in range(501):
            stamp = rospy.Time.from_sec(1000.0 + 0.02 * k)
            odom = Odometry()
            odom.header.stamp, odom.header.frame_id, odom.child_frame_id = stamp, 'odom', 'base_link'
            odom.twist.twist.linear.x = 0.5
            odom.twist.covariance = [1e-4 if i % 7 == 0 else 0.0 for i in range(36)]
            bag.write('/odom', odom, stamp)
            imu = Imu()
            imu.header.stamp, imu.header.frame_id = stamp, 'imu_link'
            yaw = rate * 0.02 * k
            imu.orientation.x, imu.orientation.y = math.cos(yaw / 2), math.sin(yaw / 2)     # rolled by half a turn
            imu.angular_velocity.z = -rate
            imu.orientation_covariance = imu.angular_velocity_covariance = [1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4]
            bag.write('/imu', imu, stamp)


class FilterBagTest(unittest.TestCase):

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.params = self.folder / 'params.yaml'
        self.params.write_text(PARAMS)
        self.bag, self.out = self.folder / 'in.bag', self.folder / 'out.bag'

    def test_a_quarter_circle_ends_where_it_should_and_the_bag_holds_it(self):
        quarter_circle(self.bag)
        run = filter_bag(self.bag, self.out, '--params', self.params,
                         '--static-tf', '0 0 0.1 0 0 %r base_link imu_link' % math.pi)
        self.assertEqual(run.returncode, 0, run.stderr)
        result = json.loads(run.stdout.splitlines()[-1])
        self.assertEqual(result['messages'], 1002)
        self.assertGreater(result['seconds'], 0.0)
        radius = 0.5 * 10.0 / (math.pi / 2)
        for value, expected in zip(result['final'], (radius, radius, 0.0, 0.0, 0.0, math.pi / 2)):
            self.assertAlmostEqual(value, expected, delta=0.1)      # up to five ticks beyond the last message
        with rosbag.Bag(str(self.out)) as bag:
            topics = bag.get_type_and_topic_info().topics
            last = list(bag.read_messages(topics=['odometry/filtered']))[-1].message
        self.assertGreater(topics['odometry/filtered'].message_count, 290)
        self.assertGreater(topics['/tf'].message_count, 290)
        self.assertEqual(last.pose.pose.position.x, result['final'][0])

    def test_a_missing_transform_is_named(self):
        quarter_circle(self.bag)
        run = filter_bag(self.bag, self.out, '--params', self.params)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn('no transform imu_link -> base_link', run.stderr)

    def test_what_cannot_be_used_is_refused_in_a_sentence(self):
        quarter_circle(self.bag)
        bad = self.folder / 'bad.yaml'
        bad.write_text(PARAMS + 'odom0_differential: perhaps\n')
        for arguments, word in (((self.bag, self.out, '--params', bad), 'odom0_differential'),
                                ((self.bag, self.bag, '--params', self.params), 'another file'),
                                ((self.folder / 'no.bag', self.out, '--params', self.params), 'no.bag'),
                                ((self.bag, self.out, '--params', self.params, '--static-tf', '1 2 3'), '--static-tf')):
            run = filter_bag(*arguments)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn(word, run.stderr)
            self.assertNotIn('Traceback', run.stderr)

    @unittest.skipUnless((SHARED / 'bags' / 'test1.bag').is_file(), 'test1.bag (recorded Husky drive) is not there')
    def test_the_recorded_husky_drive_ends_where_the_peers_test_asks(self):
        run = filter_bag(SHARED / 'bags' / 'test1.bag', self.out, '--params', SHARED / 'bags' / 'test1_ekf.yaml',
                         '--static-tf', '0 -0.3 0.52 -1.570796327 0 1.570796327 base_link imu_link')
        self.assertEqual(run.returncode, 0, run.stderr)
        final = json.loads(run.stdout.splitlines()[-1])['final']
        self.assertLess(math.dist(final[:3], HUSKY_END), HUSKY_TOLERANCE)


if __name__ == '__main__':
    rostest.rosrun('sara_localization', 'filter_bag', FilterBagTest, sys.argv)
