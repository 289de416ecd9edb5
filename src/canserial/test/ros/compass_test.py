#!/usr/bin/env python3
"""The compass over ROS: imu/mag, calibrate_compass with two turns on the spot, the file, and then imu/heading."""

import math
import os
import subprocess
import sys
import threading
import time
import unittest

# This test is installed beside canserial.py, which must not be taken for the package.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]

import rospy  # noqa: E402
import rostest  # noqa: E402
import yaml  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import Imu, MagneticField  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from canserial.dbc.bus import BusDescription  # noqa: E402
from canserial.msg import CAN  # noqa: E402
from canserial.ros.conversions import frame_to_msg, yaw_of  # noqa: E402
from sara_common.platforms import chosen  # noqa: E402

BUS = BusDescription.named('+compass')
HORIZONTAL, DOWN = 25.72, 37.12  # uT, of the place below in 2026
GAIN = chosen().parameters('read')['default_gain']
HARD_IRON = (30.0, -20.0, 10.0)
FACING = math.radians(20.0)
PATIENCE = 60.0


class Chair:
    """Turns on the spot, 20 frames a second of a clock that it makes; each field waits until the reader has said it."""

    def __init__(self):
        self.clock = rospy.Publisher('/clock', Clock, queue_size=10)
        self.canrx = rospy.Publisher('/canrx', CAN, queue_size=1000)
        self.fields, self.headings = [], []
        magnetic = rospy.Subscriber('imu/mag', MagneticField, self.fields.append, tcp_nodelay=True)
        rospy.Subscriber('imu/heading', Imu, self.headings.append, tcp_nodelay=True)
        self.time, self.yaw, self.tick = 1000.0, FACING, 0
        rospy.wait_for_service('/reader/calibrate', 30.0)
        links = self.canrx, self.clock, magnetic
        until(lambda: all(link.get_num_connections() for link in links))  # what is sent before is lost
        until(self._is_heard)  # and a while longer, for the other ends of the links come later

    def _is_heard(self):
        self.send('COMPASS', mx=0.0, my=0.0, mz=0.0)
        time.sleep(0.05)
        return bool(self.fields)

    def send(self, name, **signals):
        self.canrx.publish(frame_to_msg(BUS.encode(name, self.time, **signals)))

    def go(self, seconds, rate=0.0):
        """rate: rad/s."""
        for _ in range(round(20 * seconds)):
            self.tick += 1
            self.time += 0.05
            self.yaw += 0.05 * rate
            self.clock.publish(Clock(clock=rospy.Time.from_sec(self.time)))
            noise = 0.01 * (self.tick % 3 - 1)
            self.send(
                'RANGE_ACCEL', **dict.fromkeys(BUS.ranges['RANGE_ACCEL'], 1.0), az=9.81 + noise, ay=noise, ax=-noise
            )
            self.send('COMPLEMENTARY', rx=noise, ry=-noise, rz=noise)
            self.send('IMPACT_GYRO', alarma=0, gz=math.degrees(rate) / GAIN + noise, gy=noise, gx=-noise)
            if self.tick % 2:
                angle = math.pi / 2 - self.yaw
                x, y = HORIZONTAL * math.cos(angle) + noise, HORIZONTAL * math.sin(angle) - noise
                count = len(self.fields)
                field = dict(zip(('mx', 'my', 'mz'), (a + b for a, b in zip((x, y, -DOWN), HARD_IRON))))
                self.send('COMPASS', **field)
                until(lambda count=count: len(self.fields) > count)

    def heading(self):
        """That of now: it comes by another connection than the fields that `go` waits for."""
        until(lambda: self.headings and self.headings[-1].header.stamp.to_sec() > self.time - 0.025)
        return self.headings[-1]


def until(condition):
    """Wait, in wall time; fails with the test."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f'not within {PATIENCE:g} s')
        time.sleep(0.001)


class CompassTest(unittest.TestCase):
    """In one chair, in this order."""

    def test_from_raw_fields_to_a_heading(self):
        chair, file = Chair(), rospy.get_param('~file')
        self.addCleanup(lambda: os.path.exists(file) and os.unlink(file))
        chair.go(3.0)
        raw = chair.fields[-1]
        self.assertEqual(raw.header.frame_id, 'base_link')
        self.assertAlmostEqual(1e6 * raw.magnetic_field.z, HARD_IRON[2] - DOWN, delta=0.1)
        self.assertEqual(raw.magnetic_field_covariance[0], 0.0)
        self.assertEqual(chair.headings, [])
        refused = rospy.ServiceProxy('/reader/reload_compass', Trigger)()
        self.assertFalse(refused.success)
        self.assertIn('there is no calibration file', refused.message)

        output = self.calibrate(chair)
        self.assertIn('hard iron 30.0, -20.0', output)
        self.assertIn('/reader/reload_compass: the compass is calibrated', output)
        with open(file, encoding='utf-8') as stream:
            kept = yaml.safe_load(stream)
        self.assertAlmostEqual(kept['compass_offset'][0], HARD_IRON[0], delta=0.2)
        self.assertLess(kept['compass_yaw_sigma'], 1.0)

        chair.go(4.0)
        heading = chair.heading()
        off = math.remainder(yaw_of(heading.orientation) - chair.yaw, math.tau)
        self.assertLess(abs(math.degrees(off)), 1.0)
        self.assertLess(math.degrees(math.sqrt(heading.orientation_covariance[8])), 3.0)
        self.assertEqual(heading.header.frame_id, 'base_link')
        self.assertAlmostEqual(1e6 * chair.fields[-1].magnetic_field.z, -DOWN, delta=0.2)
        self.assertGreater(chair.fields[-1].magnetic_field_covariance[0], 0.0)
        chair.go(5.0, rate=0.3)
        off = math.remainder(yaw_of(chair.heading().orientation) - chair.yaw, math.tau)
        self.assertLess(abs(math.degrees(off)), 1.5)

    def calibrate(self, chair):
        """What calibrate_compass says while the chair turns once to each side."""
        listeners = chair.canrx.get_num_connections()
        command = ['rosrun', 'canserial', 'calibrate_compass', '--place', '40.51', '-3.35', '--date', '2026-01-01']
        command += ['--facing', '20', '--calibration-time', '1.0', '--node', '/reader']
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = []
        listener = threading.Thread(target=lambda: said.extend(iter(process.stdout.readline, '')), daemon=True)
        listener.start()
        self.addCleanup(listener.join, 5.0)
        self.addCleanup(process.kill)
        until(lambda: chair.canrx.get_num_connections() > listeners)
        while 'Turn on the spot' not in ''.join(said) and process.poll() is None:
            chair.go(0.5)
        chair.go(1.0)
        for rate in (0.6, -0.6):
            chair.go(10.8, rate)
        while process.poll() is None:
            chair.go(0.5)
        listener.join(5.0)
        self.assertEqual(process.returncode, 0, ''.join(said))
        return ''.join(said)


if __name__ == '__main__':
    rospy.init_node('compass_test')
    rostest.rosrun('canserial', 'compass', CompassTest)
