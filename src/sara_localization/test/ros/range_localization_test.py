#!/usr/bin/env python3
"""Wiring of range_localization: map, odometry, ranges and tf in; map -> odom, odometry/corrected, amcl_pose and
diagnostics out.

Time is that of the stamps, so that nothing depends on how fast the computer is.
"""

import itertools
import math
import sys
import threading
import unittest
from pathlib import Path

import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Range
from std_msgs.msg import Float32
from std_srvs.srv import Empty

sys.path.append(str(Path(__file__).resolve().parent / 'support'))
from waiting import wait_until  # noqa: E402

CELL, FREE_X, FREE_Y, WALL = 0.05, 60, 52, 3  # a room of 3.0 m x 2.6 m that begins at (0, 0)
ERROR, WRONG = (0.06, -0.05), (0.8, -0.5)  # of the dead reckoning, m: to be corrected, and too large for that
STEP = rospy.Duration(0.02)


def room():
    msg = OccupancyGrid()
    msg.header.frame_id = 'map'
    info = msg.info
    info.resolution, info.width, info.height = CELL, FREE_X + 2 * WALL, FREE_Y + 2 * WALL
    info.origin.position.x = info.origin.position.y = -WALL * CELL  # and no orientation, as messages are made
    inside = lambda k, n: WALL <= k < WALL + n  # noqa: E731
    msg.data = [
        0 if inside(c, FREE_X) and inside(r, FREE_Y) else 100 for r in range(info.height) for c in range(info.width)
    ]
    return msg


def fixed(parent, child, x=0.0, y=0.0, yaw=0.0):
    msg = TransformStamped()
    msg.header.frame_id, msg.child_frame_id = parent, child
    msg.transform.translation.x, msg.transform.translation.y = x, y
    msg.transform.rotation.z, msg.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return msg


