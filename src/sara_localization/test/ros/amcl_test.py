#!/usr/bin/env python3
"""Wiring of amcl: map, scans, poses and tf in; map -> odom, amcl_pose, particlecloud, saved pose and diagnostics out;
its services; dynamic_reconfigure.

Time is that of the stamps, and each scan is sent when the one before was answered: nothing depends on how fast the
computer is.
"""

import math
import subprocess
import sys
import threading
import unittest
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import numpy as np
import rosnode
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse, SetMap
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from sara_common.planar import compose, quaternion_from_yaw, yaw_of
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.ranges import map_echo
from sara_localization.ros.amcl.node import AmclNode

sys.path.append(str(Path(__file__).resolve().parent / 'support'))
from waiting import wait_until  # noqa: E402

CELL, COUNT, MOST = 0.05, 90, 8.0
DRIFT = (-2.0, 1.0, 0.5)  # the map seen from the odometry's frame at the start
STEP = rospy.Duration(0.1)
BEARINGS = np.linspace(-math.pi, math.pi, COUNT, endpoint=False)


def room():
    """uint8 (rows, columns): 10 m x 6 m with an inner wall and a cupboard."""
    cells = np.zeros((120, 200), np.uint8)
    cells[:2] = cells[-2:] = 1
    cells[:, :2] = cells[:, -2:] = 1
    cells[0:50, 80:82] = cells[100:110, 120:160] = 1
    return cells


CELLS = room()


def map_message(cells):
    msg = OccupancyGrid()
    msg.header.frame_id = 'map'
    msg.info.resolution, msg.info.height, msg.info.width = CELL, *cells.shape
    msg.info.origin.orientation.w = 1.0
    msg.data = (100 * cells.astype(np.int8)).ravel().tolist()
    return msg


def transform(stamp, parent, child, pose):
    msg = TransformStamped()
    msg.header.stamp, msg.header.frame_id, msg.child_frame_id = stamp, parent, child
    msg.transform.translation.x, msg.transform.translation.y = pose[:2]
    q = msg.transform.rotation
    q.x, q.y, q.z, q.w = quaternion_from_yaw(pose[2])
    return msg


def pose_message(pose, sigma):
    msg = PoseWithCovarianceStamped()
    msg.header.frame_id = 'map'
    msg.pose.pose.position.x, msg.pose.pose.position.y = pose[:2]
    q = msg.pose.pose.orientation
    q.x, q.y, q.z, q.w = quaternion_from_yaw(pose[2])
    msg.pose.covariance[0] = msg.pose.covariance[7] = msg.pose.covariance[35] = sigma**2
    return msg


