#!/usr/bin/env python3
"""Bytes written by hand, as a Lawicel CANUSB would send them, come out as the right messages; commands come out as
bytes.
"""

import math
import os
import sys
import time
import unittest
from functools import partial

# This test is installed beside canserial.py, which must not be taken for the package.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]
sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))

import rospy  # noqa: E402
import rostest  # noqa: E402
from geometry_msgs.msg import PoseWithCovarianceStamped  # noqa: E402
from pty_adapter import PtyAdapter, wait_until  # noqa: E402
from sensor_msgs.msg import Imu, Range  # noqa: E402
from std_msgs.msg import UInt8  # noqa: E402

from canserial.msg import CAN, Encoder  # noqa: E402

wait_until = partial(wait_until, seconds=15.0)
ACCELERATION = b't203864005226F6FF0A00'  # SJO 100 cm, az 9.810, ay -0.010, ax 0.010 m/s2
ANGLES = b't20580000E8030CFE0000'  # rx 1.000, ry -0.500, rz 0 deg
AT_REST = b't20480000BFFFA5FFCFFF'  # no alarm, gz -0.65, gy -0.91, gx -0.49 deg/s
TURNING = b't20480000A703A5FF3300'  # gz 9.35, gy -0.91, gx 0.51 deg/s: 10, 0 and 1 above rest


class LawicelTest(unittest.TestCase):
    def setUp(self):
        self.got = {}
        for topic, kind in (
            ('imu/data', Imu),
            ('encoders', Encoder),
            ('mode', UInt8),
            ('SDI_range', Range),
            ('SJO_range', Range),
            ('raw_ranges', Range),
        ):
            rospy.Subscriber(topic, kind, lambda m, t=topic: self.got.setdefault(t, []).append(m), tcp_nodelay=True)
        self.cantx = rospy.Publisher('cantx', CAN, queue_size=10)
        self.set_pose = rospy.Publisher('set_pose', PoseWithCovarianceStamped, queue_size=1)
        self.adapter = PtyAdapter(rospy.get_param('~port'))
        self.addCleanup(lambda: os.path.lexists(self.adapter.path) and os.unlink(self.adapter.path))

    def imu(self):
        return self.got.get('imu/data', [])

    def turning(self):
        return [message for message in self.imu() if message.angular_velocity.z > 0.1]

    def turn(self, gyro):
        """One turn of 0.2 s of IMU frames."""
        self.adapter.send(ACCELERATION, ANGLES, gyro)
        time.sleep(0.2)

    def yaw_is_set(self):
        """The first frame may overtake the pose, which is another topic."""
        self.turn(AT_REST)
        return abs(angles(self.imu()[-1].orientation)[2] - 1.0) < 5e-5

    def mode_arrives(self):
        """Topics take a moment to connect: the first frames may be lost."""
        self.adapter.send(b't111803' + 7 * b'00')
        time.sleep(0.1)
        return 'mode' in self.got

    def test_bytes_to_messages_and_back(self):
        adapter = self.adapter
        self.assertTrue(wait_until(lambda: b'O' in adapter.commands), 'canserial.py did not open the channel')
        self.assertIn(b'S6', adapter.commands)
        self.assertTrue(wait_until(lambda: self.cantx.get_num_connections() and self.set_pose.get_num_connections()))
        self.assertTrue(wait_until(self.mode_arrives), 'no frame comes through')

        for _ in range(2):
            self.turn(AT_REST)
        self.assertEqual(self.imu(), [], 'published before the gyroscope was calibrated')
        for _ in range(50):
            if not self.imu():
                self.turn(AT_REST)
        self.assertTrue(self.imu(), 'the gyroscope is not calibrated after 10 s at rest')
        for _ in range(4):
            sent = rospy.get_time()
            self.turn(TURNING)
        self.assertTrue(wait_until(lambda: len(self.turning()) >= 4))
        last_at_rest, last = self.imu()[-5], self.imu()[-1]
        self.assertEqual(last.header.frame_id, 'base_link')
        self.assertTrue(sent <= last.header.stamp.to_sec() <= rospy.get_time(), (sent, last.header.stamp))
        acceleration, rate = last.linear_acceleration, last.angular_velocity
        for value, right in (
            (acceleration.x, 0.01),
            (acceleration.y, -0.01),
            (acceleration.z, 9.81),
            (rate.x, math.radians(1.0)),
            (rate.y, 0.0),
            (rate.z, 1.08 * math.radians(10.0)),
        ):
            self.assertAlmostEqual(value, right, 9)
        roll, pitch, yaw = angles(last.orientation)
        self.assertAlmostEqual(roll, math.radians(1.0), 6)
        self.assertAlmostEqual(pitch, math.radians(-0.5), 6)
        elapsed = (last.header.stamp - last_at_rest.header.stamp).to_sec()
        self.assertAlmostEqual(yaw, 1.08 * math.radians(10.0) * elapsed, 5)
        self.assertAlmostEqual(last.angular_velocity_covariance[8], 1.6e-6)

        pose = PoseWithCovarianceStamped()
        pose.header.stamp = rospy.Time.now()
        pose.pose.pose.orientation.z, pose.pose.pose.orientation.w = math.sin(0.5), math.cos(0.5)
        self.set_pose.publish(pose)
        self.assertTrue(wait_until(self.yaw_is_set), angles(self.imu()[-1].orientation))

        adapter.send(b't1018', b't101zz', b'rubbish', b't20440000BFFF', b't7778' + 8 * b'00')
        adapter.send(b't102800FA000010270000')
        for distance in (b'6400', b'C800', b'6E00'):  # 100, 200, 110 cm
            adapter.send(b't20188200' + distance + b'82008200')
        self.assertTrue(wait_until(lambda: all(map(self.got.get, ('encoders', 'SDI_range', 'SJO_range')))))
        encoder = self.got['encoders'][0]
        self.assertEqual((encoder.wheel, encoder.steps, encoder.time_100us), (1, 64000, 10000))
        self.assertEqual(self.got['mode'][0].data, 3)
        self.assertAlmostEqual(self.got['SDI_range'][0].range, 1.1, 5)
        self.assertEqual(self.got['SDI_range'][0].header.frame_id, 'SDI_frame')
        self.assertTrue(
            wait_until(lambda: 'SDI_frame' in {message.header.frame_id for message in self.got.get('raw_ranges', [])})
        )
        self.assertAlmostEqual([m.range for m in self.got['raw_ranges'] if m.header.frame_id == 'SDI_frame'][0], 1.1, 5)
        self.assertAlmostEqual(self.got['SJO_range'][0].range, 1.0, 5)

        self.cantx.publish(CAN(stdId=0x120, extId=-1, data=b'\x13\xed\x00\x00C\x00\x00\x00'))
        self.assertTrue(wait_until(lambda: adapter.lines == [b't120813ED000043000000']), adapter.lines)

        adapter.unplug()
        self.adapter = PtyAdapter(adapter.path)
        self.got.clear()
        self.assertTrue(wait_until(self.mode_arrives), 'an adapter plugged in again is not found')


def angles(q):
    """Roll, pitch, yaw of a quaternion."""
    return (
        math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x**2 + q.y**2)),
        math.asin(2 * (q.w * q.y - q.z * q.x)),
        math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y**2 + q.z**2)),
    )


if __name__ == '__main__':
    rospy.init_node('lawicel_test')
    rostest.rosrun('canserial', 'lawicel', LawicelTest)
