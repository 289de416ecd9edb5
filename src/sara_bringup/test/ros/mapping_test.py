#!/usr/bin/env python3
"""A map is made while driving: a goal on what is known of it, slam_gmapping killed on the way, the map saved."""

import os
import pathlib
import signal
import sys
import time
import unittest

import actionlib
import numpy as np
import rosgraph
import rosnode
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Imu
from std_srvs.srv import Trigger

from sara_bringup.paths import share
from sara_bringup.ros.goals import goal_at
from sara_bringup.ros.processes import process_of
from sara_nav.maps.map_io import OCCUPIED, load_map

OUT = pathlib.Path(sys.argv[sys.argv.index('--out') + 1])
SLAM, WALL_S = '/slam_gmapping', 120.0


def pid_of(name):
    """The process of a node, None while it has none."""
    try:
        return process_of(name)
    except (OSError, rosgraph.MasterException):
        return None


def occupied(grid):
    """(n, 2) m: the middles of a map's occupied cells."""
    rows, columns = np.nonzero(grid.data == OCCUPIED)
    g = grid.geometry
    return np.stack((g.origin_x + g.resolution * (columns + 0.5), g.origin_y + g.resolution * (rows + 0.5)), 1)


class MappingTest(unittest.TestCase):
    def test_a_map_is_made_and_outlives_the_program(self):
        rospy.wait_for_message('/imu/data', Imu)
        rospy.wait_for_message('/map', OccupancyGrid)
        self.assertNotIn('/map_server', rosnode.get_node_names())
        self.buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(self.buffer)
        self.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        self.client.wait_for_server()
        rospy.sleep(2.0)
        self.reach((2.5, 1.0, 0.0))
        self.kill()
        self.reach((3.5, 1.0, 0.0))
        self.assertEqual(rospy.get_param('/places_file'), f'{OUT}.places.yaml')
        answer = rospy.ServiceProxy(f'{SLAM}/save', Trigger)()
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.message, f'{OUT}.yaml')
        made = load_map(f'{OUT}.yaml')
        true = load_map(str(share() / 'maps' / 'room.yaml'))
        off = [np.hypot(*(occupied(true) - place).T).min() for place in occupied(made)]
        self.assertGreater(len(off), 100)
        self.assertLess(np.percentile(off, 95), 0.09)

    def reach(self, pose):
        """Drive there by move_base; map -> odom -> base_link then say where the chair is."""
        self.client.send_goal(goal_at(pose))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(60.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED, self.client.get_goal_status_text())
        rospy.sleep(1.0)
        truth = rospy.wait_for_message('/ground_truth', Odometry).pose.pose.position
        said = self.buffer.lookup_transform(
            'map', 'base_link', rospy.Time(0), rospy.Duration(5.0)
        ).transform.translation
        self.assertAlmostEqual(said.x, truth.x, delta=0.08)
        self.assertAlmostEqual(said.y, truth.y, delta=0.08)
        self.assertEqual(len(self.broadcasters()), 1, 'odom -> base_link comes from two nodes')

    def broadcasters(self):
        """Who says where base_link is."""
        frames = self.buffer.all_frames_as_yaml().splitlines()
        start = frames.index('base_link: ')
        return [line for line in frames[start : start + 3] if "broadcaster: '/ekf_se'" in line]

    def kill(self):
        """SIGKILL; roslaunch starts it again, and it finds the chair on the map that it kept."""
        before = pid_of(SLAM)
        os.kill(before, signal.SIGKILL)
        end = time.monotonic() + WALL_S
        while pid_of(SLAM) in (None, before):
            self.assertLess(time.monotonic(), end, 'it does not come again')
            time.sleep(0.2)
        while True:
            stamp = self.buffer.get_latest_common_time('map', 'odom')
            if (rospy.Time.now() - stamp).to_sec() < 0.3:
                return
            self.assertLess(time.monotonic(), end, 'it does not find the chair')
            time.sleep(0.2)


if __name__ == '__main__':
    rospy.init_node('mapping_test')
    rostest.rosrun('sara_bringup', 'mapping', MappingTest)
