#!/usr/bin/env python3
"""move_base and a made-up localization that says how probably the robot is lost."""

import math
import os
import sys
import unittest

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from std_msgs.msg import Float32

sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))
from fake_robot import FakeRobot, stamped  # noqa: E402


class LostTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot()
        cls.probability = 0.0
        cls.lost = rospy.Publisher('lost_probability', Float32, queue_size=1, latch=True)
        cls.timer = rospy.Timer(rospy.Duration(0.5), cls.say)
        cls.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        assert cls.client.wait_for_server(rospy.Duration(120.0)), 'no move_base action server'

    @classmethod
    def say(cls, _event=None):
        probability = cls.probability  # another thread sets it
        if probability is not None:
            cls.lost.publish(probability)

    def tell(self, probability):
        LostTest.probability = probability
        self.say()

    def setUp(self):
        self.robot.put(1.0, 1.0, 0.0)
        self.tell(0.0)
        rospy.sleep(0.5)

    def drive(self):
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(4.0, 1.0, 0.0)))
        self.until(lambda: self.robot.v > 0.2, 'the robot does not drive')

    def until(self, what, otherwise):
        end = rospy.Time.now() + rospy.Duration(15.0)
        while not what():
            self.assertLess(rospy.Time.now(), end, otherwise)
            rospy.sleep(0.05)

    def stands(self):
        return self.robot.command == (0.0, 0.0)

    def test_it_stands_while_lost_and_goes_on(self):
        self.drive()
        self.tell(0.9)
        self.until(self.stands, 'it drives on')
        rospy.sleep(2.0)
        self.assertTrue(self.stands())
        self.tell(0.1)
        self.assertTrue(self.client.wait_for_result(rospy.Duration(40.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED)

    def given_up(self, text):
        self.assertTrue(self.client.wait_for_result(rospy.Duration(30.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        self.assertIn(text, self.client.get_goal_status_text())
        self.assertTrue(self.stands())

    def test_a_goal_is_given_up_in_words(self):
        self.drive()
        self.tell(0.9)
        self.given_up('the robot is probably lost (0.90 on lost_probability), for lost_patience (6.0 s)')

    def test_silence_and_nonsense_are_no_licence_to_drive(self):
        for probability in (None, math.nan):
            self.setUp()
            self.drive()
            self.tell(probability)
            self.given_up('lost_probability has been silent for 3 s, for lost_patience (6.0 s)')


if __name__ == '__main__':
    rospy.init_node('lost_test')
    rostest.rosrun('sara_nav', 'lost', LostTest)
