#!/usr/bin/env python3
"""The simulated robot seen from outside: stage_ros's topics, frames and service, on a map from a topic."""

import math
import time
import unittest

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty

PATIENCE_S = 40.0


def room():
    """6 m x 6 m within walls of one cell."""
    cells = np.zeros((122, 122), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    message = OccupancyGrid(data=cells.ravel().tolist())
    message.info.height = message.info.width = 122
    message.info.resolution, message.info.origin.orientation.w = 0.05, 1.0
    message.info.origin.position.x = message.info.origin.position.y = -0.05
    return message


class RobotTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('robot_test')
        cls.map = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
        cls.map.publish(room())
        cls.heard = {}
        for topic, kind in (
            ('odom', Odometry),
            ('base_pose_ground_truth', Odometry),
            ('base_scan_0', LaserScan),
            ('base_scan_1', LaserScan),
        ):
            rospy.Subscriber(topic, kind, lambda m, name=topic: cls.heard.update({name: m}), tcp_nodelay=True)
        cls.command = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        cls.lift = rospy.Publisher('cmd_pose', Pose, queue_size=1)
        cls.buffer = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)

    def setUp(self):
        self.until(lambda: len(self.heard) == 4, 'a topic is silent')

    def until(self, condition, why, act=lambda: None):
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertLess(time.monotonic(), deadline, why)
            act()
            time.sleep(0.02)

    def pose(self):
        pose = self.heard['base_pose_ground_truth'].pose.pose
        return pose.position.x, pose.position.y, 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)

    def at_rest(self):
        twist = self.heard['base_pose_ground_truth'].twist.twist
        return twist.linear.x == 0.0 and twist.angular.z == 0.0

    def drive(self, v, w):
        message = Twist()
        message.linear.x, message.angular.z = v, w
        self.command.publish(message)

    def test_1_it_stands_where_it_was_put_and_says_so(self):
        self.assertEqual(self.pose(), (1.0, 2.0, 0.5))
        odometry, truth = self.heard['odom'], self.heard['base_pose_ground_truth']
        self.assertEqual((odometry.header.frame_id, odometry.child_frame_id), ('odom', 'base_footprint'))
        self.assertEqual(truth.header.frame_id, 'map')
        self.assertEqual(odometry.pose.pose.position.x, 0.0)

    def test_2_frames_and_scans_are_stage_s(self):
        for parent, child, x in (
            ('odom', 'base_footprint', 0.0),
            ('base_footprint', 'base_link', 0.0),
            ('base_link', 'base_laser_link_0', 0.1),
            ('base_link', 'base_laser_link_1', -0.1),
        ):
            self.until(lambda p=parent, c=child: self.buffer.can_transform(p, c, rospy.Time()), f'{child} is missing')
            at = self.buffer.lookup_transform(parent, child, rospy.Time()).transform.translation
            self.assertAlmostEqual(at.x, x, 9)
        front, rear = self.heard['base_scan_0'], self.heard['base_scan_1']
        self.assertEqual((front.header.frame_id, len(front.ranges)), ('base_laser_link_0', 541))
        self.assertEqual((rear.header.frame_id, len(rear.ranges)), ('base_laser_link_1', 91))
        ahead = front.ranges[270]  # of a robot at (1, 2, 0.5): the room's right wall
        self.assertAlmostEqual(ahead, (6.0 - 1.0) / math.cos(0.5) - 0.1, delta=0.06)

    def test_3_it_drives_while_it_is_commanded_and_no_longer(self):
        start = self.pose()
        self.until(
            lambda: math.dist(self.pose()[:2], start[:2]) > 0.3, 'it does not move', lambda: self.drive(0.5, 0.0)
        )
        self.until(self.at_rest, 'it does not stop in silence')
        since = self.heard['base_pose_ground_truth'].header.stamp
        self.until(lambda: self.heard['odom'].header.stamp >= since, 'no odometry of that time')
        driven = self.heard['odom'].pose.pose.position.x
        self.assertAlmostEqual(driven, math.dist(self.pose()[:2], start[:2]), delta=0.1)

    def test_4_what_is_no_number_does_not_move_it(self):
        self.until(self.at_rest, 'it moves')
        before, since = self.pose(), rospy.get_time()
        self.until(lambda: rospy.get_time() > since + 2.0, 'no clock', lambda: self.drive(math.nan, math.inf))
        self.assertEqual(self.pose(), before)

    def test_5_it_is_lifted_and_put_back(self):
        message = Pose()
        message.position.x, message.position.y, message.orientation.w = 4.0, 4.0, 1.0
        self.until(lambda: self.pose() == (4.0, 4.0, 0.0), 'it is not lifted', lambda: self.lift.publish(message))
        message.position.x = 6.0  # in the wall
        self.lift.publish(message)
        message.position.x = math.nan
        self.lift.publish(message)
        reset = rospy.ServiceProxy('reset_positions', Empty)
        self.until(lambda: self.pose() == (1.0, 2.0, 0.5), 'it is not put back', reset)


if __name__ == '__main__':
    import rostest

    rostest.rosrun('sara_sim', 'robot_test', RobotTest)
