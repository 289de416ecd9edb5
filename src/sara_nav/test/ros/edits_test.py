#!/usr/bin/env python3
"""What is drawn over a map: map_server shows it, and move_base keeps out of where it is not to drive, and is slow
where it is to be.
"""

import os
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

import actionlib
import numpy as np
import rospkg
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap
from std_srvs.srv import Trigger

from sara_nav.maps import edits
from sara_nav.maps.edits import CLEARED, KEEP_OUT, SLOW, WALL, Edit
from sara_nav.maps.map_io import load_map

sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))
from fake_robot import FakeRobot, stamped  # noqa: E402

ROOM = Path(rospkg.RosPack().get_path('sara_nav')) / 'test' / 'data' / 'room.yaml'
PLACE = Edit(KEEP_OUT, (2.2, 0.0), (2.8, 1.8))
"""Between the start, (1, 1), and the goal, (4, 1)."""


def ask(name, kind, *arguments):
    rospy.wait_for_service(name, 30.0)
    return rospy.ServiceProxy(name, kind)(*arguments)


class EditsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot()
        cls.masks = []
        cls.subscriber = rospy.Subscriber('keepout_filter_mask', OccupancyGrid, cls.masks.append)
        cls.folder = tempfile.TemporaryDirectory()
        for name in ('room.yaml', 'room.pgm'):
            shutil.copy(ROOM.with_name(name), cls.folder.name)
        cls.map = Path(cls.folder.name) / 'room.yaml'
        ask('change_map', LoadMap, str(cls.map))
        cls.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        assert cls.client.wait_for_server(rospy.Duration(120.0)), 'no move_base action server'

    def setUp(self):
        self.robot.put(1.0, 1.0, 0.0)
        self.draw()
        rospy.sleep(0.5)

    def draw(self, *drawn):
        """Draw these edits and no others; wait until the costmaps can have them."""
        edits.write(edits.beside(self.map), drawn)
        answer = ask('reload_edits', Trigger)
        self.assertEqual((answer.success, answer.message), (True, str(edits.beside(self.map))))
        rospy.sleep(1.5)

    def go(self, x, y):
        """Drive; returns (the action's state, its text, where the robot was and how fast: x, y, v (n, 3))."""
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(x, y, 0.0)))
        way, end = [], rospy.Time.now() + rospy.Duration(90.0)
        while not self.client.wait_for_result(rospy.Duration(0.1)) and rospy.Time.now() < end:
            way.append((self.robot.x, self.robot.y, self.robot.v))
        return self.client.get_state(), self.client.get_goal_status_text(), np.array(way).reshape(-1, 3)

    def test_it_drives_round_a_keep_out_place_that_the_map_does_not_show(self):
        self.draw(PLACE)
        self.assertTrue((np.array(ask('static_map', GetMap).map.data) == load_map(self.map).data.ravel()).all())
        state, text, way = self.go(4.0, 1.0)
        self.assertEqual(state, GoalStatus.SUCCEEDED, text)
        inside = (abs(way[:, 0] - 2.5) < 0.3) & (way[:, 1] < 1.8)
        self.assertFalse(inside.any(), way[inside])
        self.assertGreater(way[:, 1].max(), 2.0)

    def test_it_plans_anew_when_a_place_is_drawn_on_its_way(self):
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(4.0, 1.0, 0.0)))
        end = rospy.Time.now() + rospy.Duration(20.0)
        while self.robot.v < 0.1 and rospy.Time.now() < end:
            rospy.sleep(0.05)
        with self.robot.clock_waits():  # it would be in the place before a busy machine has drawn it
            edits.write(edits.beside(self.map), [PLACE])
            self.assertTrue(ask('reload_edits', Trigger).success)
        highest = 0.0
        while not self.client.wait_for_result(rospy.Duration(0.1)) and rospy.Time.now() < end + rospy.Duration(90.0):
            highest = max(highest, self.robot.y)
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED, self.client.get_goal_status_text())
        self.assertGreater(highest, 2.0)

    def test_a_goal_in_a_keep_out_place_is_refused_in_words(self):
        self.draw(PLACE)
        state, text, _ = self.go(2.5, 1.0)
        self.assertEqual(state, GoalStatus.ABORTED)
        self.assertIn('Goal refused: (2.50, 1.00) is in a keep-out place', text)

    def test_a_robot_that_stands_in_one_gets_out(self):
        self.robot.put(2.5, 1.0, 0.0)
        self.draw(PLACE)
        state, text, _ = self.go(4.0, 1.0)
        self.assertEqual(state, GoalStatus.SUCCEEDED, text)
        state, text, way = self.go(1.0, 1.0)  # and not in again
        self.assertEqual(state, GoalStatus.SUCCEEDED, text)
        self.assertFalse(((abs(way[:, 0] - 2.5) < 0.3) & (way[:, 1] < 1.8)).any())

    def test_a_place_that_is_taken_back_is_open_again(self):
        self.draw(PLACE)
        self.draw()
        self.assertFalse(np.array(self.masks[-1].data).any())
        state, text, way = self.go(4.0, 1.0)
        self.assertEqual(state, GoalStatus.SUCCEEDED, text)
        self.assertLess(way[:, 1].max(), 1.8)

    def test_it_is_slow_where_it_is_to_be(self):
        for drawn, least, most in (((Edit(SLOW, (2.4, 0.0), (2.6, 2.0)),), 0.2, 0.36), ((), 0.45, 0.8)):
            self.robot.put(1.0, 1.0, 0.0)
            self.draw(*drawn)
            state, text, way = self.go(4.0, 1.0)
            self.assertEqual(state, GoalStatus.SUCCEEDED, text)
            speeds = way[abs(way[:, 0] - 2.5) < 0.5, 2]
            self.assertTrue(least < speeds.max() <= most, speeds)

    def test_the_map_shows_what_is_erased_and_closed_at_once(self):
        plain = load_map(self.map)
        drawn = (Edit(WALL, (2.0, 1.0), (2.0, 3.0)), Edit(CLEARED, (-1.0, -1.0), (0.0, 0.0)))
        self.draw(*drawn)
        wanted = edits.drawn(plain, drawn).data.ravel()
        self.assertTrue((wanted != plain.data.ravel()).any())
        self.assertTrue((np.array(rospy.wait_for_message('map', OccupancyGrid, 10.0).data) == wanted).all())
        self.draw()
        data = rospy.wait_for_message('map', OccupancyGrid, 10.0).data
        self.assertTrue((np.array(data) == plain.data.ravel()).all())

    def test_a_faulty_file_changes_nothing(self):
        self.draw(PLACE)
        count = len(self.masks)
        edits.beside(self.map).write_text('edits:\n- lava: [[0, 0], [1, 1]]\n')
        answer = ask('reload_edits', Trigger)
        self.assertEqual((answer.success, "'lava' is no kind of edit" in answer.message), (False, True), answer)
        before = ask('static_map', GetMap).map.header.stamp
        self.assertNotEqual(ask('change_map', LoadMap, str(self.map)).result, 0)
        self.assertEqual(ask('static_map', GetMap).map.header.stamp, before)
        self.assertEqual(len(self.masks), count)
        self.assertIn('keep-out place', self.go(2.5, 1.0)[1])


if __name__ == '__main__':
    rospy.init_node('edits_test')
    rostest.rosrun('sara_nav', 'edits', EditsTest)
