#!/usr/bin/env python3
"""A recorded drive is judged as the drive itself: written into a bag as sara.launch records it, and read back by
`judge`.
"""

import json
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
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
from std_msgs.msg import String

from sara_lab.judge.judge import judge
from sara_lab.judge.judgement import Goal, Track
from sara_lab.ros.studies.bag_track import BagError, read_track

T0 = 100.0


def drive():
    """4 m from rest to rest in 16 s and a turn of 90 deg in 10 s, at 50 Hz."""
    t = np.arange(0.0, 16.0, 0.02)
    u = t / 16.0
    straight = np.column_stack([4.0 * (10 * u**3 - 15 * u**4 + 6 * u**5), 0 * u, 0 * u])
    turn = np.arange(0.0, 10.0, 0.02) / 10.0
    turned = np.column_stack([0 * turn + 4.0, 0 * turn, math.pi / 2 * (10 * turn**3 - 15 * turn**4 + 6 * turn**5)])
    still = np.tile(turned[-1], (100, 1))
    pose = np.vstack([straight, turned, still])
    return T0 + 0.02 * np.arange(len(pose)), pose


def fill(message, row):
    message.position.x, message.position.y = row[0], row[1]
    message.orientation.z, message.orientation.w = math.sin(row[2] / 2), math.cos(row[2] / 2)


def odometry(t, row):
    message = Odometry()
    message.header.stamp = rospy.Time.from_sec(t)
    fill(message.pose.pose, row)
    return message


def write(path, truth=True, goals=True, clock=0.0, received=0.0):
    """The drive as a bag; goals are stamped `clock` s and received `received` s after they were given."""
    t, pose = drive()
    with rosbag.Bag(str(path), 'w') as bag:

        def put(topic, message, at):
            bag.write(topic, message, rospy.Time.from_sec(at))

        for k, (at, row) in enumerate(zip(t, pose)):
            put('/odometry/filtered', odometry(at, row + (0.01, 0.0, 0.0)), at)
            if truth:
                put('/ground_truth', odometry(at, row), at)
            if k % 5 == 0 and at < T0 + 26.0:
                twist = Twist()
                twist.linear.x, twist.angular.z = 0.3, 0.1 if k % 250 < 125 else -0.1
                put('/cmd_vel/navigation', twist, at)
                put('/diff_drive_controller/cmd_vel', twist, at)
        for at, said in ((T0, 'goes slowly because people are nearby'), (T0 + 4.0, 'follows its commands')):
            put('/safety_gate/status', String(f'The chair {said}.'), at)
        put('/ground_truth' if truth else '/odometry/filtered', odometry(t[-1] + 0.02, (math.nan, 0.0, 0.0)), t[-1])
        for count, at in ((1, t[0]), (3, t[-1])):
            put(
                '/diagnostics',
                DiagnosticArray(status=[DiagnosticStatus(values=[KeyValue('contacts', str(count))])]),
                at,
            )
        plan = PathMessage(poses=[PoseStamped(), PoseStamped()])
        plan.header.stamp, plan.poses[1].pose.position.x = rospy.Time.from_sec(T0), 4.0
        for stamped in plan.poses:
            stamped.pose.orientation.w, stamped.pose.position.y = 1.0, 0.02
        put('/move_base/GridPlanner/plan', plan, T0)
        for name, end in (('one', 26.0), ('open', None)) if goals else ():
            goal = MoveBaseActionGoal()
            at = T0 if end else T0 + 27.0
            goal.goal_id.id, goal.goal_id.stamp = name, rospy.Time.from_sec(at + clock)
            fill(goal.goal.target_pose.pose, (4.0, 0.05, math.pi / 2))
            put('/move_base/goal', goal, at + received)
            if end:
                result = MoveBaseActionResult()
                result.header.stamp = rospy.Time.from_sec(T0 + end)
                result.status.goal_id.id, result.status.status, result.status.text = (
                    name,
                    GoalStatus.SUCCEEDED,
                    'Goal reached.',
                )
                put('/move_base/result', result, T0 + end + received)


class JudgeTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = Path(self.folder.name) / 'drive.bag'
        self.addCleanup(self.folder.cleanup)

    def test_a_bag_judges_as_the_drive_itself(self):
        write(self.path)
        t, pose = drive()
        here = judge(
            Track(t, pose, goals=(Goal((4.0, 0.05, math.pi / 2), T0, T0 + 26.0, True, 'Goal reached.', T0 + 27.0),))
        )
        track, dropped = read_track(self.path)
        found = judge(track)
        self.assertEqual((found.source, found.contacts, len(found.corners)), ('true', 2, 1))
        for name in ('seconds', 'length', 'acceleration_rms', 'jerk_tangential_rms', 'discomfort', 'reversals'):
            self.assertAlmostEqual(getattr(found, name), getattr(here, name), 4, name)
        self.assertAlmostEqual(found.corners[0].position, 0.05, 6)
        self.assertAlmostEqual(found.beyond_shortest, 0.0, 1)
        self.assertAlmostEqual(found.off_plan_p95, 0.02, 6)
        self.assertGreater(found.commanded_reversals_per_m, 1.0)
        self.assertEqual(sorted(dropped.values()), [1, 1])
        self.assertAlmostEqual(sum(found.split.values()), 26.0, 6)
        self.assertAlmostEqual(found.split['gate'], 4.0, 1)
        self.assertAlmostEqual(found.split['turning'], 10.0, delta=2.5)

    def test_goals_stamped_by_another_clock_count_from_when_they_were_received(self):
        write(self.path)
        plain, _ = read_track(self.path)
        write(self.path, clock=1.7e9)
        track, _ = read_track(self.path)
        self.assertEqual(track.goals, plain.goals)
        self.assertEqual(len(track.goals), 1)

    def test_goals_of_no_time_of_the_drive_are_refused(self):
        write(self.path, clock=1.7e9, received=1e6)
        with self.assertRaisesRegex(BagError, 'goals that ended'):
            read_track(self.path)
        told = subprocess.run(
            ['rosrun', 'sara_lab', 'judge', str(self.path)], capture_output=True, text=True, check=False
        )
        self.assertNotEqual(told.returncode, 0)
        self.assertIn('goals that ended', told.stderr)

    def test_without_the_truth_the_fused_pose_is_judged_and_it_says_so(self):
        write(self.path, truth=False, goals=False)
        track, _ = read_track(self.path)
        found = judge(track)
        self.assertEqual((track.source, found.contacts, found.corners), ('fused', None, ()))
        self.assertAlmostEqual(track.pose[0, 0], 0.01)

    def test_the_command_prints_a_table_or_json(self):
        write(self.path)
        told = subprocess.run(
            ['rosrun', 'sara_lab', 'judge', str(self.path), '--json'], capture_output=True, text=True, check=True
        )
        self.assertAlmostEqual(json.loads(told.stdout)['length'], 4.0, 3)
        self.assertIn('left out: 1 of goals', told.stderr)
        table = subprocess.run(
            ['rosrun', 'sara_lab', 'judge', str(self.path)], capture_output=True, text=True, check=True
        ).stdout
        self.assertIn('discomfort', table)

    def test_a_bag_without_a_drive_is_refused_by_a_sentence(self):
        with rosbag.Bag(str(self.path), 'w'):
            pass
        self.assertRaises(BagError, read_track, self.path)
        told = subprocess.run(
            ['rosrun', 'sara_lab', 'judge', str(self.path)], capture_output=True, text=True, check=False
        )
        self.assertEqual(told.returncode, 1)
        self.assertIn('holds no drive', told.stderr)


if __name__ == '__main__':
    rospy.init_node('judge_test')
    rostest.rosrun('sara_lab', 'judge', JudgeTest)
