#!/usr/bin/env python3
"""Costmaps as nodes: what they listen to, publish and let be changed, and what they do with messages that are wrong."""

import math
import struct
import time
import unittest

import numpy as np
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import Point32, Polygon, PolygonStamped, TransformStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan, PointCloud, PointCloud2, PointField, Range


class Picture:
    """A costmap put together from what a node publishes, as RViz does it."""

    def __init__(self, node):
        self.grid = self.costs = None
        self.updates = []
        self.grids = 0
        self.subscribers = [
            rospy.Subscriber(f'/{node}/costmap/costmap', OccupancyGrid, self.on_grid),
            rospy.Subscriber(f'/{node}/costmap/costmap_updates', OccupancyGridUpdate, self.on_update),
        ]

    def close(self):
        """Listen no more."""
        for subscriber in self.subscribers:
            subscriber.unregister()

    def on_grid(self, msg):
        self.costs = np.array(msg.data).reshape(msg.info.height, msg.info.width)
        self.grid = msg
        self.grids += 1

    def on_update(self, msg):
        if self.grid is not None:
            self.updates.append(msg)  # who sees what it brought finds it here
            self.costs[msg.y : msg.y + msg.height, msg.x : msg.x + msg.width] = np.array(msg.data).reshape(
                msg.height, -1
            )

    def at(self, x, y):
        """Return what is published of a point (m), or None."""
        if self.grid is None:
            return None
        info = self.grid.info
        column = math.floor((x - info.origin.position.x) / info.resolution)
        row = math.floor((y - info.origin.position.y) / info.resolution)
        return int(self.costs[row, column]) if 0 <= column < info.width and 0 <= row < info.height else None


def transform(parent, child, x, y, yaw):
    msg = TransformStamped(child_frame_id=child)
    msg.header.frame_id, msg.header.stamp = parent, rospy.Time.now()
    msg.transform.translation.x, msg.transform.translation.y, msg.transform.translation.z = x, y, 0.3
    msg.transform.rotation.z, msg.transform.rotation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    return msg


def a_map(yaw=0.0, frame='map'):
    """5 x 4 m, an obstacle at (0.5, 0.5), unknown at (4.5, 3.5)."""
    msg = OccupancyGrid()
    msg.header.frame_id = frame
    msg.info.resolution, msg.info.width, msg.info.height = 0.05, 100, 80
    msg.info.origin.orientation.z, msg.info.origin.orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    data = np.zeros((80, 100), int)
    data[10, 10], data[70, 90] = 100, -1
    msg.data = data.ravel().tolist()
    return msg


class CostmapTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.still, cls.rolling, cls.swept = Picture('still'), Picture('rolling'), rospy.Time(0)
        cls.messages = {'values': {}, 'texts': set()}
        cls.diagnostics = rospy.Subscriber('/diagnostics', DiagnosticArray, cls.on_diagnostics)
        cls.tf = tf2_ros.StaticTransformBroadcaster()
        cls.tf.sendTransform(
            [
                transform('map', 'odom', 1.0, 0.0, math.pi / 2),
                transform('odom', 'base_link', 2.0, -1.0, 0.0),
                transform('base_link', 'laser', 0.0, 0.0, 0.0),
                transform('base_link', 'SDI_frame', 0.0, 0.0, 0.0),
            ]
        )
        cls.moving, cls.out = tf2_ros.TransformBroadcaster(), {}
        for topic, kind in (
            ('/map', OccupancyGrid),
            ('/map_updates', OccupancyGridUpdate),
            ('/scan', LaserScan),
            ('/points', PointCloud2),
            ('/old_cloud', PointCloud),
            ('/SDI_range', Range),
            ('/still/costmap/footprint', Polygon),
        ):
            cls.out[topic] = rospy.Publisher(topic, kind, queue_size=10, latch=topic == '/map')
        cls.out['/map'].publish(a_map())
        # The robot is at map (2, 2), looking along y.

    @classmethod
    def on_diagnostics(cls, msg):
        for status in msg.status:
            cls.messages['texts'].add(status.message)
            cls.messages['values'].update(
                (entry.key, entry.value) for entry in status.values if status.name.startswith('still')
            )

    def until(self, condition, what, again=lambda: None):
        end = time.monotonic() + 30.0
        while not condition():
            again()
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.05)

    def count(self, kind):
        return int(self.messages['values'].get('costmap/' + kind, 0))

    def scan(self, ranges, frame='laser', stamp=None):
        msg = LaserScan(
            angle_min=-0.1, angle_max=0.1, angle_increment=0.1, range_min=0.05, range_max=2.0, ranges=ranges
        )
        msg.header.frame_id, msg.header.stamp = frame, stamp or rospy.Time.now()
        self.out['/scan'].publish(msg)

    def sweep(self):
        """The frame `swept` turns from 0 to 0.5 rad at map (2, 2) in 0.2 s, in which three rays are cast."""
        begin = rospy.Time.now() - rospy.Duration(0.3)
        if begin < self.swept:
            return  # two sweeps at once would turn the frame to and fro
        type(self).swept = begin + rospy.Duration(0.25)
        for after in (0.0, 0.2):
            msg = transform('map', 'swept', 2.0, 2.0, 2.5 * after)
            msg.header.stamp = begin + rospy.Duration.from_sec(after)
            self.moving.sendTransform(msg)
        msg = LaserScan(angle_min=-0.1, angle_max=0.1, angle_increment=0.1, range_min=0.05, range_max=2.0)
        msg.ranges, msg.time_increment = [3.0, 1.05, 3.0], 0.1
        msg.header.frame_id, msg.header.stamp = 'swept', begin
        self.out['/scan'].publish(msg)

    def range(self, distance, frame='SDI_frame'):
        msg = Range(min_range=0.16, max_range=2.5, field_of_view=0.5, range=distance)
        msg.header.frame_id, msg.header.stamp = frame, rospy.Time.now()
        self.out['/SDI_range'].publish(msg)

    def test_1_the_map_gives_size_costs_and_unknown_space(self):
        self.until(lambda: self.still.at(0.52, 0.52) == 100, 'no costmap of the map')
        self.assertEqual((self.still.grid.info.width, self.still.grid.info.height), (100, 80))
        self.assertEqual(self.still.grid.header.frame_id, 'map')
        self.assertEqual((self.still.at(0.58, 0.52), self.still.at(4.52, 3.52), self.still.at(3.0, 1.0)), (99, -1, 0))
        self.still.close()
        type(self).still = Picture('still')
        self.until(lambda: self.still.at(0.52, 0.52) == 100, 'one who comes when nothing changes gets no grid')

    def test_2_a_rolling_costmap_looks_the_map_up_in_its_own_frame(self):
        self.until(lambda: self.rolling.at(0.52, 0.48) == 100, 'the map is not where it should be in odom')
        info = self.rolling.grid.info
        self.assertEqual((info.width, info.height, self.rolling.grid.header.frame_id), (80, 80, 'odom'))
        self.assertAlmostEqual(info.origin.position.x, 0.0, delta=0.051)
        self.assertAlmostEqual(info.origin.position.y, -3.0, delta=0.051)
        before = self.rolling.grids
        self.until(lambda: self.rolling.grids > before + 3, 'always_send_full_costmap does not send the whole')
        self.assertEqual(self.rolling.updates, [])

    def test_3_scans_and_clouds_mark_and_clear_in_small_windows(self):
        self.still.updates.clear()
        self.until(
            lambda: self.still.at(2.02, 3.02) == 100, 'the scan marks nothing', lambda: self.scan([3.0, 1.03, 3.0])
        )
        self.assertTrue(self.still.updates)
        self.assertTrue(all(u.width * u.height < 100 * 80 for u in self.still.updates[-3:]))
        self.until(
            lambda: self.still.at(2.02, 3.02) == 0,
            'the ray to infinity clears nothing',
            lambda: self.scan([math.inf, math.inf, math.inf]),
        )

        self.until(lambda: self.still.at(3.02, 2.26) == 100, 'the ray is not placed at its own time', self.sweep)
        self.assertNotEqual(self.still.at(3.05, 2.02), 100)

        def clouds():
            msg = PointCloud(points=[Point32(0.5, 0.5, 0.1), Point32(math.nan, 0.0, 0.0)])
            msg.header.frame_id, msg.header.stamp = 'laser', rospy.Time.now()
            self.out['/old_cloud'].publish(msg)
            msg = PointCloud2(
                width=2,
                height=1,
                point_step=16,
                row_step=32,
                is_dense=True,
                fields=[
                    PointField(name, offset, PointField.FLOAT32, 1) for name, offset in (('x', 4), ('y', 8), ('z', 12))
                ],
                data=struct.pack('<8f', 0.0, 0.5, -0.5, 0.1, 0.0, 0.8, -0.5, 3.0),
            )
            msg.header.frame_id, msg.header.stamp = 'laser', rospy.Time.now()
            self.out['/points'].publish(msg)

        self.until(
            lambda: self.still.at(1.52, 2.52) == 100 and self.still.at(2.52, 2.52) == 100, 'clouds mark nothing', clouds
        )
        self.assertLess(self.still.at(2.52, 2.82), 99, 'a point 3.3 m high is no obstacle')

    def test_4_ranges_mark_and_no_echo_clears(self):
        self.until(lambda: self.still.at(2.02, 2.83) == 100, 'the range marks nothing', lambda: self.range(0.83))
        self.until(lambda: self.still.at(2.02, 2.83) == 0, 'no echo clears nothing', lambda: self.range(math.inf))

    def test_5_silent_sensors_are_told_of(self):
        for text in ('/SDI_range silent', '/points silent'):
            self.until(
                lambda text=text: any(text in told for told in list(self.messages['texts'])), 'nothing said of ' + text
            )

    def test_6_the_footprint_is_published_and_taken(self):
        seen = []
        subscriber = rospy.Subscriber('/still/costmap/footprint', PolygonStamped, seen.append)
        self.until(lambda: seen, 'no footprint')
        corners = [(p.x, p.y) for p in seen[-1].polygon.points]
        self.assertAlmostEqual(max(x for x, _ in corners), 2.21, places=3)
        self.assertAlmostEqual(max(y for _, y in corners), 2.31, places=3)
        before = self.count('bad_footprints')
        self.until(
            lambda: self.count('bad_footprints') > before,
            'a footprint of two corners is not counted',
            lambda: self.out['/still/costmap/footprint'].publish(Polygon([Point32(0.0, 0.0, 0.0)] * 2)),
        )
        self.until(
            lambda: abs(max(p.y for p in seen[-1].polygon.points) - 2.51) < 1e-3,
            'another footprint is not taken',
            lambda: self.out['/still/costmap/footprint'].publish(
                Polygon([Point32(0.5, 0.2, 0.0), Point32(0.5, -0.2, 0.0), Point32(-0.5, 0.0, 0.0)])
            ),
        )
        subscriber.unregister()

    def test_7_parameters_change_while_it_runs(self):
        self.assertEqual(self.still.at(0.97, 0.52), 0)
        client = Client('/still/costmap/inflation_layer', timeout=30)
        client.update_configuration({'inflation_radius': 0.6, 'cost_scaling_factor': 1.0})
        self.until(lambda: self.still.at(0.97, 0.52) > 0, 'a wider inflation is not seen')
        other = Client('/still/costmap/inflation_layer', timeout=30)
        self.until(lambda: other.get_configuration()['inflation_radius'] == 0.6, 'another client is told the old one')
        client = Client('/rolling/costmap', timeout=30)
        kinds = {entry['name']: entry['type'] for entry in client.get_parameter_descriptions()}
        self.assertEqual((kinds['width'], kinds['height'], kinds['resolution']), ('int', 'int', 'double'))
        client.update_configuration({'width': 2, 'height': 3})
        self.until(lambda: (self.rolling.grid.info.width, self.rolling.grid.info.height) == (40, 60), 'not resized')

    def test_7_the_next_start_finds_what_was_written_and_what_was_tuned(self):
        client = Client('/early/costmap', timeout=30)
        self.assertEqual(client.get_configuration()['robot_radius'], 0.3)
        self.assertEqual(rospy.get_param('/early/costmap/width'), 5.5, 'what clients see is a whole number')
        self.assertFalse(rospy.has_param('/early/costmap/inflation_radius'), 'moved as by the C++ costmap')
        self.assertEqual(rospy.get_param('/early/costmap/inflation_layer/inflation_radius'), 0.8)
        self.assertFalse(rospy.has_param('/early/costmap/robot_radius'), 'it would hide the one above')
        client.update_configuration({'robot_radius': 0.4})
        self.assertEqual(rospy.get_param('/early/costmap/robot_radius'), 0.4)
        self.assertFalse(rospy.has_param('/early/costmap/footprint'))

    def test_8_what_is_wrong_is_dropped_and_counted_and_the_node_lives(self):
        before = self.count('no_transform')
        self.until(
            lambda: self.count('no_transform') > before,
            'an unknown frame is not counted',
            lambda: self.scan([1.0], 'nowhere', rospy.Time.now() - rospy.Duration(9.0)),
        )
        empty = LaserScan(time_increment=1e-4, range_max=2.0)
        empty.header.frame_id = 'laser'
        self.out['/scan'].publish(empty)
        before, far = self.count('bad_messages'), rospy.Time(2**31)
        place = transform('map', 'swept', 2.0, 2.0, 0.0)
        place.header.stamp = far
        self.moving.sendTransform(place)
        self.until(
            lambda: self.count('bad_messages') > before,
            'a stamp that tf2 cannot hold is not counted',
            lambda: self.scan([1.0], stamp=far),
        )
        self.until(lambda: self.count('ultrasonic/nan_ranges') > 0, 'NaN is not counted', lambda: self.range(math.nan))
        for wrong in (a_map(0.5), a_map(frame='odom'), OccupancyGrid()):
            before = self.count('bad_maps')
            self.until(
                lambda before=before: self.count('bad_maps') > before,
                'a wrong map is not counted',
                lambda wrong=wrong: self.out['/map'].publish(wrong),
            )
        update = OccupancyGridUpdate(x=98, y=0, width=5, height=1, data=[100] * 5)
        self.until(
            lambda: self.count('static_layer/bad_updates') > 0,
            'an update off the map is not counted',
            lambda: self.out['/map_updates'].publish(update),
        )
        update = OccupancyGridUpdate(x=60, y=10, width=2, height=1, data=[100, 100])
        self.until(
            lambda: self.still.at(3.02, 0.52) == 100,
            'an update of the map is not taken',
            lambda: self.out['/map_updates'].publish(update),
        )


if __name__ == '__main__':
    rospy.init_node('costmap_test')
    rostest.rosrun('sara_nav', 'costmap', CostmapTest)
