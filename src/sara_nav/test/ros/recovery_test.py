#!/usr/bin/env python3
"""Recovery on the wires: behaviours are announced, turn the robot, bring it back, ask for help, end with the goal; a
silent sensor stops it.
"""

import contextlib
import math
import os
import sys
import threading
import time
import unittest
from xmlrpc.client import ServerProxy

import actionlib
import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal, RecoveryStatus
from nav_msgs.msg import OccupancyGrid
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Range
from std_msgs.msg import Bool, String

sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))
from fake_robot import FakeRobot, stamped  # noqa: E402


def room(walled):
    """Return a map of 8 m x 8 m about (3, 3); ``walled``: a wall at x = 4 divides it."""
    data = np.zeros((160, 160), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    if walled:
        data[:, 100] = 100
    msg = OccupancyGrid(data=data.ravel().tolist())
    msg.header.frame_id, msg.header.stamp = 'map', rospy.Time.now()
    msg.info.width = msg.info.height = 160
    msg.info.resolution = 0.05
    msg.info.origin.position.x = msg.info.origin.position.y = -1.0
    msg.info.origin.orientation.w = 1.0
    return msg


class Sensor:
    """Says 20 times a second, of the robot's clock, that nothing is near, until it is told to fall silent."""

    def __init__(self):
        self.silent = False
        self.publisher = rospy.Publisher('/SDI_range', Range, queue_size=1)
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        while not rospy.is_shutdown():
            if not self.silent:
                msg = Range(
                    radiation_type=Range.ULTRASOUND,
                    field_of_view=1.0,
                    min_range=0.16,
                    max_range=2.5,
                    range=float('inf'),
                )
                msg.header.frame_id, msg.header.stamp = 'SDI_frame', rospy.Time.now()
                self.publisher.publish(msg)
            try:
                rospy.sleep(0.05)
            except rospy.ROSException:
                return


class RecoveryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot()
        cls.sensor = Sensor()
        cls.map = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
        cls.map.publish(room(walled=True))
        cls.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        assert cls.client.wait_for_server(rospy.Duration(60.0)), 'no move_base action server'
        cls.statuses, cls.log = [], []
        cls.subscribers = [
            rospy.Subscriber('move_base/recovery_status', RecoveryStatus, cls.statuses.append),
            rospy.Subscriber('/rosout', Log, lambda msg: cls.log.append(msg.msg)),
        ]

    def setUp(self):
        self.robot.put(1.5, 1.5, 0.0)
        self.sensor.silent = False
        self.map.publish(room(walled=True))
        rospy.sleep(1.0)
        del self.statuses[:], self.log[:]

    def go(self, x=6.0):
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(x, 1.5, 0.0)))

    def wait(self, what, text, seconds=40.0):
        """Wait until ``what()``."""
        end = rospy.Time.now() + rospy.Duration(seconds)
        while not what():
            self.assertLess(rospy.Time.now(), end, text)
            time.sleep(0.005)

    def test_all_behaviours_run_and_the_goal_ends_in_words(self):
        asked = []
        listener = rospy.Subscriber('/move_base/help', String, lambda msg: asked.append(msg.data))
        self.go()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(90.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        text = self.client.get_goal_status_text()
        self.assertIn('Even after executing recovery behaviors. No plan was found', text)
        self.assertEqual(
            [
                (s.current_recovery_number, s.total_number_of_recoveries, s.recovery_behavior_name)
                for s in self.statuses
            ],
            [(0, 4, 'clear'), (1, 4, 'turn'), (2, 4, 'back'), (3, 4, 'ask')],
        )
        self.assertLess(abs(self.statuses[0].pose_stamped.pose.position.x - 1.5), 0.05)
        self.assertEqual(self.statuses[0].pose_stamped.header.frame_id, 'map')
        self.assertLess(abs(self.robot.turned - 2.0 * math.pi), 0.3)
        self.assertLess(abs(self.robot.x - 1.2), 0.1)
        self.assertEqual(self.robot.command, (0.0, 0.0))
        self.wait(lambda: asked[-1:] == [''], 'it still asks')
        said = [text for text in asked if text]
        self.assertEqual(len(said), 1, said)
        self.assertTrue(said[0].startswith('Help, please: I cannot get on to (6.00, 1.50).'), said[0])
        listener.unregister()

    def test_help_is_latched_and_who_comes_and_clears_the_way_is_thanked_by_its_driving_on(self):
        self.go(5.0)
        self.wait(lambda: self.statuses and self.statuses[-1].recovery_behavior_name == 'ask', 'it does not ask', 90.0)
        help_ = rospy.wait_for_message('/move_base/help', String, 5.0).data
        self.assertTrue(help_.startswith('Help, please:'), help_)
        self.map.publish(room(walled=False))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(60.0)))
        self.assertEqual(
            (self.client.get_state(), self.client.get_goal_status_text()), (GoalStatus.SUCCEEDED, 'Goal reached.')
        )

    def test_one_that_is_stopped_to_let_somebody_pass_waits_and_one_that_is_stopped_else_recovers(self):
        self.map.publish(room(walled=False))
        wait = rospy.Publisher('/move_base/wait', Bool, queue_size=1)
        self.wait(wait.get_num_connections, 'nobody listens')
        self.go()
        self.wait(lambda: self.robot.v > 0.1, 'the robot does not drive')
        self.robot.stopped = True
        for _ in range(12):  # stuck_timeout is 3 s
            wait.publish(True)
            rospy.sleep(0.5)
        self.assertEqual(self.statuses, [])
        self.assertEqual(self.client.get_state(), GoalStatus.ACTIVE)
        self.wait(lambda: self.statuses, 'it does not recover')
        self.assertEqual(self.statuses[0].recovery_behavior_name, 'turn')  # clearing is passed over
        self.client.cancel_goal()
        self.client.wait_for_result(rospy.Duration(2.0))

    def test_cancelled_while_turning_it_stops_within_a_cycle(self):
        self.go()
        self.wait(lambda: self.robot.command[1] > 0.3, 'the robot does not turn')
        self.robot.cancel(self.client)
        self.assertTrue(self.robot.stands_within(0.2))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(20.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.PREEMPTED)
        rospy.sleep(0.5)
        self.assertEqual(self.robot.command, (0.0, 0.0))

    def test_a_way_that_opens_is_driven(self):
        self.go(5.0)
        self.wait(lambda: self.statuses, 'no recovery')
        self.map.publish(room(walled=False))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(60.0)))
        self.assertEqual(
            (self.client.get_state(), self.client.get_goal_status_text()), (GoalStatus.SUCCEEDED, 'Goal reached.')
        )

    def test_a_silent_sensor_stops_the_robot_and_is_named(self):
        self.go(3.0)
        self.wait(lambda: self.robot.v > 0.2, 'the robot does not drive')
        self.sensor.silent = True
        self.wait(lambda: self.robot.command == (0.0, 0.0), 'it drives on blind', 3.0)
        self.assertLess(self.robot.x, 2.8)
        self.wait(
            lambda: any('Sensor data is out of date' in text and '/SDI_range' in text for text in self.log),
            'nothing is said of the sensor',
        )
        self.sensor.silent = False
        self.assertTrue(self.client.wait_for_result(rospy.Duration(40.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED)

    def test_z_killed_on_the_way_its_last_word_is_zero(self):
        self.go(3.0)
        self.wait(lambda: self.robot.v > 0.2, 'the robot does not drive')
        with contextlib.suppress(ConnectionError):  # it may be gone before it has answered
            ServerProxy(rospy.get_master().lookupNode('/move_base')[2]).shutdown('/recovery_test', 'a test')
        self.assertTrue(self.robot.stands_within(0.5))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(5.0)))
        self.assertEqual(self.client.get_goal_status_text(), 'Aborting on the goal because the node has been killed')
        rospy.sleep(0.5)
        self.assertEqual(self.robot.command, (0.0, 0.0))


if __name__ == '__main__':
    rospy.init_node('recovery_test')
    rostest.rosrun('sara_nav', 'recovery', RecoveryTest)
