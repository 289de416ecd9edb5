#!/usr/bin/env python3
"""Pages that fail while they drive: one zero, and nothing after it. How soon, `touch_faults` measures: here the machine
may be slow, so ages and delays have wide limits.
"""

import asyncio
import time
import unittest
from functools import partial

import rospy
import rostest
from geometry_msgs.msg import Twist

from sara_lab.fuzz.touch.verdict import Limits, Times, repeat
from sara_lab.ros.touch.faults import FAULTS, trial
from sara_lab.ros.touch.stand_in import PATIENCE_S, StandIn, url

SHORT = Times(freeze=2.0, hold=2.0)
WIDE = Limits(age=10.0, zero=10.0)
TWICE = 2


class TouchFaultsTest(unittest.TestCase):
    @staticmethod
    def trial(robot, fault, number):
        return asyncio.run(trial(url(), robot, fault, number, SHORT))

    def test_each_fault_ends_in_one_zero(self):
        robot = StandIn()
        self.addCleanup(robot.close)
        ear, end = rospy.Subscriber('/cmd_vel/touch', Twist), time.monotonic() + PATIENCE_S
        while not ear.get_num_connections():  # the stand-in's connection, too
            self.assertLess(time.monotonic(), end, 'the server is not heard')
            time.sleep(0.05)
        for fault in FAULTS:
            with self.subTest(fault):
                made = partial(self.trial, robot, fault)
                result = repeat(fault, made, TWICE, WIDE)
                self.assertEqual((len(result.trials), result.wrong), (TWICE, []))


if __name__ == '__main__':
    rospy.init_node('touch_faults_test')
    rostest.rosrun('sara_lab', 'touch_faults', TouchFaultsTest)
