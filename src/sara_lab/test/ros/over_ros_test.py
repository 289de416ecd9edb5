#!/usr/bin/env python3
"""A course of E7 to E10's kind over ROS comes to what it comes to in lockstep; one that cannot be launched is refused
by a sentence, and nothing is left behind.
"""

import dataclasses
import os
import subprocess
import sys
import time
import unittest
from pathlib import Path

import numpy as np
import rosgraph
import rospy
import rostest

from canserial.dbc.bus import BusDescription
from sara_bringup.ros.masters import environment
from sara_bringup.ros.own_master import running
from sara_lab.experiments import agreement, drives
from sara_lab.experiments.courses import BOTH, LONG, OURS, VX, Course, SetUp
from sara_lab.experiments.sensor_experiments import AtRest
from sara_lab.ros.experiments.bench_over_ros import heard
from sara_lab.ros.experiments.course_over_ros import OverRosError, course_over_ros

TOLD = Course((1.0, 1.0, 90.0), ((1.0, 1.5, 90.0),), (10.0, 0.0, 0.0))  # half a metre ahead
CHAIR = 1


def children():
    """Command lines of this process's children and theirs, but for those that have ended."""
    parents = {}
    for entry in Path('/proc').iterdir():
        if entry.name.isdigit():
            try:
                state, parent = (entry / 'stat').read_text().rsplit(')', 1)[1].split()[:2]
                if state != 'Z':
                    parents[int(entry.name)] = int(parent)
            except OSError:
                pass  # it has ended
    found = {os.getpid()}
    for _ in parents:
        found |= {pid for pid, parent in parents.items() if parent in found}
    return found - {os.getpid()}


class OverRosTest(unittest.TestCase):
    def test_a_course_over_ros_is_the_course_in_lockstep(self):
        setup = SetUp(LONG, VX, posed=BOTH)
        ros, lockstep = (function(CHAIR, TOLD, setup) for function in (course_over_ros, drives.course_driven))
        rospy.loginfo(
            'over ROS: %s; in lockstep: %s',
            *(
                {figure.name: value for figure, value in agreement.of_drive(result).items()}
                for result in (ros, lockstep)
            ),
        )
        self.assertEqual(set(ros), set(lockstep))
        self.assertEqual(ros['true']['reached'], 1, ros['texts'])
        self.assertEqual(ros['contacts'], 0)
        self.assertGreaterEqual(ros['clicks'], 1)
        self.assertLess(abs(ros['true']['length'] - lockstep['true']['length']), 0.12)
        self.assertLess(abs(ros['true']['position'][0] - lockstep['true']['position'][0]), 0.12)
        self.assertLess(abs(ros['true']['yaw'][0] - lockstep['true']['yaw'][0]), 5.0)
        self.assertLess(ros['fused_yaw_error'], 3.0)
        self.assertEqual(children(), set())

    def test_the_chips_over_ros_are_the_chips_in_lockstep(self):
        bus = BusDescription.default()
        ros, lockstep = AtRest.of(bus.decode(frame) for frame in heard('after', CHAIR, 4.0)), AtRest.record(CHAIR, True)
        self.assertGreater(len(ros.gyro), 0.8 * len(lockstep.gyro))
        for one, other in ((ros.gyro, lockstep.gyro), (ros.accel, lockstep.accel)):
            np.testing.assert_allclose(
                one.mean(axis=0), other.mean(axis=0), atol=6.0 * other.std(axis=0).max() / len(ros.gyro) ** 0.5
            )
            np.testing.assert_allclose(one.std(axis=0), other.std(axis=0), rtol=0.4)
        self.assertEqual(children(), set())

    def test_a_node_waits_for_the_launch_s_parameters_not_for_the_master_alone(self):
        env = environment()
        port = env['ROS_MASTER_URI'].rsplit(':', 1)[1]
        asks = [
            sys.executable,
            '-c',
            "from sara_bringup.ros import goals; goals.wait_for_launch(60.0); goals.say('ready')",
        ]
        with (
            running('rosmaster', '--core', '-p', port, env=env) as master,
            subprocess.Popen(asks, env=env, stdout=subprocess.PIPE, text=True) as node,
        ):
            there, end = rosgraph.Master('/over_ros_test', env['ROS_MASTER_URI']), time.monotonic() + 60.0
            while not there.is_online() and time.monotonic() < end:
                time.sleep(0.1)
            with self.assertRaises(subprocess.TimeoutExpired):
                node.wait(4.0)
            there.setParam('/use_sim_time', True)
            self.assertEqual(node.communicate(timeout=60.0)[0], 'ready\n')
            self.assertEqual(node.returncode, 0)
            master.terminate()  # it does not mind an interrupt
        self.assertEqual(children(), set())

    def test_what_cannot_be_launched_is_refused_by_a_sentence(self):
        with self.assertRaisesRegex(OverRosError, 'nowhere.yaml'):
            course_over_ros(CHAIR, dataclasses.replace(TOLD, map='nowhere'), SetUp(OURS, VX))
        self.assertEqual(children(), set())


if __name__ == '__main__':
    rospy.init_node('over_ros_test')
    rostest.rosrun('sara_bringup', 'over_ros', OverRosTest)
