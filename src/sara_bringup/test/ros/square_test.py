#!/usr/bin/env python3
"""The chair drives the thesis's square; judged by the true pose."""

import unittest

import rospy
import rostest

from sara_bringup.missions.drive import Drive
from sara_bringup.missions.mission import load_mission
from sara_bringup.missions.report import table, verdict
from sara_bringup.paths import config_file
from sara_bringup.ros.square_node import drive_mission


class SquareTest(unittest.TestCase):
    def test_every_corner_is_reached_and_the_fused_yaw_is_true(self):
        mission = load_mission(config_file('square.yaml'))
        drive = Drive('square', 0, mission.start)
        drive_mission(mission, drive)
        print(table(drive))
        self.assertEqual(rospy.get_param('/move_base/lost_topic'), '/lost_probability')
        self.assertEqual(verdict(drive, len(mission.goals)), [])


if __name__ == '__main__':
    rospy.init_node('square_test')
    rostest.rosrun('sara_bringup', 'square', SquareTest)
