#!/usr/bin/env python3
"""navsat_transform_node in ROS: topics, services, the transform, /diagnostics; and that peers' types are the same."""

import math
import sys
import threading
import unittest
from pathlib import Path

import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Quaternion, TransformStamped, TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, NavSatFix

from geographic_msgs.msg import GeoPoint, GeoPose
from robot_localization.srv import (
    FromLL,
    FromLLArray,
    SetDatum,
    SetPose,
    SetUTMZone,
    ToggleFilterProcessing,
    ToLL,
)

sys.path.append(str(Path(__file__).resolve().parent / 'support'))
from waiting import wait_until  # noqa: E402

HERE = (48.1, 11.6, 500.0)
NORTH = 1e-4 * 111195.0
"""m in 0.0001 deg of latitude there, about."""


def odometry(stamp, x=0.0, y=0.0):
    msg = Odometry()
    msg.header.stamp, msg.header.frame_id, msg.child_frame_id = stamp, 'odom', 'base_link'
    msg.pose.pose.position.x, msg.pose.pose.position.y, msg.pose.pose.orientation.w = x, y, 1.0
    return msg


def imu(stamp):
    msg = Imu()
    msg.header.stamp, msg.header.frame_id, msg.orientation.w = stamp, 'base_link', 1.0
    return msg


def velocity(stamp, east, north):
    msg = TwistStamped()
    msg.header.stamp, msg.header.frame_id = stamp, 'gps'
    msg.twist.linear.x, msg.twist.linear.y = east, north
    return msg


def fix(stamp, latitude=HERE[0]):
    msg = NavSatFix()
    msg.header.stamp, msg.header.frame_id = stamp, 'gps'
    msg.latitude, msg.longitude, msg.altitude = latitude, *HERE[1:]
    msg.position_covariance, msg.position_covariance_type = [1.0, 0, 0, 0, 2.0, 0, 0, 0, 3.0], 3
    return msg


class NavSatTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('navsat_test')

    def setUp(self):
        self.answers, self.filtered, self.headings, self.told, self.lock = [], [], [], {}, threading.Lock()
        self.publishers = {
            'odometry/filtered': rospy.Publisher('odometry/filtered', Odometry, queue_size=10),
            'imu': rospy.Publisher('imu', Imu, queue_size=10),
            'fix': rospy.Publisher('fix', NavSatFix, queue_size=10),
            'gps/vel': rospy.Publisher('gps/vel', TwistStamped, queue_size=10),
        }
        self.subscribers = [
            rospy.Subscriber('odometry/gps', Odometry, self.answers.append, queue_size=100),
            rospy.Subscriber('gps/filtered', NavSatFix, self.filtered.append, queue_size=100),
            rospy.Subscriber('gps/heading', Imu, self.headings.append, queue_size=100),
            rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics, queue_size=100),
        ]
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer)

    def on_diagnostics(self, array):
        for status in array.status:
            self.told[status.name] = status

    def message(self, namespace=''):
        wanted = f'{namespace}navsat_transform_node: navsat_transform'
        return next((s.message for name, s in self.told.items() if name.lstrip('/') == wanted), '')

    def call(self, name, type_, *arguments):
        rospy.wait_for_service(name, 20.0)
        return rospy.ServiceProxy(name, type_)(*arguments)

    def refused(self, name, type_, *arguments):
        """The sentence with which a service fails."""
        with self.assertRaises(rospy.ServiceException) as failed:
            self.call(name, type_, *arguments)
        return str(failed.exception)

    def send(self, latitude=HERE[0], x=0.0):
        stamp = rospy.Time.now()
        self.publishers['odometry/filtered'].publish(odometry(stamp, x))
        self.publishers['imu'].publish(imu(stamp))
        self.publishers['fix'].publish(fix(stamp, latitude))
        return stamp

    def answer(self, *arguments):
        stamp = self.send(*arguments)
        self.publishers['odometry/filtered'].publish(odometry(stamp + rospy.Duration(0.001), *arguments[1:]))
        found = lambda: [a for a in self.answers if a.header.stamp == stamp]
        return wait_until(found, 'a fix is not answered')[0]

    def test_all(self):
        """One after the other, for the node keeps what it learned."""
        self.types_are_the_peer_s()
        self.nothing_is_answered_before_it_is_known()
        self.fixes_come_out()
        self.a_velocity_tells_the_heading()
        self.places_are_converted()
        self.the_transform_follows_the_zone()
        self.a_datum_is_taken()
        self.the_second_takes_the_service_s_datum()

    def types_are_the_peer_s(self):
        """The MD5 sums of the ROS packages of these names, so that clients which were compiled elsewhere connect."""
        self.assertEqual(GeoPoint._md5sum, 'c48027a852aeff972be80478ff38e81a')
        self.assertEqual(GeoPose._md5sum, '778680b5172de58b7c057d973576c784')
        for service, md5 in MD5.items():
            self.assertEqual(service._md5sum, md5, service)

    def nothing_is_answered_before_it_is_known(self):
        said = self.refused('fromLL', FromLL, GeoPoint(*HERE))
        self.assertIn('waiting for /odometry/filtered and /imu and /fix', said)
        self.assertIn('not known yet', self.refused('toLL', ToLL, Point(1.0, 2.0, 3.0)))
        self.assertIn('not known yet', self.refused('fromLLArray', FromLLArray, [GeoPoint(*HERE)]))
        wait_until(lambda: 'waiting for /odometry' in self.message(), 'diagnostics do not say what is waited for')

    def fixes_come_out(self):
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        arm = TransformStamped()
        arm.header.frame_id, arm.child_frame_id = 'base_link', 'gps'
        arm.transform.translation.x, arm.transform.rotation.w = 0.5, 1.0
        broadcaster.sendTransform(arm)
        # Both nodes and this test; a fix waits for the antenna's place for a second only.
        wait_until(lambda: broadcaster.pub_tf.get_num_connections() == 3, 'the nodes do not listen to /tf_static')
        wait_until(lambda: all(p.get_num_connections() for p in self.publishers.values()), 'the node does not listen')
        wait_until(lambda: self.send() and self.answers, 'no odometry/gps')
        first = self.answer()
        self.assertEqual((first.header.frame_id, first.child_frame_id), ('odom', 'base_link'))
        self.assertLess(math.hypot(first.pose.pose.position.x, first.pose.pose.position.y), 1e-6)
        moved = self.answer(HERE[0] + 1e-4)
        self.assertAlmostEqual(moved.pose.pose.position.y, NORTH, delta=0.1)
        self.assertAlmostEqual(moved.pose.covariance[0], 1.0, delta=0.1)
        self.assertAlmostEqual(moved.pose.covariance[7], 2.0, delta=0.1)
        last = wait_until(lambda: self.filtered and self.filtered[-1], 'no gps/filtered')
        self.assertAlmostEqual(last.latitude, HERE[0], places=6)
        self.assertEqual((last.header.frame_id, last.position_covariance_type), ('base_link', 3))
        wait_until(lambda: 'fixes converted' in self.message(), 'diagnostics are not satisfied')
        own = next(s for name, s in self.told.items() if name.lstrip('/').startswith('navsat_transform_node'))
        self.assertEqual(own.level, DiagnosticStatus.OK)

    def a_velocity_tells_the_heading(self):
        self.assertEqual(self.headings, [])

        def north_in_reverse():
            stamp = rospy.Time.now()
            moving = odometry(stamp)
            moving.twist.twist.linear.x = -0.8
            self.publishers['odometry/filtered'].publish(moving)
            self.publishers['gps/vel'].publish(velocity(stamp, 0.0, 0.8))
            return self.headings

        heading = wait_until(north_in_reverse, 'no gps/heading')[-1]
        q = heading.orientation
        self.assertAlmostEqual(2.0 * math.atan2(q.z, q.w), -0.5 * math.pi, places=6)
        self.assertEqual(heading.header.frame_id, 'base_link')
        self.assertAlmostEqual(heading.orientation_covariance[8], (0.1 / 0.8) ** 2)
        self.assertEqual((heading.angular_velocity_covariance[0], heading.linear_acceleration_covariance[0]), (-1, -1))

    def places_are_converted(self):
        point = self.call('fromLL', FromLL, GeoPoint(HERE[0] + 1e-4, *HERE[1:])).map_point
        self.assertAlmostEqual(point.y, NORTH, delta=0.1)
        back = self.call('toLL', ToLL, point).ll_point
        self.assertAlmostEqual(back.latitude, HERE[0] + 1e-4, places=9)
        self.assertAlmostEqual(back.altitude, HERE[2], places=6)
        points = self.call('fromLLArray', FromLLArray, [GeoPoint(*HERE), GeoPoint(HERE[0] + 1e-4, *HERE[1:])])
        self.assertEqual(len(points.map_points), 2)
        self.assertAlmostEqual(points.map_points[1].y, point.y, places=9)
        self.assertIn('too near to a pole', self.refused('fromLL', FromLL, GeoPoint(89.0, 0.0, 0.0)))
        self.assertIn('not finite', self.refused('toLL', ToLL, Point(math.nan, 0.0, 0.0)))

    def the_transform_follows_the_zone(self):
        at = lambda: self.buffer.lookup_transform('odom', 'utm', rospy.Time(0)).transform
        wait_until(lambda: self.buffer.can_transform('odom', 'utm', rospy.Time(0)), 'no transform odom -> utm')
        before = at()
        self.call('setUTMZone', SetUTMZone, '33U')
        wait_until(lambda: abs(at().translation.x - before.translation.x) > 1.0, 'the transform does not follow')
        self.assertGreater(abs(at().rotation.z - before.rotation.z), 0.02)
        self.assertIn('is no UTM zone', self.refused('setUTMZone', SetUTMZone, 'nonsense'))
        self.assertLess(math.hypot(*self.place(self.answer())), 1e-3)  # the world stays where it is

    @staticmethod
    def place(answer):
        return answer.pose.pose.position.x, answer.pose.pose.position.y

    def a_datum_is_taken(self):
        self.call('setUTMZone', SetUTMZone, '32U')
        self.call('datum', SetDatum, GeoPose(GeoPoint(HERE[0] + 1e-4, *HERE[1:]), Quaternion(0.0, 0.0, 0.0, 1.0)))
        self.assertAlmostEqual(self.answer().pose.pose.position.y, -NORTH, delta=0.1)
        said = self.refused('datum', SetDatum, GeoPose(GeoPoint(*HERE), Quaternion()))
        self.assertIn('stands for no rotation', said)

    def the_second_takes_the_service_s_datum(self):
        self.assertIn('waiting for a datum', self.refused('second/toLL', ToLL, Point()))
        self.call('second/datum', SetDatum, GeoPose(GeoPoint(*HERE), Quaternion(0.0, 0.0, 0.0, 1.0)))
        place = self.call('second/toLL', ToLL, Point(0.0, 100.0, 0.0)).ll_point
        self.assertAlmostEqual(place.latitude, HERE[0] + 100.0 / 111195.0, delta=2e-6)
        self.assertIn('no UTM zone', self.refused('second/setUTMZone', SetUTMZone, '32U'))


MD5 = {
    SetDatum: 'fe903ca95d0210defda73a1629604439',
    ToLL: 'ad0cbea3b8423e9ccf1b2ebeefc50b92',
    FromLL: 'a6cd7064e35acbe3e4c3ac3dc5fd8265',
    FromLLArray: '505e15ae164b7a53b2f7a2e6a2897581',
    SetUTMZone: '893fd74d45efde020666acda18d3cccc',
    SetPose: '4f3e0bbe7a24e1f929488cd1970222d3',
    ToggleFilterProcessing: 'a8e1711976dcda1b8b978eee81e85498',
}

if __name__ == '__main__':
    rostest.rosrun('sara_localization', 'navsat_wiring', NavSatTest)
