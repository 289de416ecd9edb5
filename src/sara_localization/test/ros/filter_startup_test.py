#!/usr/bin/env python3
"""A filter that cannot start or run says why, in sentences with the remedy."""

import subprocess
import sys
import time
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock, Log


class FilterStartupTest(unittest.TestCase):
    def test_simulated_time_that_nobody_gives_is_told(self):
        said = []
        rospy.Subscriber('/rosout', Log, lambda log: said.append(log.msg))
        wanted = ('use_sim_time is true, but there is no time on /clock',)
        end = time.monotonic() + 20.0
        while time.monotonic() < end and not all(any(words in line for line in said) for words in wanted):
            time.sleep(0.05)
        for words in wanted:
            self.assertTrue([line for line in said if words in line], said)
        self.what_came_before_the_time_and_is_dated_an_hour_ahead_shuts_out_nothing()
        self.cycles_go_on_when_time_comes_and_when_it_jumps_back()

    def what_came_before_the_time_and_is_dated_an_hour_ahead_shuts_out_nothing(self):
        speeds, wheels = [], rospy.Publisher('/diff_drive_controller/odom', Odometry, queue_size=10)
        clock = rospy.Publisher('/clock', Clock, queue_size=1)
        rospy.Subscriber('odometry/filtered', Odometry, lambda told: speeds.append(told.twist.twist.linear.x))
        odometry, end = Odometry(), time.monotonic() + 20.0
        odometry.header.frame_id, odometry.child_frame_id = 'odom', 'base_link'
        odometry.twist.twist.linear.x, odometry.twist.covariance[0] = 0.5, 1e-3
        while not (wheels.get_num_connections() and clock.get_num_connections()) and time.monotonic() < end:
            time.sleep(0.05)
        odometry.header.stamp = rospy.Time.from_sec(3700.0)
        wheels.publish(odometry)
        time.sleep(0.5)  # nobody tells that it has come
        seconds = 100.0
        while not (speeds and abs(speeds[-1] - 0.5) < 0.05) and time.monotonic() < end:
            seconds += 0.02
            clock.publish(Clock(rospy.Time.from_sec(seconds)))
            odometry.header.stamp = rospy.Time.from_sec(seconds)
            wheels.publish(odometry)
            time.sleep(0.01)
        self.assertLess(time.monotonic(), end, f'the wheels are not heard: {speeds[-5:]}')

    def cycles_go_on_when_time_comes_and_when_it_jumps_back(self):
        told = []
        rospy.Subscriber('/diagnostics', DiagnosticArray, lambda array: told.append(array.header.stamp.to_sec()))
        clock = rospy.Publisher('/clock', Clock, queue_size=1)
        for begin in (100.0, 50.0):
            del told[:]
            seconds, end = begin, time.monotonic() + 20.0
            # A report from before the jump may come late.
            while sum(begin - 0.1 <= stamp <= seconds for stamp in told) < 3 and time.monotonic() < end:
                seconds += 0.02
                clock.publish(Clock(rospy.Time.from_sec(seconds)))
                time.sleep(0.005)
            self.assertLess(time.monotonic(), end, f'no cycles after {begin:g} s: {told}')

    def test_parameters_that_cannot_be_used_end_the_node_with_a_sentence_each(self):
        for kind in ('ekf', 'ukf'):
            run = subprocess.run(
                [
                    'rosrun',
                    'sara_localization',
                    kind + '_localization_node',
                    '__name:=refused_' + kind,
                    '_frequency:=-1',
                    '_odom0:=odom',
                    '_odom0_config:=[true, false]',
                    '_world_frame:=earth',
                    '_backend:=fortran',
                ],
                capture_output=True,
                text=True,
                timeout=30,
            )
            self.assertEqual(run.returncode, 1)
            told = run.stdout + run.stderr
            for words in (
                'frequency is -1, allowed are numbers above 0',
                'allowed is a list of 15',
                'world_frame is earth',
                "backend is 'fortran', allowed are compiled, filterpy",
            ):
                self.assertIn(words, told)
            self.assertNotIn('Traceback', told)


if __name__ == '__main__':
    rospy.init_node('filter_startup_test', disable_rostime=True)
    rostest.rosrun('sara_localization', 'filter_startup', FilterStartupTest, sys.argv)