class AmclTest(unittest.TestCase):
    def setUp(self):
        self.poses, self.clouds, self.second, self.told = [], [], [], {}
        self.lost = []
        self.scan_pub = rospy.Publisher('base_scan', LaserScan, queue_size=100)
        self.tf_pub = rospy.Publisher('/tf', TFMessage, queue_size=100)
        self.pose_pub = rospy.Publisher('initialpose', PoseWithCovarianceStamped, queue_size=10)
        self.map_pub = rospy.Publisher('second/map', OccupancyGrid, queue_size=1, latch=True)
        rospy.Subscriber('amcl_pose', PoseWithCovarianceStamped, self.poses.append)
        rospy.Subscriber('lost_probability', Float32, lambda msg: self.lost.append(msg.data))
        rospy.Subscriber('second/amcl_pose', PoseWithCovarianceStamped, self.second.append)
        rospy.Subscriber('particlecloud', PoseArray, self.clouds.append)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)
        self.buffer = tf2_ros.Buffer(rospy.Duration(1000.0))
        self.listener = tf2_ros.TransformListener(self.buffer)
        wait_until(lambda: self.scan_pub.get_num_connections() == 2, 'the nodes do not listen to base_scan')
        wait_until(lambda: self.tf_pub.get_num_connections() >= 3, 'the nodes do not listen to /tf')
        wait_until(self.pose_pub.get_num_connections, 'the node does not listen to initialpose')
        self.stamp, self.truth = rospy.Time.now(), (5.0, 3.0, 0.0)
        self.sent = 0

    def on_diagnostics(self, array):
        for status in array.status:
            self.told[status.name] = status

    def message(self, name='amcl: amcl'):
        return self.told[name].message if name in self.told else ''

    def value(self, key, name='amcl: amcl'):
        return {v.key: v.value for v in self.told[name].values}.get(key) if name in self.told else None

    def clouds_after(self, stamp):
        """Of scans after that of a stamp, however late those before come."""
        return [cloud for cloud in self.clouds if cloud.header.stamp > stamp + 0.5 * STEP]

    def send(self, mount=(0.2, 0.0, 0.0), frame='laser', answered=True, lasts=0.0):
        """A scan of so many s from the true pose, with the transforms of its time; returns map -> odom of that time."""
        self.stamp += STEP
        odometry = compose(DRIFT, self.truth)
        self.tf_pub.publish(
            TFMessage(
                [
                    transform(self.stamp, 'odom', 'base_link', odometry),
                    transform(self.stamp, 'base_link', 'laser', mount),
                ]
            )
        )
        x, y, yaw = compose(self.truth, mount)
        cast = lambda bearing: map_echo.cast(CELLS, x / CELL, y / CELL, yaw + bearing, MOST / CELL)[0] * CELL
        msg = LaserScan(angle_min=BEARINGS[0], angle_max=BEARINGS[-1], angle_increment=2 * math.pi / COUNT)
        msg.header.stamp, msg.header.frame_id = self.stamp, frame
        msg.time_increment = lasts / (COUNT - 1)
        msg.range_min, msg.range_max, msg.ranges = 0.1, MOST, [cast(float(b)) for b in BEARINGS]
        self.scan_pub.publish(msg)
        self.sent += 1
        if not answered:
            return None
        dated = self.stamp + rospy.Duration(0.1)
        wait_until(lambda: self.buffer.can_transform('map', 'odom', dated), 'a scan is not answered by map -> odom')
        return self.buffer.lookup_transform('map', 'odom', dated).transform

    def estimate(self, sent):
        """The pose (x, y, yaw) that map -> odom makes of the odometry."""
        offset = (sent.translation.x, sent.translation.y, yaw_of(sent.rotation))
        return compose(offset, compose(DRIFT, self.truth))

    def drive(self, steps):
        for _ in range(steps):
            self.truth = compose(self.truth, (0.06, 0.0, 0.05))
            sent = self.send()
        return self.estimate(sent)

    def assert_near(self, pose, place=0.12, turn=0.06):
        self.assertLess(math.dist(pose[:2], self.truth[:2]), place)
        self.assertLess(abs(math.remainder(pose[2] - self.truth[2], 2.0 * math.pi)), turn)

    def test_all(self):
        """One after the other, for the node keeps what it learned."""
        self.waits_for_the_map_and_takes_it()
        self.tracks()
        self.waits_for_no_scan_from_the_future()
        self.waits_for_the_odometry_of_a_sweep_s_end()
        self.saves_its_pose()
        self.goes_on_without_a_master()
        self.starts_at_no_half_pose_where_a_map_comes_while_one_is_saved()
        self.updates_at_rest()
        self.follows_a_scanner_that_is_turned()
        self.second_node_takes_its_map_from_the_topic()
        self.can_be_set_anywhere_and_given_another_map()
        self.can_be_reconfigured()
        self.says_what_it_cannot_use()
        self.starts_again_where_it_was()

    def waits_for_the_map_and_takes_it(self):
        wait_until(lambda: self.message() == 'waiting for the map', 'diagnostics do not say what is waited for')
        with self.assertRaises(rospy.ServiceException):
            rospy.ServiceProxy('global_localization', Empty)()
        self.pose_pub.publish(pose_message((5.15, 2.9, 0.1), 0.2))  # before the map: it waits for it
        rospy.Service('static_map', GetMap, lambda _: GetMapResponse(map_message(CELLS)))
        wait_until(lambda: 'waiting for a scan' in self.message(), 'the map of static_map is not taken')

    def tracks(self):
        self.assert_near(self.estimate(self.send()), 0.4, 0.3)
        self.assert_near(self.drive(60))
        last = wait_until(lambda: self.poses and self.poses[-1], 'no amcl_pose')
        self.assertEqual(last.header.frame_id, 'map')
        self.assertTrue(all(0.0 < last.pose.covariance[k] < 0.05 for k in (0, 7, 35)))
        wait_until(lambda: self.lost and self.lost[-1] < 0.2, 'a pose that is right counts as lost')
        heard = len(self.lost)
        wait_until(lambda: len(self.lost) > heard, 'lost_probability is not repeated at rest')
        cloud = wait_until(lambda: self.clouds and self.clouds[-1], 'no particlecloud')
        self.assertTrue(300 <= len(cloud.poses) <= 2000)
        place = np.mean([(p.position.x, p.position.y) for p in cloud.poses], 0)
        self.assertLess(math.dist(place, self.truth[:2]), 0.3)
        self.assertAlmostEqual(sum(q * q for q in self._quaternion(cloud.poses[7])), 1.0, places=9)
        wait_until(
            lambda: self.told['amcl: amcl'].level == DiagnosticStatus.OK and 'scans used' in self.message(),
            'diagnostics are not satisfied',
        )
        wait_until(lambda: 'amcl: Standard deviation' in self.told, 'no status of the standard deviation')

    def waits_for_no_scan_from_the_future(self):
        msg = LaserScan(angle_increment=1.0, range_max=MOST, ranges=[1.0] * 3)
        msg.header.stamp, msg.header.frame_id = self.stamp + rospy.Duration(3600.0), 'laser'
        self.scan_pub.publish(msg)
        self.assert_near(self.drive(3))

    def waits_for_the_odometry_of_a_sweep_s_end(self):
        self.send(answered=False, lasts=0.5 * STEP.to_sec())
        dated = self.stamp + rospy.Duration(0.1)
        rospy.sleep(0.3)
        self.assertFalse(self.buffer.can_transform('map', 'odom', dated), 'a scan is used before its end is known')
        sent = self.send()
        self.assertTrue(self.buffer.can_transform('map', 'odom', dated), 'a sweep is not used')
        self.assert_near(self.estimate(sent))

    @staticmethod
    def _quaternion(pose):
        return pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w

    def saves_its_pose(self):
        saved = lambda: [rospy.get_param(f'amcl/initial_pose_{axis}') for axis in 'xya']
        wait_until(lambda: math.dist(saved()[:2], self.truth[:2]) < 0.4, 'the pose is not saved')
        self.assertTrue(0.0 < rospy.get_param('amcl/initial_cov_xx') < 0.05)

    @staticmethod
    def bare_node(**amcl):
        node = object.__new__(AmclNode)
        node.lock, node.saving, node.known = threading.RLock(), threading.Lock(), {}
        node.last_odometry, node.config = Transform(), AmclConfig()
        node.amcl = SimpleNamespace(belief=object(), map_from_odom=Transform(), **amcl)
        return node

    def goes_on_without_a_master(self):
        with mock.patch('sara_localization.ros.amcl.node.save', side_effect=ConnectionRefusedError):
            self.bare_node().save_pose()

    def starts_at_no_half_pose_where_a_map_comes_while_one_is_saved(self):
        begun, server = [], {}
        node = self.bare_node(set_map=lambda map_: None, set_pose=lambda *pose: begun.append(pose))
        takes = threading.Thread(target=node.take_map, args=(map_message(CELLS),))

        def save(_pose, _belief):
            server['initial_pose_x'] = 1.0
            takes.start()
            takes.join(0.3)  # it would have ended by now
            server['initial_pose_y'] = 2.0

        of_node = 'sara_localization.ros.amcl.node'
        with mock.patch(f'{of_node}.save', save), mock.patch(f'{of_node}.saved', lambda: dict(server)):
            node.save_pose()
            takes.join(20.0)
        self.assertEqual((takes.is_alive(), begun), (False, []))

    def updates_at_rest(self):
        self.send()
        since = self.stamp
        self.send()
        rospy.ServiceProxy('request_nomotion_update', Empty)()
        self.send()
        once = lambda: len(self.clouds_after(since)) == 1
        wait_until(once, 'a forced update does not publish the particles once')

    def follows_a_scanner_that_is_turned(self):
        for k in range(12):
            rospy.ServiceProxy('request_nomotion_update', Empty)()
            sent = self.send(mount=(0.2, 0.0, 0.2 * k))
        self.assert_near(self.estimate(sent))

    def second_node_takes_its_map_from_the_topic(self):
        name = 'second/amcl: amcl'
        dropped = lambda: self.value('no_map', name)
        why = lambda: f'{dropped()} of {self.sent} scans are dropped for want of a map'
        wait_until(lambda: dropped() == str(self.sent), why)  # none is left that would be used with the map
        self.map_pub.publish(map_message(CELLS))
        wait_until(lambda: 'waiting for a scan' in self.message(name), 'the map of the topic is not taken')
        self.map_pub.publish(map_message(CELLS[:10, :10]))  # not the first
        self.send()
        first = wait_until(lambda: self.second and self.second[0], 'the second node does not answer a scan')
        self.assertLess(math.hypot(first.pose.pose.position.x, first.pose.pose.position.y - 3.0), 1.5)

    def can_be_set_anywhere_and_given_another_map(self):
        rospy.ServiceProxy('global_localization', Empty)()
        wait_until(lambda: self.lost[-1] == 1.0, 'anywhere does not count as lost')
        since = self.stamp
        self.send()
        cloud = wait_until(lambda: self.clouds_after(since), 'no particles after a global start')[-1]
        self.assertGreater(len(cloud.poses), 2000)  # until the place is found
        set_map = rospy.ServiceProxy('set_map', SetMap)
        self.assertFalse(set_map(OccupancyGrid(), pose_message(self.truth, 0.1)).success)
        self.assertTrue(set_map(map_message(CELLS), pose_message(self.truth, 0.1)).success)
        self.assert_near(self.estimate(self.send()))
        self.assert_near(self.drive(10))

    def can_be_reconfigured(self):
        client = Client('amcl', timeout=10.0)
        changed = client.update_configuration({'max_particles': 400, 'laser_model_type': 'beam', 'tf_broadcast': True})
        self.assertEqual((changed['max_particles'], changed['laser_model_type']), (400, 'beam'))
        self.assertEqual(client.update_configuration({'odom_model_type': 'ackermann'})['odom_model_type'], 'diff')
        self.assertEqual(client.update_configuration({'min_particles': 900})['min_particles'], 300)
        self.assert_near(self.drive(10))
        wait_until(lambda: len(self.clouds[-1].poses) <= 400, 'max_particles is not heeded')

    def says_what_it_cannot_use(self):
        self.pose_pub.publish(pose_message((math.nan, 0.0, 0.0), 0.1))
        other = pose_message((0.0, 0.0, 0.0), 0.1)
        other.header.frame_id = 'odom'
        self.pose_pub.publish(other)
        bad = LaserScan(range_min=0.1, range_max=math.nan)
        bad.header.stamp, bad.header.frame_id = self.stamp, 'laser'
        self.scan_pub.publish(bad)
        wait_until(lambda: self.value('bad_scan') == '1', 'a faulty scan is not counted')
        self.send(frame='nowhere', answered=False)
        wait_until(lambda: 'no transform base_link -> nowhere' in self.message(), 'a missing transform is not told')
        self.assert_near(self.drive(2))  # nothing of all that has moved the pose

    def starts_again_where_it_was(self):
        """Its process ends, and a new one begins: nobody tells it where it is."""
        self.assertGreater(math.dist(self.truth[:2], (5.0, 3.0)), 0.5, 'the pose of the launch file would do')
        rosnode.kill_nodes(['/amcl'])
        wait_until(lambda: self.scan_pub.get_num_connections() == 1, 'the node does not end')
        command = ['rosrun', 'sara_localization', 'amcl', '__name:=amcl', 'scan:=base_scan']
        with subprocess.Popen(command) as again:
            try:
                wait_until(lambda: self.scan_pub.get_num_connections() == 2, 'the node does not start again')
                wait_until(lambda: 'waiting for a scan' in self.message(), 'the new node has no map')
                wait_until(lambda: self.tf_pub.get_num_connections() >= 3, 'the new node does not listen to /tf')
                self.assert_near(self.estimate(self.send()), 0.3, 0.15)
                self.assert_near(self.drive(10))
            finally:
                rosnode.kill_nodes(['/amcl'])
                again.wait(20)


if __name__ == '__main__':
    rospy.init_node('amcl_test')
    rostest.rosrun('sara_localization', 'amcl_wiring', AmclTest)
