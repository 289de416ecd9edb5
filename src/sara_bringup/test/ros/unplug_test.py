#!/usr/bin/env python3
"""The adapter is pulled out while the chair drives: it stops, says so once, and after plugging back waits for the next
goal.
"""

import unittest

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu

from sara_bringup.ros.goals import goal_at
from sara_sim.srv import Fault

MOVING = 0.4  # m/s: fast enough to be worth stopping
AT_REST = 0.05  # m/s
BUS_S, BRAKE = 0.25, 1.5  # s until the loss is noticed below, m/s2
OUT_S = 4.0


class UnplugTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.log, cls.truth = [], None
        rospy.Subscriber('/rosout', Log, cls.log.append)
        rospy.Subscriber(
            '/ground_truth', Odometry, lambda message: setattr(cls, 'truth', message), queue_size=1, tcp_nodelay=True
        )
        rospy.wait_for_message('/imu/data', Imu)
        rospy.wait_for_message('/odometry/filtered', Odometry)

    def speed(self):
        """True speed, m/s."""
        return abs(self.truth.twist.twist.linear.x)

    def now(self):
        """Time of the newest truth, s: the service call below must not blur when the chair stopped."""
        return self.truth.header.stamp.to_sec()

    def wait(self, condition, seconds, what):
        end = rospy.get_time() + seconds
        while not condition():
            self.assertLess(rospy.get_time(), end, f'not within {seconds} s: {what}')
            rospy.sleep(0.01)

    def lines(self, *words):
        """What canserial has logged with these words in it."""
        return [line.msg for line in self.log if line.name == '/canserial' and all(word in line.msg for word in words)]

    def test_unplugged_while_driving(self):
        client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        client.wait_for_server()
        client.send_goal(goal_at((5.0, 1.0, 0.0)))
        self.wait(lambda: self.speed() > MOVING, 10.0, 'the chair drives')
        before = self.speed()
        del self.log[:]
        out = rospy.ServiceProxy('/simulator/fault', Fault)('adapter_unplugged', f'duration: {OUT_S}')
        self.assertTrue(out.success, out.message)
        pulled_at = self.now()
        self.wait(lambda: self.speed() < AT_REST, 3.0, 'the chair stands')
        # The answer of the service and the truth at 50 Hz blur the moment by a tenth of a second.
        self.assertLess(self.now() - pulled_at, BUS_S + before / BRAKE + 0.25 + 0.1)
        self.assertTrue(client.wait_for_result(rospy.Duration(3.0)))
        self.assertEqual(client.get_state(), GoalStatus.ABORTED)
        self.assertIn('because', client.get_goal_status_text())

        self.wait(lambda: self.lines('is open'), 2.0 * OUT_S + 10.0, 'the adapter is open again')
        self.assertEqual(len(self.lines('is lost')), 1, self.lines('is lost'))
        for topic, kind in (
            ('/imu/data', Imu),
            ('/diff_drive_controller/odom', Odometry),
            ('/odometry/filtered', Odometry),
        ):
            rospy.wait_for_message(topic, kind, 5.0)
        stood = self.truth.pose.pose.position
        rospy.sleep(3.0)
        self.assertLess(
            abs(self.truth.pose.pose.position.x - stood.x) + abs(self.truth.pose.pose.position.y - stood.y), 0.005
        )

        # The way that nobody heard the wheels go is known again: the goal is a place, not a distance.
        client.send_goal(goal_at((stood.x + 0.8, 1.0, 0.0)))
        self.assertTrue(client.wait_for_result(rospy.Duration(20.0)))
        self.assertEqual(client.get_state(), GoalStatus.SUCCEEDED, client.get_goal_status_text())
        self.assertAlmostEqual(self.truth.pose.pose.position.x, stood.x + 0.8, delta=0.1)


if __name__ == '__main__':
    rospy.init_node('unplug_test')
    rostest.rosrun('sara_bringup', 'unplug', UnplugTest)
