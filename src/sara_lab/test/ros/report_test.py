#!/usr/bin/env python3
"""`report BAG` of a drive as sara.launch records it, and of a real chair's, which has no truth."""

import math
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rosbag
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_lab.experiments.drive_figures import turned
from sara_lab.ros.studies.bag_report import read_trace, write
from sara_lab.ros.studies.bag_track import read_track

T0, LONG_S, RATE, SLIP = 50.0, 20.0, 0.1, 1.27  # s, s, rad/s; the wheels turn so many times what the chair does
LATER_S = 3.0  # the IMU begins to speak


def put(bag, topic, message, t, yaw=0.0, x=0.0):
    message.header.stamp = rospy.Time.from_sec(t)
    pose = message.orientation if isinstance(message, Imu) else message.pose.pose.orientation
    pose.z, pose.w = math.sin(yaw / 2), math.cos(yaw / 2)
    if isinstance(message, Odometry):
        message.pose.pose.position.x, message.twist.twist.angular.z = x, RATE
    else:
        message.angular_velocity.z = RATE
    bag.write(topic, message, message.header.stamp)


def record(path, truth=True):
    """A chair that turns to the left where it stands, at (3, 0), by 115 deg; the wheels begin at (7, 0) of theirs."""
    with rosbag.Bag(str(path), 'w') as bag:
        for t in np.arange(0.0, LONG_S, 0.05):
            if truth:
                put(bag, '/ground_truth', Odometry(), T0 + t, RATE * t, 3.0)
            put(bag, '/odometry/filtered', Odometry(), T0 + t, RATE * t + 0.02, 3.0)
            put(bag, '/diff_drive_controller/odom', Odometry(), T0 + t, SLIP * RATE * t + 1.0, 7.0)
            if t > LATER_S:
                put(bag, '/imu/data', Imu(), T0 + t, RATE * t)
        goal = MoveBaseActionGoal()
        goal.goal_id.id, goal.goal_id.stamp = 'one', rospy.Time.from_sec(T0 + 1.0)
        goal.goal.target_pose.pose.position.x, goal.goal.target_pose.pose.orientation.w = 3.0, 1.0
        bag.write('/move_base/goal', goal, goal.goal_id.stamp)
        result = MoveBaseActionResult()
        result.header.stamp = rospy.Time.from_sec(T0 + 15.0)
        result.status.goal_id.id, result.status.status, result.status.text = 'one', GoalStatus.ABORTED, 'No way.'
        bag.write('/move_base/result', result, result.header.stamp)


class ReportTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.bag = self.folder / 'drive.bag'

    def test_what_is_drawn_is_what_was_recorded(self):
        record(self.bag)
        track, _ = read_track(self.bag)
        trace = read_trace(self.bag, track)
        np.testing.assert_allclose(trace['true'][:, 2], RATE * trace['t'], atol=1e-6)
        np.testing.assert_allclose(
            trace['wheels'][:, 2],
            SLIP * RATE * trace['t'] - 2 * math.pi * (SLIP * RATE * trace['t'] > math.pi),
            atol=1e-6,
        )
        np.testing.assert_allclose(trace['wheels'][:, :2] - (3.0, 0.0), 0.0, atol=1e-6)
        speaks = trace['t'] > LATER_S + 0.1
        np.testing.assert_allclose(trace['imu_rate'][speaks], RATE)
        self.assertTrue(np.isnan(trace['imu_rate'][trace['t'] < LATER_S]).all())
        np.testing.assert_allclose(turned(trace['imu_yaw'])[speaks], np.degrees(RATE * trace['t'][speaks]), atol=1e-4)
        np.testing.assert_allclose(trace['ends'], [15.0])

    def test_the_command_writes_the_report_beside_the_bag(self):
        record(self.bag)
        told = subprocess.run(
            ['rosrun', 'sara_lab', 'report', str(self.bag)], capture_output=True, text=True, check=True
        ).stdout
        self.assertIn('drive/report.md', told)
        self.assertEqual(
            {path.name for path in (self.folder / 'drive').iterdir()},
            {'report.md', 'paths.png', 'rates.png', 'angles.png'},
        )
        text = (self.folder / 'drive' / 'report.md').read_text()
        for part in ('Judged by the true pose', 'No way.', 'discomfort'):
            self.assertIn(part, text)

    def test_without_the_truth_it_is_judged_by_the_fused_pose(self):
        record(self.bag, truth=False)
        found = write(self.bag, self.folder / 'out')
        self.assertEqual(found.source, 'fused')
        self.assertIn('Judged by the fused pose', (self.folder / 'out' / 'report.md').read_text())
        self.assertTrue(np.isnan(read_trace(self.bag, read_track(self.bag)[0])['true']).all())

    def test_a_bag_without_a_drive_is_refused_by_a_sentence(self):
        with rosbag.Bag(str(self.bag), 'w'):
            pass
        told = subprocess.run(
            ['rosrun', 'sara_lab', 'report', str(self.bag)], capture_output=True, text=True, check=False
        )
        self.assertEqual(told.returncode, 1)
        self.assertIn('holds no drive', told.stderr)


if __name__ == '__main__':
    rospy.init_node('report_test')
    rostest.rosrun('sara_lab', 'report', ReportTest)
