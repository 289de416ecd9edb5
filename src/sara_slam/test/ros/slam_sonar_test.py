#!/usr/bin/env python3
"""Wiring of slam_sonar: odometry and ranges of a robot that moves along a known way in; map, map_metadata, ~entropy,
map -> odom, dynamic_map, ~save and diagnostics out.

Stamps are those of the way, not of the clock, so that nothing depends on how fast the computer is.
"""

import math
import sys
import time
import unittest
from pathlib import Path

import numpy as np
import rospkg
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from nav_msgs.srv import GetMap
from sensor_msgs.msg import Range
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from sara_common.planar import compose
from sara_nav.maps import edits
from sara_nav.maps.edits import KEEP_OUT, WALL, Edit
from sara_nav.maps.map_io import FREE, OCCUPIED, load_map
from sara_nav.ros.conversions import grid_from_msg

sys.path.append(str(Path(__file__).resolve().parents[1] / 'unit'))
from sonar_world import DELAY, HALF, MOST, MOUNTS, TICK, heard, way  # noqa: E402

PATIENCE_S = 60.0
STEPS = 330
BEGIN = 1000.0


def quaternion(message, yaw):
    message.z, message.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)


class SonarTest(unittest.TestCase):
    def setUp(self):
        self.heard, self.told = {}, {}
        topics = ('map', OccupancyGrid), ('map_metadata', MapMetaData), ('slam_sonar/entropy', Float64)
        for topic, kind in (*topics, ('slam_sonar/walls_ahead', OccupancyGrid)):
            rospy.Subscriber(topic, kind, lambda m, name=topic: self.heard.update({name: m}), tcp_nodelay=True)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)
        self.odometry = rospy.Publisher('odometry', Odometry, queue_size=1000)
        self.ranges = {name: rospy.Publisher(name, Range, queue_size=1000) for name in MOUNTS}
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer)
        self.mounted = tf2_ros.StaticTransformBroadcaster()
        self.mounted.sendTransform([self.mount(name) for name in MOUNTS])

    def mount(self, name):
        message = TransformStamped(child_frame_id=f'{name}_frame')
        message.header.frame_id = 'base_link'
        message.transform.translation.x, message.transform.translation.y = MOUNTS[name][:2]
        quaternion(message.transform.rotation, MOUNTS[name][2])
        return message

    def on_diagnostics(self, array):
        self.told.update({status.name: status for status in array.status})

    def until(self, condition, why):
        deadline = time.monotonic() + PATIENCE_S
        while not (found := condition()):
            self.assertLess(time.monotonic(), deadline, why)
            time.sleep(0.02)
        return found

    def counted(self, what):
        status = self.told.get('slam_sonar: slam_sonar')
        return 0 if status is None else int({v.key: v.value for v in status.values}.get(what, 0))

    def test_all(self):
        """One after the other, for the node keeps what it learned."""
        self.has_no_map_yet()
        self.drives()
        self.knows_where_it_is()
        self.answers_and_is_saved()
        self.is_drawn_over()
        self.says_that_nothing_comes()

    def has_no_map_yet(self):
        rospy.wait_for_service('dynamic_map', PATIENCE_S)
        with self.assertRaisesRegex(rospy.ServiceException, 'there is no map yet'):
            rospy.ServiceProxy('dynamic_map', GetMap)()
        rospy.wait_for_service('slam_sonar/save', PATIENCE_S)  # it is offered later than dynamic_map
        answer = rospy.ServiceProxy('slam_sonar/save', Trigger)()
        self.assertFalse(answer.success)
        self.assertIn('there is no map yet', answer.message)

    def drives(self):
        topics = self.odometry, self.mounted.pub_tf, *self.ranges.values()  # this test hears /tf_static itself
        self.until(lambda: all(p.impl.has_connection('/slam_sonar') for p in topics), 'the node does not listen')
        true = way()[:STEPS].tolist()
        for number, pose in enumerate(true):
            stamp = rospy.Time.from_sec(BEGIN + TICK * number)
            message = Odometry(child_frame_id='base_link')
            message.header.frame_id, message.header.stamp = 'odom', stamp
            message.pose.pose.position.x, message.pose.pose.position.y = pose[:2]
            quaternion(message.pose.pose.orientation, pose[2])
            self.odometry.publish(message)
            for name, mount in MOUNTS.items():
                reading = Range(field_of_view=2.0 * HALF, min_range=0.17, max_range=MOST)
                reading.header.frame_id, reading.header.stamp = f'{name}_frame', stamp + rospy.Duration(DELAY)
                reading.range = heard(compose(pose, mount))
                self.ranges[name].publish(reading)
            time.sleep(0.01)
        self.first = true[0]
        self.says_what_it_cannot_use()

    def knows_where_it_is(self):
        self.until(lambda: self.counted('used') > 200, 'readings are not used')
        found = self.until(lambda: self.heard.get('map'), 'no map') and self.until(
            lambda: self.buffer.can_transform('map', 'odom', rospy.Time(0)), 'no map -> odom'
        )
        self.assertTrue(found)
        offset = self.buffer.lookup_transform('map', 'odom', rospy.Time(0)).transform.translation
        self.assertLess(math.dist((offset.x, offset.y), (-self.first[0], -self.first[1])), 0.1)  # odometry is true
        self.until(lambda: self.heard.get('slam_sonar/entropy'), 'no entropy')
        walls = self.until(lambda: self.heard.get('slam_sonar/walls_ahead'), 'no walls_ahead')
        self.assertEqual(walls.header.frame_id, 'map')

    def answers_and_is_saved(self):
        answer = rospy.ServiceProxy('dynamic_map', GetMap)().map
        self.assertEqual(answer.header.frame_id, 'map')
        self.until(lambda: self.heard['map'].info == answer.info, 'the map that the service gave is not published')
        self.until(lambda: self.heard.get('map_metadata') == answer.info, 'its metadata are not published')
        data = np.array(answer.data, np.int8)
        self.assertGreater((data == OCCUPIED).sum(), 100)
        self.assertGreater((data == FREE).sum(), 2000)
        saved = rospy.ServiceProxy('slam_sonar/save', Trigger)()
        self.assertTrue(saved.success, saved.message)
        path = Path(rospkg.get_ros_home()) / 'slam_sonar_test.yaml'
        self.assertTrue(np.array_equal(load_map(str(path)).data.ravel(), data))
        for file in (path, path.with_suffix('.pgm')):
            file.unlink()

    def is_drawn_over(self):
        """What is drawn over the map shows on the topics, and not on the map that is saved."""
        path = Path(rospkg.get_ros_home()).resolve() / 'slam_sonar_test.edits.yaml'
        plain = grid_from_msg(rospy.ServiceProxy('dynamic_map', GetMap)().map)
        drawn = (Edit(WALL, (0.0, -0.4), (0.0, 0.4)), Edit(KEEP_OUT, (0.5, -0.3), (1.0, 0.3)))
        edits.write(path, drawn)
        reload = rospy.ServiceProxy('reload_edits', Trigger)
        try:
            answer = reload()
            self.assertTrue(answer.success and Path(answer.message).samefile(path), answer)
            wanted = edits.drawn(plain, drawn).data.ravel()
            self.until(lambda: np.array_equal(self.heard['map'].data, wanted), 'the wall is not on the map')
            mask = rospy.wait_for_message('keepout_filter_mask', OccupancyGrid, PATIENCE_S)
            self.assertTrue(np.array_equal(mask.data, edits.keep_out_mask(plain, drawn).data.ravel()))
            self.assertTrue(rospy.ServiceProxy('slam_sonar/save', Trigger)().success)
            self.assertTrue(np.array_equal(load_map(str(path.with_name('slam_sonar_test.yaml'))).data, plain.data))
            path.write_text('edits: 3')
            self.assertIn('`edits` is missing', reload().message)
            path.unlink()
            self.assertTrue(reload().success)
            self.until(lambda: np.array_equal(self.heard['map'].data, plain.data.ravel()), 'the wall stays')
        finally:
            for ending in ('edits.yaml', 'yaml', 'pgm'):
                path.with_name(f'slam_sonar_test.{ending}').unlink(missing_ok=True)

    def says_what_it_cannot_use(self):
        """The last of each topic: when it is counted, all of the drive is used, and the map stays as it is."""
        self.odometry.publish(Odometry())
        self.until(lambda: self.counted('bad_frame') == 1, 'a pose in another frame is not counted')
        nowhere = Range(range=1.0, max_range=2.0)
        nowhere.header.frame_id = 'nowhere'
        for publisher in self.ranges.values():
            publisher.publish(nowhere)
        self.until(lambda: self.counted('no_mount') == len(MOUNTS), 'sensors that tf does not know are not counted')

    def says_that_nothing_comes(self):
        silent = lambda: self.told['slam_sonar: slam_sonar'].level == DiagnosticStatus.ERROR
        self.until(silent, 'it is not told that nothing comes any more')


if __name__ == '__main__':
    rospy.init_node('slam_sonar_test', disable_rostime=True)
    rostest.rosrun('sara_slam', 'slam_sonar_wiring', SonarTest)
