#!/usr/bin/env python3
"""Wiring of slam_gmapping: scans and tf of a simulated robot in; map, map_metadata, ~entropy, map -> odom, dynamic_map
and diagnostics out; the map through map_saver; the same drive as a bag through map_bag.

The robot is steered by its true pose, so that nothing depends on how fast the computer is.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import numpy as np
import rosbag
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from nav_msgs.srv import GetMap
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

from sara_common.planar import compose, inverse, yaw_of
from sara_nav.maps.map_io import FREE, OCCUPIED, load_map
from sara_sim.robot.script import Along, Face, Script

sys.path.append(str(Path(__file__).resolve().parents[1] / 'unit'))
from slam_world import CELL, plan  # noqa: E402

PATIENCE_S = 60.0
START = (3.0, 1.0, 0.0)
WAY = Script([Along(((12.0, 1.0), (13.0, 2.0), (13.0, 5.0)), 0.6), Face(3.1)])


def world():
    cells = plan()
    message = OccupancyGrid(data=cells.ravel().tolist())
    message.info.height, message.info.width = cells.shape
    message.info.resolution, message.info.origin.orientation.w = CELL, 1.0
    return message


def planar(pose):
    return pose.position.x, pose.position.y, yaw_of(pose.orientation)


class SlamTest(unittest.TestCase):
    def setUp(self):
        self.heard, self.told = {}, {}
        for topic, kind in (
            ('base_pose_ground_truth', Odometry),
            ('map', OccupancyGrid),
            ('map_metadata', MapMetaData),
            ('slam_gmapping/entropy', Float64),
        ):
            rospy.Subscriber(topic, kind, lambda m, name=topic: self.heard.update({name: m}), tcp_nodelay=True)
        self.recorded = []
        for topic, kind in (('/tf', TFMessage), ('base_scan', LaserScan)):
            rospy.Subscriber(topic, kind, lambda m, name=topic: self.recorded.append((name, m)), tcp_nodelay=True)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)
        self.command = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        self.scans = rospy.Publisher('base_scan', LaserScan, queue_size=1)
        self.buffer = tf2_ros.Buffer(rospy.Duration(1000.0))
        self.listener = tf2_ros.TransformListener(self.buffer)
        self.world = rospy.Publisher('world', OccupancyGrid, queue_size=1, latch=True)
        self.world.publish(world())

    def on_diagnostics(self, array):
        self.told.update({status.name: status for status in array.status})

    def until(self, condition, why, act=lambda: None):
        deadline = time.monotonic() + PATIENCE_S
        while not (found := condition()):
            self.assertLess(time.monotonic(), deadline, why)
            act()
            time.sleep(0.02)
        return found

    def status(self):
        return self.told.get('slam_gmapping: slam_gmapping')

    def truth(self):
        """The robot's true pose seen from where it began."""
        return compose(inverse(START), planar(self.heard['base_pose_ground_truth'].pose.pose))

    def test_all(self):
        """One after the other, for the node keeps what it learned."""
        self.until(lambda: 'map' in self.heard and 'base_pose_ground_truth' in self.heard, 'no first map')
        self.drives()
        self.knows_where_it_is()
        self.answers_and_is_saved()
        self.maps_a_bag()
        self.says_what_it_cannot_use()

    def drives(self):
        def steer():
            message = self.heard['base_pose_ground_truth']
            command = Twist()
            pose = planar(message.pose.pose)
            command.linear.x, command.angular.z = WAY.command(message.header.stamp.to_sec(), pose)
            self.command.publish(command)

        for _ in range(5):  # a busy computer may need longer than one patience
            try:
                self.until(lambda: WAY.done, 'the robot does not arrive', steer)
                break
            except AssertionError:
                continue
        self.assertTrue(WAY.done)

    def counted(self, what):
        return int({value.key: value.value for value in self.status().values}.get(what, 0))

    def knows_where_it_is(self):
        self.until(self.status, 'no diagnostics')
        # 2 s of scans from where it stands: all that it heard on the way is used then, and its map stays as it is.
        heard = sum(topic == 'base_scan' for topic, _ in self.recorded) + 20
        self.until(lambda: self.counted('scans') > heard, 'it is behind with its scans')

        def off():
            try:
                found = self.buffer.lookup_transform('map', 'base_link', rospy.Time(0)).transform
            except tf2_ros.TransformException:
                return math.inf
            place = (found.translation.x, found.translation.y)
            return math.dist(place, self.truth()[:2])

        self.until(lambda: off() < 0.15, f'the robot is {off():.2f} m off in the map')

        def ahead():
            of_map = self.buffer.get_latest_common_time('map', 'odom')
            return (of_map - self.buffer.get_latest_common_time('odom', 'base_link')).to_sec()

        self.until(lambda: ahead() > 0.06, 'map -> odom is not dated ahead')  # tf_delay; 0.05 s are from odom to odom
        self.assertTrue(math.isfinite(self.until(lambda: self.heard.get('slam_gmapping/entropy'), 'no entropy').data))
        self.until(lambda: self.status().level == DiagnosticStatus.OK, 'something is wrong')
        self.assertGreater(self.counted('used'), 30)

    def answers_and_is_saved(self):
        answer = rospy.ServiceProxy('dynamic_map', GetMap)().map
        self.assertEqual(answer.header.frame_id, 'map')
        self.until(lambda: self.heard['map'].info == answer.info, 'the map that the service gave is not published')
        self.until(lambda: self.heard.get('map_metadata') == answer.info, 'its metadata are not published')
        with tempfile.TemporaryDirectory() as folder:
            saver = ['rosrun', 'sara_nav', 'map_saver', '-f', f'{folder}/ours']
            subprocess.run(saver, check=True, timeout=PATIENCE_S, stdout=subprocess.DEVNULL)
            saved = load_map(f'{folder}/ours.yaml')
        self.assertTrue(np.array_equal(saved.data.ravel(), np.array(answer.data, np.int8)))
        self.assert_right(saved)

    def assert_right(self, saved):
        g, true = saved.geometry, plan() == 100
        rows, columns = np.nonzero(saved.data == OCCUPIED)
        x, y = g.origin_x + (columns + 0.5) * CELL + START[0], g.origin_y + (rows + 0.5) * CELL + START[1]
        walls = np.argwhere(true)[:, ::-1] * CELL + 0.5 * CELL
        off = np.array([np.hypot(*(walls - place).T).min() for place in zip(x, y)])
        self.assertGreater(len(off), 400)
        self.assertLess(np.percentile(off, 95), 0.12)
        rows, columns = np.nonzero(saved.data == FREE)
        self.assertGreater(len(rows) * CELL**2, 15.0)  # m2 of the corridor

    def maps_a_bag(self):
        recorded = list(self.recorded)
        with tempfile.TemporaryDirectory() as folder:
            with rosbag.Bag(f'{folder}/drive.bag', 'w') as bag:
                for topic, message in recorded:
                    stamp = message.transforms[0].header.stamp if topic == '/tf' else message.header.stamp
                    if topic != '/tf' or message.transforms[0].child_frame_id != 'odom':
                        bag.write(topic, message, max(stamp, rospy.Time(0, 1)))
            maps = []
            for name in ('one', 'two'):
                command = ['rosrun', 'sara_slam', 'map_bag', f'{folder}/drive.bag', f'{folder}/{name}', '--quiet']
                done = subprocess.run(command, check=True, timeout=4 * PATIENCE_S, stdout=subprocess.PIPE, text=True)
                maps.append(Path(f'{folder}/{name}.pgm').read_bytes())
            self.assertGreater(json.loads(done.stdout.splitlines()[-1])['key_scans'], 30)
            self.assertEqual(*maps)
            self.assert_right(load_map(f'{folder}/one.yaml'))
            wrong = subprocess.run([*command, '--scan', 'scan'], stderr=subprocess.PIPE, text=True, check=False)
            self.assertEqual(wrong.returncode, 1)
            self.assertIn('it has them on: /base_scan', wrong.stderr)

    def says_what_it_cannot_use(self):
        bad = LaserScan(range_min=0.1, range_max=math.nan)
        bad.header.frame_id = 'base_laser_link'
        bad.header.stamp = self.heard['base_pose_ground_truth'].header.stamp
        self.scans.publish(bad)
        count = lambda: {v.key: v.value for v in self.status().values}.get('bad_scan')
        self.until(lambda: count() == '1', 'a faulty scan is not counted')


if __name__ == '__main__':
    rospy.init_node('slam_gmapping_test', disable_rostime=True)
    rostest.rosrun('sara_slam', 'slam_gmapping_wiring', SlamTest)