class RangeLocalizationTest(unittest.TestCase):
    def setUp(self):
        self.lock, self.corrected, self.poses, self.status, self.lost = threading.Lock(), {}, [], None, []
        self.map_pub = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
        self.odom_pub = rospy.Publisher('odom', Odometry, queue_size=100)
        self.range_pubs = {name: rospy.Publisher(f'/{name}_range', Range, queue_size=100) for name in ('left', 'front')}
        self.set_pose_pub = rospy.Publisher('set_pose', PoseWithCovarianceStamped, queue_size=1)
        rospy.Subscriber('odometry/corrected', Odometry, lambda m: self.corrected.__setitem__(m.header.stamp, m))
        rospy.Subscriber('amcl_pose', PoseWithCovarianceStamped, self.poses.append)
        rospy.Subscriber('lost_probability', Float32, lambda m: self.lost.append(m.data))
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)
        self.buffer = tf2_ros.Buffer(rospy.Duration(1000.0))
        self.listener = tf2_ros.TransformListener(self.buffer)
        self.static = tf2_ros.StaticTransformBroadcaster()
        self.static.sendTransform(
            [
                fixed('odom', 'base_link'),
                fixed('base_link', 'left_frame', 0.3, 0.3, math.pi / 2),
                fixed('base_link', 'front_frame', 0.5),
            ]
        )
        for pub in (self.map_pub, self.odom_pub, *self.range_pubs.values(), self.set_pose_pub):
            wait_until(pub.get_num_connections, f'the node does not listen to {pub.name}')
        self.stamp = rospy.Time.now()

    def on_diagnostics(self, array):
        for status in array.status:
            if status.name == 'corrector: range_localization':
                self.status = status

    def send(self, k, error=ERROR):
        """A step of a robot that goes to and fro; returns its stamp and true place."""
        self.stamp += STEP
        x, y = 1.2 + 0.3 * math.sin(0.5 * k * STEP.to_sec()), 1.3 + 0.2 * math.sin(0.7 * k * STEP.to_sec())
        odom = Odometry()
        odom.header.stamp, odom.header.frame_id, odom.child_frame_id = self.stamp, 'map', 'base_link'
        odom.pose.pose.position.x, odom.pose.pose.position.y, odom.pose.pose.orientation.w = (
            x + error[0],
            y + error[1],
            1.0,
        )
        odom.twist.twist.linear.x = 0.25
        self.odom_pub.publish(odom)
        return self.stamp, x, y

    def send_range(self, name, distance, frame=None):
        msg = Range(
            radiation_type=Range.ULTRASOUND,
            field_of_view=math.radians(60.0),
            min_range=0.16,
            max_range=2.5,
            range=distance,
        )
        msg.header.stamp, msg.header.frame_id = self.stamp, frame or name + '_frame'
        self.range_pubs[name].publish(msg)

    def value(self, key):
        return {v.key: v.value for v in self.status.values}.get(key) if self.status else None

    def ride(self, steps, error=ERROR):
        """Ranges go out with every tenth step, once the node has answered that: nothing is lost, however slow the
        computer.
        """
        for k in range(steps):
            stamp, x, y = self.send(k, error)
            if k % 10 == 9:
                wait_until(lambda s=stamp: s in self.corrected, 'odometry/corrected does not answer')
                self.send_range('left', FREE_Y * CELL - (y + 0.3))
                self.send_range('front', FREE_X * CELL - (x + 0.5))
        wait_until(lambda: stamp in self.corrected, 'odometry/corrected does not answer')
        return stamp, x, y

    def test_the_pose_is_corrected_and_told(self):
        wait_until(
            lambda: self.status and self.status.message == 'waiting for the map',
            'diagnostics do not say what is waited for',
        )
        # Again until the node knows who listens to it; map -> odom comes when it knows the frames.
        wait_until(
            lambda: self.send(0) and self.corrected and self.buffer.can_transform('map', 'odom', rospy.Time()),
            'dead reckoning does not come through without a map',
        )
        self.assertEqual(list(self.corrected.values())[0].pose.pose.position.x, 1.2 + ERROR[0])
        self.map_pub.publish(room())
        wait_until(lambda: self.status.message != 'waiting for the map', 'the map is not taken')
        stamp, x, y = self.ride(800)
        last = self.corrected[stamp]
        self.assertAlmostEqual(last.pose.pose.position.x, x, delta=0.02)
        self.assertAlmostEqual(last.pose.pose.position.y, y, delta=0.02)
        self.assertEqual(last.twist.twist.linear.x, 0.25)
        self.assertTrue(0.0 < last.pose.covariance[0] < 0.01)
        found = self.buffer.lookup_transform('map', 'odom', stamp, rospy.Duration(10.0)).transform.translation
        self.assertAlmostEqual(found.x, last.pose.pose.position.x, delta=0.02)
        self.assertAlmostEqual(found.y, last.pose.pose.position.y, delta=0.02)
        self.assertEqual(wait_until(lambda: self.poses, 'no amcl_pose')[-1].header.frame_id, 'map')
        wait_until(
            lambda: int(self.value('used') or 0) > 20 and self.status.level == DiagnosticStatus.OK,
            f'diagnostics do not tell of ranges used: {self.status}',
        )

        wait_until(lambda: self.lost and self.lost[-1] < 0.05, lambda: f'a right pose is doubted: {self.lost}')

        # What is faulty is dropped, told, and changes nothing.
        self.send_range('left', math.nan)
        self.send_range('left', 1.0, 'nowhere')
        self.odom_pub.publish(Odometry())
        wait_until(
            lambda: self.value('bad_range') == '1' and self.value('no_mount') == '1', 'faulty readings are not counted'
        )

        # A pose that is set is believed.
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.pose.pose.orientation.w = 'map', 1.0
        self.set_pose_pub.publish(message)
        wait_until(lambda: self.value('correction (m, m, deg)') == '0.000 0.000 0.00', 'set_pose is not taken')

    def test_the_search_is_told_and_nothing_else_is_published(self):
        """After the test above: the map is known. A rectangle looks alike after half a turn: the node is never sure."""
        self.map_pub.publish(room())
        rospy.wait_for_service('global_localization', 60.0)
        search = rospy.ServiceProxy('global_localization', Empty)
        last = self.send(0)[0]
        wait_until(lambda: last in self.corrected, 'odometry/corrected does not answer')
        search()
        poses = len(self.poses)
        steps = itertools.count(1)

        def heeded():
            _, x, y = self.send(next(steps))
            self.send_range('left', FREE_Y * CELL - (y + 0.3))
            self.send_range('front', FREE_X * CELL - (x + 0.5))
            return int(self.value('searched') or 0) > 20

        wait_until(heeded, 'readings are not heeded')
        wait_until(
            lambda: 'not sure where the robot is' in self.status.message, lambda: f'nothing is told: {self.status}'
        )
        self.assertFalse([s for s in self.corrected if s > last], 'a pose is given out that nobody knows')
        self.assertEqual(len(self.poses), poses)
        wait_until(lambda: self.lost and self.lost[-1] == 1.0, lambda: f'while searching it is lost: {self.lost}')

        # A map without room ends the search in words; then it cannot be begun.
        solid = room()
        solid.data = [100] * len(solid.data)
        self.map_pub.publish(solid)
        wait_until(lambda: 'not sure' not in self.status.message, 'the search goes on in another map')
        with self.assertRaises(rospy.ServiceException) as refused:
            search()
        self.assertIn('no free place', str(refused.exception))

        # A pose that is set ends a search.
        self.map_pub.publish(room())
        wait_until(lambda: begins(search), 'there is no search in the first map')
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.pose.pose.orientation.w = 'map', 1.0
        self.set_pose_pub.publish(message)
        wait_until(lambda: 'not sure' not in self.status.message, 'set_pose does not end the search')
        sent = []  # the first may come before set_pose, which is another topic

        def answered():
            sent.append(self.send(next(steps))[0])
            return any(stamp in self.corrected for stamp in sent)

        wait_until(answered, 'there is no pose after set_pose')

    def test_wrong_poses_are_told_and_given_out_all_the_same(self):
        """After the tests above."""
        self.map_pub.publish(room())
        self.ride(800, WRONG)
        wait_until(lambda: self.lost and self.lost[-1] >= 0.5, lambda: f'a wrong pose is believed: {self.lost}')
        wait_until(
            lambda: self.status and self.status.message.startswith('lost: '),
            lambda: f'nothing is told: {self.status}',
        )


def begins(search):
    try:
        search()
    except rospy.ServiceException:
        return False
    return True


if __name__ == '__main__':
    rospy.init_node('range_localization_test')
    rostest.rosrun('sara_localization', 'range_localization', RangeLocalizationTest)
