#!/usr/bin/env python3
"""nmea_serial_driver at a pseudo-terminal: its topics, and a port that goes and comes again."""

import os
import subprocess
import tempfile
import time
import tty
import unittest
from pathlib import Path

import rospy
import rostest
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import NavSatFix, TimeReference

from nmea_navsat_driver.sentences import framed

EPOCH = b''.join(
    map(
        framed,
        (
            'GPRMC,120000.40,A,4030.600000,N,00321.000000,W,1.9438445,90.0,010126,,,A',
            'GPGGA,120000.40,4030.600000,N,00321.000000,W,1,09,1.2,588.0,M,51.5,M,,',
            'GPGST,120000.40,,,,,1.5,1.2,3.0',
        ),
    )
)


class Port:
    """A receiver at the end of a link."""

    def __init__(self, path):
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(self.slave))

    def close(self):
        os.close(self.master)
        os.close(self.slave)


class DriverTest(unittest.TestCase):
    def setUp(self):
        self.path = Path(tempfile.mkdtemp()) / 'gps'
        self.port = Port(self.path)
        self.heard = {'fix': [], 'vel': [], 'time_reference': []}
        for topic, kind in (('fix', NavSatFix), ('vel', TwistStamped), ('time_reference', TimeReference)):
            rospy.Subscriber(topic, kind, self.heard[topic].append)
        rospy.set_param('/tf_prefix', '/robot_1')
        command = ['rosrun', 'nmea_navsat_driver', 'nmea_serial_driver', f'_port:={self.path}', '_frame_id:=antenna']
        self.driver = subprocess.Popen(command)

    def tearDown(self):
        self.driver.terminate()
        self.assertEqual(self.driver.wait(15), 0)

    def _until_heard(self, count):
        end = time.monotonic() + 25.0
        while min(map(len, self.heard.values())) < count:
            self.assertLess(time.monotonic(), end, self.heard)
            os.write(self.port.master, EPOCH)
            time.sleep(0.1)

    def test_topics_and_a_port_that_comes_again(self):
        self._until_heard(3)
        fix, velocity = self.heard['fix'][-1], self.heard['vel'][-1]
        self.assertEqual((fix.header.frame_id, velocity.header.frame_id), ('robot_1/antenna',) * 2)
        self.assertAlmostEqual(fix.latitude, 40.51, 7)
        self.assertAlmostEqual(fix.position_covariance[4], 2.25)
        self.assertAlmostEqual(velocity.twist.linear.x, 1.0, 5)
        self.assertGreater(fix.header.stamp.to_sec(), 0.0)
        self.port.close()
        self.port = Port(self.path)
        self._until_heard(len(self.heard['fix']) + 5)


if __name__ == '__main__':
    rospy.init_node('driver_test')
    rostest.rosrun('nmea_navsat_driver', 'driver', DriverTest)
