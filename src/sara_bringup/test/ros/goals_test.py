#!/usr/bin/env python3
"""go and patrol with a move_base that is started anew between two goals."""

import threading
import time
import unittest
from unittest import mock

import actionlib
import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from move_base_msgs.msg import MoveBaseAction
from tf2_ros import StaticTransformBroadcaster

from sara_bringup.ros import goals
from sara_nav.maps.places import Place

SOFA = Place('sofa', 1.0, 2.0, 0.0)


class MoveBase(actionlib.ActionServer):
    """Reaches each goal at once, or never hears of it: a client's first word to a node that was started anew may go to
    the old one.
    """

    def __init__(self):
        super().__init__('move_base', MoveBaseAction, self.reach, self.cancel, auto_start=False)
        self.hears = self.reaches = True
        self.cancelled = False

    def internal_goal_callback(self, goal):
        if self.hears:
            super().internal_goal_callback(goal)

    def reach(self, handle):
        handle.set_accepted()
        if self.reaches:
            handle.set_succeeded(text='Goal reached.')

    def cancel(self, handle):
        self.cancelled = True
        handle.set_canceled(text='Goal cancelled.')


class GoalsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.tf = StaticTransformBroadcaster()
        cls.stand(0.0)
        cls.move_base = MoveBase()
        cls.move_base.start()
        cls.driver = goals.Driver(10.0)

    @classmethod
    def stand(cls, x):
        place = TransformStamped(child_frame_id='base_link')
        place.header.frame_id, place.header.stamp = 'map', rospy.Time.now()
        place.transform.translation.x, place.transform.rotation.w = x, 1.0
        cls.tf.sendTransform(place)

    def test_a_goal_waits_until_move_base_is_there_again(self):
        self.assertEqual(self.driver.go(SOFA), (True, 'Goal reached.'))
        self.move_base.stop()
        goals.until(lambda: not self.driver._client.wait_for_server(rospy.Duration(0.05)), "move_base's end", 20.0)
        threading.Timer(1.0, self.move_base.start).start()
        self.assertEqual(self.driver.go(SOFA), (True, 'Goal reached.'))

    def test_a_goal_that_move_base_did_not_hear_of_ends_in_words(self):
        self.move_base.hears = False
        began = time.monotonic()
        self.assertEqual(self.driver.go(SOFA), (False, 'move_base has not taken the goal within 3 s'))
        self.assertLess(time.monotonic() - began, 6.0)
        self.move_base.hears = True

    def test_a_goal_whose_words_nobody_can_read_any_more_is_cancelled(self):
        self.move_base.reaches = self.move_base.cancelled = False
        said = []

        def say(text):
            said.append(text)
            if len(said) > 1:
                raise BrokenPipeError

        with mock.patch.object(goals, 'say', say), self.assertRaises(BrokenPipeError):
            self.driver.go(SOFA)
        self.assertTrue(self.move_base.cancelled)
        self.move_base.reaches = True

    def test_somebody_takes_over_in_a_pause(self):
        self.driver.go(SOFA)
        self.driver.pause(0.5)
        self.assertFalse(self.driver.taken)
        threading.Timer(0.2, self.stand, (1.0,)).start()
        self.driver.pause(3.0)
        self.assertTrue(self.driver.taken)
        self.move_base.reaches = False
        other = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        other.wait_for_server()
        threading.Timer(0.2, other.send_goal, (goals.goal_at((1.0, 2.0, 0.0)),)).start()
        began = time.monotonic()
        self.driver.pause(20.0)
        self.assertTrue(self.driver.taken)
        self.assertLess(time.monotonic() - began, 15.0)
        other.cancel_goal()
        self.move_base.reaches = True
        self.stand(0.0)


if __name__ == '__main__':
    rospy.init_node('goals_test')
    rostest.rosrun('sara_bringup', 'goals', GoalsTest)
