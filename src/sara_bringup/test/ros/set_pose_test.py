#!/usr/bin/env python3
"""/set_pose at rest turns IMU, filter and tf together; a turn afterwards adds what the chair turned."""

import math
import unittest

import actionlib
import rosgraph
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_bringup.ros.goals import goal_at, until
from sara_common.planar import wrap, yaw_of

YAW = 1.0
PATIENCE_S = 30.0  # of wall time, until all know of the pose


class SetPoseTest(unittest.TestCase):
    def setUp(self):
        self.yaw = {}
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer)
        rospy.Subscriber('/imu/data', Imu, lambda m: self.yaw.__setitem__('imu', yaw_of(m.orientation)))
        for name, topic in (('filtered', '/odometry/filtered'), ('true', '/ground_truth')):
            rospy.Subscriber(
                topic, Odometry, lambda m, name=name: self.yaw.__setitem__(name, yaw_of(m.pose.pose.orientation))
            )
        rospy.wait_for_message('/imu/data', Imu)
        rospy.wait_for_message('/odometry/filtered', Odometry)
        rospy.wait_for_message('/ground_truth', Odometry)
        rospy.sleep(1.0)

    def tf_yaw(self):
        return yaw_of(
            self.buffer.lookup_transform('map', 'base_link', rospy.Time(0), rospy.Duration(2.0)).transform.rotation
        )

    def all_have_turned(self):
        yaws = self.yaw['imu'], self.yaw['filtered'], self.tf_yaw()
        return all(abs(wrap(yaw - YAW)) < 0.02 for yaw in yaws)

    def test_set_pose_then_a_quarter_turn(self):
        self.assertEqual(rospy.get_param('/move_base/lost_topic'), '')  # lost_topic:=none
        publisher = rospy.Publisher('/set_pose', PoseWithCovarianceStamped, queue_size=1)
        listeners = dict(rosgraph.Master('/set_pose_test').getSystemState()[1])['/set_pose']
        self.assertIn('/read', listeners)
        while publisher.get_num_connections() < len(listeners):
            rospy.sleep(0.05)
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.header.stamp = 'map', rospy.Time.now()
        message.pose.pose.position.x = message.pose.pose.position.y = 1.0
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = math.sin(YAW / 2), math.cos(YAW / 2)
        message.pose.covariance = [1e-4 if k in (0, 7, 35) else 0.0 for k in range(36)]
        publisher.publish(message)
        rospy.sleep(1.0)
        until(self.all_have_turned, 'all have turned', PATIENCE_S)
        for _ in range(5):  # and it stays so
            self.assertAlmostEqual(self.yaw['imu'], YAW, delta=0.02)
            self.assertAlmostEqual(self.yaw['filtered'], YAW, delta=0.02)
            self.assertAlmostEqual(self.tf_yaw(), YAW, delta=0.02)
            rospy.sleep(0.3)

        before = dict(self.yaw, tf=self.tf_yaw())
        client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        client.wait_for_server()
        self.assertEqual(
            client.send_goal_and_wait(goal_at((1.0, 1.0, YAW + math.pi / 2)), rospy.Duration(60.0)),
            GoalStatus.SUCCEEDED,
        )
        rospy.sleep(1.0)
        after = dict(self.yaw, tf=self.tf_yaw())
        for name in ('imu', 'filtered', 'tf', 'true'):
            self.assertAlmostEqual(math.degrees(wrap(after[name] - before[name])), 90.0, delta=3.0, msg=name)


if __name__ == '__main__':
    rospy.init_node('set_pose_test')
    rostest.rosrun('sara_bringup', 'set_pose', SetPoseTest)
