#!/usr/bin/env python3
"""Another localization than the EKF: the chair is where it is said to be, and reaches a goal."""

import unittest

import actionlib
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_bringup.ros.goals import goal_at


class LocalizationTest(unittest.TestCase):
    def test_a_goal_is_reached(self):
        if rospy.has_param('/ekf_se'):
            self.assertEqual(rospy.get_param('/ekf_se/backend'), rospy.get_param('/expected_backend'))
        rospy.wait_for_message('/imu/data', Imu)
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        client.wait_for_server()
        rospy.sleep(2.0)
        client.send_goal(goal_at((2.5, 1.0, 0.0)))
        self.assertTrue(client.wait_for_result(rospy.Duration(30.0)))
        self.assertEqual(client.get_state(), GoalStatus.SUCCEEDED, client.get_goal_status_text())
        rospy.sleep(1.0)
        truth = rospy.wait_for_message('/ground_truth', Odometry).pose.pose.position
        said = buffer.lookup_transform('map', 'base_link', rospy.Time(0), rospy.Duration(5.0)).transform.translation
        self.assertAlmostEqual(truth.x, 2.5, delta=0.1)
        self.assertAlmostEqual(said.x, truth.x, delta=0.08)
        self.assertAlmostEqual(said.y, truth.y, delta=0.08)


if __name__ == '__main__':
    rospy.init_node('localization_test')
    rostest.rosrun('sara_bringup', 'localization', LocalizationTest)
