#!/usr/bin/env python3
"""map_server's topics and services, and map_saver over ROS."""

import os
import subprocess
import tempfile
import unittest

import numpy as np
import rospkg
import rospy
import rostest
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap, LoadMapResponse

from sara_common.grids.images import read_image
from sara_nav.maps import map_io

DATA = os.path.join(rospkg.RosPack().get_path('sara_nav'), 'test', 'data')
ROOM = map_io.load_map(os.path.join(DATA, 'room.yaml'))
SMALL = 'resolution: 0.1\norigin: [1, 2, 0.5]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n'


def call(name, kind, *arguments):
    rospy.wait_for_service(name, 30.0)
    return rospy.ServiceProxy(name, kind)(*arguments)


def saver(*arguments, timeout=60.0):
    return subprocess.run(
        ['rosrun', 'sara_nav', 'map_saver', *arguments], capture_output=True, text=True, timeout=timeout, check=False
    )


class Maps(unittest.TestCase):
    """One behaviour each; those that change the map put it back."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def write(self, name, text):
        with open(self.path(name), 'w', encoding='utf-8') as stream:
            stream.write(text)
        return self.path(name)

    def check_room(self, grid):
        self.assertEqual(grid.header.frame_id, 'floor')
        self.assertGreater(grid.header.stamp.to_sec(), 0.0)
        self.assertEqual((grid.info.width, grid.info.height), (160, 160))
        self.assertEqual(grid.info.resolution, np.float32(0.05))
        self.assertEqual(
            (grid.info.origin.position.x, grid.info.origin.position.y, grid.info.origin.orientation.w),
            (-1.0, -1.0, 1.0),
        )
        self.assertTrue((np.array(grid.data).reshape(160, 160) == ROOM.data).all())

    def test_map_by_service(self):
        self.check_room(call('static_map', GetMap).map)

    def test_map_by_latched_topic(self):
        self.check_room(rospy.wait_for_message('map', OccupancyGrid, 30.0))

    def test_metadata_by_latched_topic(self):
        self.assertEqual(rospy.wait_for_message('map_metadata', MapMetaData, 30.0), call('static_map', GetMap).map.info)

    def test_old_form_with_its_parameters(self):
        grid = call('/old/static_map', GetMap).map
        expected = map_io.occupancy(read_image(os.path.join(DATA, 'map_images', 'ramp.pgm')), 'trinary', True, 0.9, 0.1)
        self.assertEqual((grid.header.frame_id, grid.info.resolution), ('map', np.float32(0.1)))
        self.assertEqual(list(grid.data), expected.ravel().tolist())

    def test_change_map(self):
        self.write('small.pgm', 'P2 2 1 255 0 254')
        small, news = self.write('small.yaml', 'image: small.pgm\n' + SMALL), []
        subscriber = rospy.Subscriber('map', OccupancyGrid, news.append)
        while not news and not rospy.is_shutdown():
            rospy.sleep(0.02)
        answer = call('change_map', LoadMap, 'file://' + small)
        while news[-1].info.width != 2 and not rospy.is_shutdown():  # rospy may give a latched one twice
            rospy.sleep(0.02)
        self.assertEqual((answer.result, list(answer.map.data)), (LoadMapResponse.RESULT_SUCCESS, [100, 0]))
        self.assertEqual((list(news[-1].data), news[-1].info.origin.position.x), ([100, 0], 1.0))
        self.assertAlmostEqual(
            2.0 * np.arctan2(news[-1].info.origin.orientation.z, news[-1].info.origin.orientation.w), 0.5
        )
        self.assertEqual(rospy.wait_for_message('map_metadata', MapMetaData, 30.0).width, 2)
        self.assertEqual(
            call('change_map', LoadMap, 'package://sara_nav/test/data/room.yaml').result, LoadMapResponse.RESULT_SUCCESS
        )
        self.check_room(call('static_map', GetMap).map)
        subscriber.unregister()

    def test_a_change_that_fails_changes_nothing(self):
        self.write('torn.pgm', 'P5 9 9 255 ')
        for url, result in (
            (self.path('none.yaml'), LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST),
            ('package://no_such_package/a.yaml', LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST),
            (self.write('a.yaml', 'image: none.pgm\n' + SMALL), LoadMapResponse.RESULT_INVALID_MAP_DATA),
            (self.write('b.yaml', 'image: torn.pgm\n' + SMALL), LoadMapResponse.RESULT_INVALID_MAP_DATA),
            (self.write('c.yaml', 'image: torn.pgm\nresolution: 0\n'), LoadMapResponse.RESULT_INVALID_MAP_METADATA),
        ):
            self.assertEqual(call('change_map', LoadMap, url).result, result, url)
        self.check_room(call('static_map', GetMap).map)

    def test_what_is_saved_is_the_map(self):
        run = saver('-f', self.path('saved'))
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        again = map_io.load_map(self.path('saved.yaml'))
        self.assertTrue((again.data == ROOM.data).all())
        self.assertEqual(again.geometry, ROOM.geometry)

    def test_another_topic_and_other_thresholds(self):
        publisher = rospy.Publisher('shades', OccupancyGrid, queue_size=1, latch=True)
        grid = OccupancyGrid(data=[0, 10, 11, 39, 40, 100, -1])
        grid.info.width, grid.info.height, grid.info.resolution, grid.info.origin.orientation.w = 7, 1, 0.25, 1.0
        publisher.publish(grid)
        run = saver('-f', self.path('shades'), '--occ', '40', '--free', '10', '--fmt', 'png', 'map:=shades')
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        self.assertEqual(map_io.load_map(self.path('shades.yaml')).data.tolist(), [[0, 0, -1, -1, 100, 100, -1]])
        publisher.unregister()

    def test_bad_options_end_it_with_a_sentence(self):
        run = saver('--occ', '101', '--free', '70', '--fmt', 'gif')
        self.assertEqual(
            (run.returncode, '--occ is 101, allowed are numbers from 1 to 100; --fmt is' in run.stderr),
            (1, True),
            run.stderr,
        )
        run = saver('-f', self.path('no/such/folder/m'))
        self.assertEqual(
            (run.returncode, 'm.pgm cannot be written' in run.stdout + run.stderr), (1, True), run.stdout + run.stderr
        )

    def test_a_server_without_a_map_ends_with_a_sentence(self):
        for arguments, words in (
            ((), 'usage'),
            ((self.path('none.yaml'),), 'none.yaml does not exist'),
            (('_yaml_filename:=' + self.path('other.yaml'),), 'other.yaml does not exist'),
            (('a.pgm', '-1'), 'resolution is -1.0, allowed are'),
        ):
            run = subprocess.run(
                ['rosrun', 'sara_nav', 'map_server', *arguments, '__ns:=spare'],
                capture_output=True,
                text=True,
                timeout=60,
                check=False,
            )
            self.assertEqual((run.returncode, words in run.stdout + run.stderr), (1, True), run.stdout + run.stderr)


if __name__ == '__main__':
    rospy.init_node('maps_test')
    rostest.rosrun('sara_nav', 'maps', Maps)
