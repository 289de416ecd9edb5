#!/usr/bin/env python3
"""Wiring: every kind of input, diagnostics under robot_localization's keys, services, commands, fake_localization."""

import io
import math
import random
import sys
import threading
import unittest
from functools import partial
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import (
    PoseArray,
    PoseWithCovarianceStamped,
    TransformStamped,
    TwistStamped,
    TwistWithCovarianceStamped,
)
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_srvs.srv import Empty

from robot_localization.srv import SetPose, ToggleFilterProcessing
from sara_localization.geometry.rigid import quaternion_from_rpy, rpy_from_quaternion
from sara_localization.ros import conversions, wire

sys.path.append(str(Path(__file__).resolve().parent / 'support'))
import waiting  # noqa: E402

wait_until = partial(waiting.wait_until, timeout=8.0)

IDENTITY_6 = [1.0 if k % 7 == 0 else 0.0 for k in range(36)]
IDENTITY_3 = [1.0 if k % 4 == 0 else 0.0 for k in range(9)]
KINDS = ('imu0', 'odom0', 'pose0', 'twist0')
# Topics as this test's node resolves them.
PREFIX = '/full/example/'


class Sensors:
    """Publishes a valid message of each kind at any stamp."""

    def __init__(self):
        self.pubs = {
            name: rospy.Publisher(PREFIX + topic, kind, queue_size=10)
            for name, (topic, kind) in dict(
                odom0=('odom', Odometry),
                pose0=('pose', PoseWithCovarianceStamped),
                twist0=('twist', TwistWithCovarianceStamped),
                imu0=('imu/data', Imu),
            ).items()
        }

    def connected(self):
        return all(pub.get_num_connections() for pub in self.pubs.values())

    def publish(self, stamp):
        odom, pose, twist, imu = Odometry(), PoseWithCovarianceStamped(), TwistWithCovarianceStamped(), Imu()
        for msg in (odom, pose, twist, imu):
            msg.header.stamp, msg.header.frame_id = stamp, 'base_link'
        odom.header.frame_id = pose.header.frame_id = 'odom'
        odom.child_frame_id = 'base_link'
        for msg in (odom, pose):
            msg.pose.pose.position.x, msg.pose.pose.orientation.w, msg.pose.covariance = 1.0, 1.0, IDENTITY_6
        for msg in (odom, twist):
            msg.twist.covariance = IDENTITY_6
        imu.orientation.w, imu.linear_acceleration.z = 1.0, 9.80665
        imu.orientation_covariance = imu.angular_velocity_covariance = imu.linear_acceleration_covariance = IDENTITY_3
        for name, msg in dict(odom0=odom, pose0=pose, twist0=twist, imu0=imu).items():
            self.pubs[name].publish(msg)


class LocalizationNodesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.keys, cls.levels, cls.lock = {}, {}, threading.Lock()
        rospy.Subscriber('/diagnostics', DiagnosticArray, cls.on_diagnostics)
        cls.sensors = Sensors()
        cls.buffer = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)

    @classmethod
    def on_diagnostics(cls, array):
        with cls.lock:
            for status in array.status:
                cls.levels.setdefault(status.name, set()).add(status.level)
                cls.keys.setdefault(status.name, {}).update({value.key: value.value for value in status.values})

    def told(self):
        with self.lock:
            return dict(self.keys.get('full/ekf: Filter diagnostic updater', {}))

    def forget(self):
        with self.lock:
            self.keys.clear()

    def assert_told(self, keys):
        wait_until(lambda: set(keys) <= set(self.told()), lambda: 'not told: %s' % (set(keys) - set(self.told())))

    def test_1_every_kind_of_input_is_used_and_what_is_wrong_is_in_the_diagnostics(self):
        outputs = []
        rospy.Subscriber('/full/odometry/filtered', Odometry, outputs.append)
        wait_until(self.sensors.connected, 'the node does not subscribe to its inputs', timeout=20.0)
        for _ in range(10):
            self.sensors.publish(rospy.Time.now())
            rospy.sleep(0.1)
        wait_until(lambda: outputs, 'no output')
        wait_until(
            lambda: all(
                name in self.told() and ' 0 used' not in self.told()[name] and 'nothing' not in self.told()[name]
                for name in KINDS
            ),
            lambda: f'not used: {self.told()}',
        )
        wait_until(
            lambda: 'example/twist' in self.told().get('twist1_silent', ''),
            lambda: 'who else publishes is not told: {}'.format(self.told().get('twist1_silent')),
            timeout=20.0,  # the node asks the master every 5 s
        )
        self.assertIn('odom0 NIS', self.told())
        self.forget()
        self.sensors.publish(rospy.Time(0))
        self.assert_told(name + '_timestamp' for name in KINDS)

    def test_2_messages_from_before_set_pose_and_before_their_predecessor(self):
        pose = PoseWithCovarianceStamped()
        pose.header.stamp, pose.header.frame_id = rospy.Time.now(), 'odom'
        pose.pose.pose.orientation.w, pose.pose.covariance = 1.0, IDENTITY_6
        self.forget()
        rospy.ServiceProxy('/full/set_pose', SetPose)(pose)
        self.sensors.publish(pose.header.stamp - rospy.Duration(0.5))
        self.assert_told(name + '_timestamp' for name in KINDS)
        rospy.sleep(0.3)
        newest = rospy.Time.now()
        self.sensors.publish(newest)
        rospy.sleep(0.2)
        self.forget()
        self.sensors.publish(newest - rospy.Duration(0.1))
        self.assert_told(
            [
                'imu0_acceleration_timestamp',
                'imu0_pose_timestamp',
                'imu0_twist_timestamp',
                'odom0_twist_timestamp',
                'pose0_timestamp',
                'twist0_timestamp',
            ]
        )

    def test_3_enable_control_toggle_and_reset(self):
        outputs = []
        rospy.Subscriber('/commanded/odometry/filtered', Odometry, outputs.append)
        twist_pub = rospy.Publisher('/commanded/twist', TwistWithCovarianceStamped, queue_size=1)
        command_pub = rospy.Publisher('/commanded/cmd_vel', TwistStamped, queue_size=1)
        for name in ('enable', 'toggle', 'reset'):
            rospy.wait_for_service('/commanded/ukf/' + name, 10.0)
        wait_until(lambda: twist_pub.get_num_connections() and command_pub.get_num_connections(), 'not subscribed')

        def sideways_still():
            twist = TwistWithCovarianceStamped()
            twist.header.stamp, twist.header.frame_id, twist.twist.covariance = (
                rospy.Time.now(),
                'commanded_base',
                IDENTITY_6,
            )
            twist_pub.publish(twist)

        def command(speed, frame=''):
            msg = TwistStamped()
            msg.header.stamp, msg.header.frame_id, msg.twist.linear.x = rospy.Time.now(), frame, speed
            command_pub.publish(msg)

        sideways_still()
        rospy.sleep(0.4)
        self.assertEqual(outputs, [], 'output although disabled_at_startup')
        rospy.ServiceProxy('/commanded/ukf/enable', Empty)()
        sideways_still()
        wait_until(lambda: outputs, 'no output after enable')
        for _ in range(10):
            command(0.5, 'commanded_odom')  # not the robot's frame: ignored
            rospy.sleep(0.05)
        self.assertAlmostEqual(outputs[-1].twist.twist.linear.x, 0.0, delta=0.01)
        end = rospy.Time.now() + rospy.Duration(6.0)
        while outputs[-1].twist.twist.linear.x < 0.4 and rospy.Time.now() < end:
            command(0.5, 'commanded_base')
            rospy.sleep(0.05)
        self.assertAlmostEqual(outputs[-1].twist.twist.linear.x, 0.5, delta=0.11)
        self.buffer.lookup_transform('commanded_odom', 'commanded_base', rospy.Time(0), rospy.Duration(5.0))
        toggle = rospy.ServiceProxy('/commanded/ukf/toggle', ToggleFilterProcessing)
        self.assertTrue(toggle(False).status)
        self.assertFalse(toggle(False).status)
        off = rospy.Time.now()
        wait_until(lambda: outputs[-1].header.stamp > off, 'no output while switched off')
        seen, stands = len(outputs), outputs[-1].pose.pose.position.x
        wait_until(lambda: len(outputs) > seen + 20, 'no output while switched off')
        self.assertAlmostEqual(outputs[-1].pose.pose.position.x, stands, delta=0.05)
        self.assertTrue(toggle(True).status)
        rospy.ServiceProxy('/commanded/ukf/reset', Empty)()
        sideways_still()
        wait_until(lambda: abs(outputs[-1].pose.pose.position.x) < 0.05, 'reset does not show')

    def test_4_fake_localization_is_where_the_truth_is_and_follows_set_pose(self):
        truth_pub = rospy.Publisher('/fake/base_pose_ground_truth', Odometry, queue_size=5)
        set_pose_pub = rospy.Publisher('/fake/set_pose', PoseWithCovarianceStamped, queue_size=1)
        poses, clouds, relayed = [], [], []
        rospy.Subscriber('/fake/amcl_pose', PoseWithCovarianceStamped, poses.append)
        rospy.Subscriber('/fake/particlecloud', PoseArray, clouds.append)
        rospy.Subscriber('/fake/initialpose', PoseWithCovarianceStamped, relayed.append)
        broadcaster = tf2_ros.TransformBroadcaster()
        running = threading.Event()
        running.set()

        def play():
            while running.is_set() and not rospy.is_shutdown():
                now = rospy.Time.now()
                truth, link = Odometry(), TransformStamped()
                truth.header.stamp, truth.header.frame_id, truth.child_frame_id = now, 'world', 'fake_base'
                truth.pose.pose.position.x = 4.0
                q = truth.pose.pose.orientation
                q.x, q.y, q.z, q.w = quaternion_from_rpy(0.0, 0.0, 1.0)
                truth_pub.publish(truth)  # before the transform that it waits for
                link.header.stamp, link.header.frame_id, link.child_frame_id = now, 'fake_odom', 'fake_base'
                link.transform.translation.y, link.transform.rotation.w = 9.0, 1.0
                broadcaster.sendTransform(link)
                rospy.sleep(0.05)

        threading.Thread(target=play, daemon=True).start()
        self.addCleanup(running.clear)

        def at(x, y, yaw):
            try:
                t = self.buffer.lookup_transform('fake_map', 'fake_base', rospy.Time(0)).transform
            except tf2_ros.TransformException:
                return False
            turned = rpy_from_quaternion((t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w))[2]
            return math.hypot(t.translation.x - x, t.translation.y - y) < 1e-3 and abs(turned - yaw) < 1e-3

        wait_until(lambda: at(4.0, 0.0, 1.0), 'fake_localization is not at the true pose')
        wait_until(lambda: poses and clouds, 'amcl_pose and particlecloud are not published')
        self.assertEqual(poses[-1].header.frame_id, 'fake_map')
        self.assertEqual(len(clouds[-1].poses), 1)
        self.assertAlmostEqual(poses[-1].pose.pose.position.x, 4.0)
        pose = PoseWithCovarianceStamped()
        pose.header.stamp, pose.header.frame_id = rospy.Time.now(), 'fake_map'
        pose.pose.pose.position.x, pose.pose.pose.position.y, pose.pose.pose.orientation.w = -1.0, 2.0, 1.0
        wait_until(set_pose_pub.get_num_connections, 'nobody listens to set_pose')
        set_pose_pub.publish(pose)
        wait_until(lambda: at(-1.0, 2.0, 0.0), 'set_pose does not show')
        # Once more where the relay did not know yet that this test listens.
        wait_until(lambda: relayed or set_pose_pub.publish(pose), 'set_pose is not relayed to initialpose')
        wait_until(
            lambda: DiagnosticStatus.OK in self.levels.get('fake/fake_localization: fake_localization', ()), 'not well'
        )

    def test_5_what_is_read_from_the_bytes_is_what_the_message_holds(self):
        numbers = random.Random(5)
        for message, from_bytes, from_message in (
            (Imu, wire.imu, conversions.imu),
            (Odometry, wire.odometry, conversions.odometry),
        ):
            for frame in ('', 'base_link', 'Räder/links'):
                msg, buffer = filled(message(), numbers), io.BytesIO()
                msg.header.stamp, msg.header.frame_id = rospy.Time(1700000000, 123456789), frame
                msg.serialize(buffer)
                unread = wire.unread(message)().deserialize(buffer.getvalue())
                read, known = from_bytes(unread.bytes), from_message(msg)
                self.assertEqual(read.stamp.nanoseconds, known.stamp.nanoseconds)
                for field, a, b in zip(known._fields, read, known):
                    np.testing.assert_array_equal(a, b, field)


def filled(msg, numbers):
    """The message with a different number in every field of it."""
    for name, kind in zip(msg.__slots__, msg._slot_types):
        value = getattr(msg, name)
        if kind == 'float64':
            setattr(msg, name, numbers.random())
        elif kind.startswith('float64['):
            setattr(msg, name, [numbers.random() for _ in value])
        elif hasattr(value, '_slot_types'):
            filled(value, numbers)
        elif kind == 'string':
            setattr(msg, name, f'frame {numbers.random():g}')
    return msg


if __name__ == '__main__':
    rospy.init_node('localization_nodes_test')
    rostest.rosrun('sara_localization', 'localization_nodes', LocalizationNodesTest, sys.argv)
