#!/usr/bin/env python3
"""go and patrol with a move_base that is started anew between two goals."""

import threading
import time
import unittest

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
        super().__init__('move_base', MoveBaseAction, self.reach, auto_start=False)
        self.hears = True

    def internal_goal_callback(self, goal):
        if self.hears:
            super().internal_goal_callback(goal)

    def reach(self, handle):
        handle.set_accepted()
        handle.set_succeeded(text='Goal reached.')


class GoalsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        place = TransformStamped(child_frame_id='base_link')
        place.header.frame_id, place.header.stamp, place.transform.rotation.w = 'map', rospy.Time.now(), 1.0
        cls.tf = StaticTransformBroadcaster()
        cls.tf.sendTransform(place)
        cls.move_base = MoveBase()
        cls.move_base.start()
        cls.driver = goals.Driver(10.0)

    def test_a_goal_waits_until_move_base_is_there_again(self):
        self.assertEqual(self.driver.go(SOFA), (True, 'Goal reached.'))
        self.move_base.stop()
        time.sleep(0.5)  # the client sees its end
        threading.Timer(1.0, self.move_base.start).start()
        self.assertEqual(self.driver.go(SOFA), (True, 'Goal reached.'))

    def test_a_goal_that_move_base_did_not_hear_of_ends_in_words(self):
        self.move_base.hears = False
        began = time.monotonic()
        self.assertEqual(self.driver.go(SOFA), (False, 'move_base has not taken the goal within 3 s'))
        self.assertLess(time.monotonic() - began, 6.0)
        self.move_base.hears = True


if __name__ == '__main__':
    rospy.init_node('goals_test')
    rostest.rosrun('sara_bringup', 'goals', GoalsTest)
