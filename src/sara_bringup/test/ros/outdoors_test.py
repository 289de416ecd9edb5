#!/usr/bin/env python3
"""outdoors.launch, as a person starts it: a goal on the pavement by GPS, compass and wheels; multipath and an outage
are said.
"""

import math
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, NavSatFix

from canserial.calibration.calibration_file import Calibration, save
from canserial.calibration.iron import Iron
from canserial.dbc.bus import BusDescription
from sara_sim.chair import SimulatedChair
from sara_sim.world.world import World

PATIENCE_S = 400.0  # of wall time, for anything
GOAL = '14.0', '15.0', '0.0'
GPS = {'jump_interval': 8.0, 'jump_duration': 5.0, 'outage_interval': 30.0, 'outage_duration': 6.0}


def calibration():
    """What two turns would find of the simulated chair 0, without their errors."""
    magnetism = SimulatedChair(World.empty(), 0, bus=BusDescription.named('+compass')).magnetism
    east, north, up = magnetism.earth
    matrix = tuple(np.linalg.inv(magnetism.iron).ravel().tolist())
    iron = Iron(tuple(magnetism.hard_iron.tolist()), matrix, math.hypot(east, north), -float(up))
    return Calibration(**iron.fields())


class OutdoorsTest(unittest.TestCase):
    def setUp(self):
        folder = Path(tempfile.mkdtemp())
        save(folder / 'calibration.yaml', calibration())
        rospy.set_param('/simulator/gps', GPS)
        self.fixes, self.places, self.said, self.headings = [], [], [], []
        self.truth = self.fused = None
        rospy.Subscriber('/imu/heading', Imu, self.headings.append)
        rospy.Subscriber('/gps/fix', NavSatFix, self.fixes.append)
        rospy.Subscriber('/odometry/gps', Odometry, self.places.append)
        rospy.Subscriber('/rosout', Log, lambda message: self.said.append(message.msg))
        rospy.Subscriber('/ground_truth', Odometry, lambda message: setattr(self, 'truth', message))
        rospy.Subscriber('/odometry/filtered', Odometry, lambda message: setattr(self, 'fused', message))
        arguments = [f'calibration_file:={folder}/calibration.yaml', f'port:={folder}/can', f'gps_port:={folder}/gps']
        # read.py looks once a second of wall time whether a heading is waited for; it is for 1.9 s of the chair's.
        self.launch = subprocess.Popen(['roslaunch', 'sara_bringup', 'outdoors.launch', 'speed:=1.5', *arguments])

    def tearDown(self):
        self.launch.terminate()
        self.launch.wait(60)

    def wait(self, condition, what):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertLess(time.monotonic(), end, f'in vain: {what}')
            self.assertIsNone(self.launch.poll())
            time.sleep(0.05)

    def has_said(self, words):
        return any(words in sentence for sentence in self.said)

    def test_a_goal_on_the_pavement(self):
        self.wait(lambda: self.headings and self.fused and self.places, 'heading, pose and fixes')
        self.assertEqual(self.places[-1].header.frame_id, 'map')
        for words in ('no imu/heading yet', 'imu/heading has begun'):
            self.wait(lambda words=words: self.has_said(words), words)
        go = subprocess.run(['rosrun', 'sara_bringup', 'go', *GOAL], timeout=PATIENCE_S, check=False)
        self.assertEqual(go.returncode, 0)
        true, fused = self.truth.pose.pose.position, self.fused.pose.pose.position
        self.assertGreater(true.x, 12.5)
        # Whether so short a drive is fast for long enough to tell a course hangs on the machine.
        self.assertIn(['/gps/heading', 'sensor_msgs/Imu'], rospy.get_published_topics())
        self.assertLess(math.hypot(true.x - fused.x, true.y - fused.y), 1.5)
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        for target, source in (('map', 'odom'), ('odom', 'base_link'), ('base_link', 'gps')):
            self.wait(lambda ends=(target, source): buffer.can_transform(*ends, rospy.Time(0)), f'{target} -> {source}')
        for words in ('outliers are rejected', 'taken again, after', 'the receiver has no fix', 'has a fix again'):
            self.wait(lambda words=words: self.has_said(words), words)
        self.assertEqual({fix.status.status for fix in self.fixes}, {0, -1})


if __name__ == '__main__':
    rospy.init_node('outdoors_test', disable_rostime=True)
    rostest.rosrun('sara_bringup', 'outdoors', OutdoorsTest)
