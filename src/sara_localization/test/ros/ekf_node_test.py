#!/usr/bin/env python3
"""The node's wiring: what goes in on its topics comes out on its topics, transforms and service."""

import math
import sys
import threading
import unittest

import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelWithCovarianceStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from robot_localization.srv import SetPose
from sara_localization.geometry.rigid import quaternion_from_rpy, rpy_from_quaternion

SPEED = 0.2


def yaw_of(q):
    return rpy_from_quaternion((q.x, q.y, q.z, q.w))[2]


class Robot:
    """Plays wheels, IMU and odom -> base_link; an IMU that follows set_pose, as SARA's does."""

    def __init__(self):
        self.speed, self.yaw, self.x = 0.0, 0.0, 0.0
        self.odom_pub = rospy.Publisher('/diff_drive_controller/odom', Odometry, queue_size=5)
        self.imu_pub = rospy.Publisher('/imu/data', Imu, queue_size=5)
        self.broadcaster = tf2_ros.TransformBroadcaster()
        rospy.Subscriber('set_pose', PoseWithCovarianceStamped, self._set_pose)
        self.running = True
        threading.Thread(target=self._run, daemon=True).start()

    def _set_pose(self, msg):
        self.yaw = yaw_of(msg.pose.pose.orientation)

    def _run(self):
        rate, k, told, before = rospy.Rate(10), 0, 0.0, rospy.Time.now()
        while self.running and not rospy.is_shutdown():
            now = rospy.Time.now()
            self.x += told * (now - before).to_sec()  # as the filter has it, however late this comes
            told, before = self.speed, now
            odom = Odometry()
            odom.header.stamp, odom.header.frame_id, odom.child_frame_id = now, 'odom', 'base_link'
            odom.pose.pose.position.x = self.x
            odom.pose.pose.orientation.w = 1.0
            odom.twist.twist.linear.x = told
            odom.pose.covariance = odom.twist.covariance = [0.001 if i % 7 == 0 else 0.0 for i in range(36)]
            link = TransformStamped()
            link.header, link.child_frame_id = odom.header, 'base_link'
            link.transform.translation.x, link.transform.rotation.w = self.x, 1.0
            self.broadcaster.sendTransform(link)
            self.odom_pub.publish(odom)
            if k % 2 == 0:
                imu = Imu()
                imu.header.stamp, imu.header.frame_id = now, 'base_link'
                q = imu.orientation
                q.x, q.y, q.z, q.w = quaternion_from_rpy(0.0, 0.0, self.yaw)
                imu.orientation_covariance = [0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.0098]
                imu.angular_velocity_covariance = [2.6e-6, 0, 0, 0, 2.8e-6, 0, 0, 0, 1.6e-6]
                self.imu_pub.publish(imu)
            k += 1
            rate.sleep()


class EkfNodeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.buffer = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)
        cls.outputs = []
        rospy.Subscriber('odometry/filtered', Odometry, cls.outputs.append)
        cls.set_pose_pub = rospy.Publisher('set_pose', PoseWithCovarianceStamped, queue_size=1)
        cls.robot = Robot()
        rospy.wait_for_message('odometry/filtered', Odometry, 20.0)

    def wait_until(self, condition, timeout, what):
        end = rospy.Time.now() + rospy.Duration(timeout)
        while rospy.Time.now() < end:
            if condition():
                return
            rospy.sleep(0.02)
        self.fail(what)

    def map_to_base(self):
        t = self.buffer.lookup_transform('map', 'base_link', rospy.Time(0), rospy.Duration(5)).transform
        return t.translation.x, t.translation.y, yaw_of(t.rotation)

    def pose(self, x, y, yaw):
        msg = PoseWithCovarianceStamped()
        msg.header.stamp, msg.header.frame_id = rospy.Time.now(), 'map'
        msg.pose.pose.position.x, msg.pose.pose.position.y = x, y
        q = msg.pose.pose.orientation
        q.x, q.y, q.z, q.w = quaternion_from_rpy(0.0, 0.0, yaw)
        msg.pose.covariance = [0.0] * 36
        for i, variance in ((0, 0.25), (7, 0.25), (35, 0.0685)):
            msg.pose.covariance[i] = variance
        return msg

    def shows(self, x, y, yaw):
        def near(a, b):
            return abs(a - b) < 0.02

        last, seen = self.outputs[-1], self.map_to_base()
        p = last.pose.pose
        return (
            near(p.position.x, x)
            and near(p.position.y, y)
            and near(yaw_of(p.orientation), yaw)
            and near(seen[0], x)
            and near(seen[1], y)
            and near(seen[2], yaw)
        )

    def test_1_starts_at_the_initial_state_and_publishes_at_its_rate(self):
        self.assertTrue(self.shows(1.0, 1.0, 0.0), (self.outputs[-1].pose.pose, self.map_to_base()))
        last = self.outputs[-1]
        self.assertEqual((last.header.frame_id, last.child_frame_id), ('map', 'base_link'))
        for _ in range(10):  # a machine that is busy makes it late now and then, but never too fast
            before = len(self.outputs)
            self.wait_until(lambda before=before: len(self.outputs) > before + 50, 20.0, 'it hardly publishes')
            # By their stamps: what a late computer has kept waiting comes all at once.
            begin, end = (self.outputs[k].header.stamp for k in (before, before + 50))
            rate = 50 / (end - begin).to_sec()
            self.assertLessEqual(rate, 60.0)
            if rate >= 40.0:
                return
        self.fail(f'it publishes {rate:.1f} times a second')

    def test_2_acceleration_and_diagnostics_are_published(self):
        acceleration = rospy.wait_for_message('accel/filtered', AccelWithCovarianceStamped, 5.0)
        self.assertEqual(acceleration.header.frame_id, 'base_link')
        names = {s.name for s in rospy.wait_for_message('/diagnostics', DiagnosticArray, 5.0).status}
        self.assertLessEqual({'ekf_se: Filter diagnostic updater', 'ekf_se: odometry/filtered topic status'}, names)

    def test_3_set_pose_on_the_topic_holds_at_rest(self):
        self.wait_until(lambda: self.set_pose_pub.get_num_connections() == 2, 20.0, 'set_pose is not listened to')
        self.set_pose_pub.publish(self.pose(2.0, 3.0, 1.0))
        self.wait_until(lambda: self.shows(2.0, 3.0, 1.0), 20.0, 'set_pose does not show')
        rospy.sleep(1.5)
        self.assertTrue(self.shows(2.0, 3.0, 1.0), 'set_pose did not stay')

    def test_4_drives_as_the_wheels_say_where_the_imu_points(self):
        x, y, yaw = self.map_to_base()
        began = self.robot.x
        self.robot.speed = SPEED
        rospy.sleep(2.0)
        self.robot.speed = 0.0
        rospy.sleep(1.0)
        way = self.robot.x - began
        seen = self.map_to_base()
        self.assertAlmostEqual(seen[0], x + way * math.cos(yaw), delta=0.04)
        self.assertAlmostEqual(seen[1], y + way * math.sin(yaw), delta=0.04)

    def test_5_set_pose_by_service(self):
        rospy.wait_for_service('set_pose', 5.0)
        self.robot.yaw = 0.5
        rospy.sleep(0.5)
        rospy.ServiceProxy('set_pose', SetPose)(self.pose(5.0, 1.0, 0.5))
        self.wait_until(lambda: self.shows(5.0, 1.0, 0.5), 20.0, 'set_pose by service does not show')


if __name__ == '__main__':
    rospy.init_node('ekf_node_test')
    rostest.rosrun('sara_localization', 'ekf_node', EkfNodeTest, sys.argv)
