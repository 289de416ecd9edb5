#!/usr/bin/env python3
"""Wiring of explore: a map and tf in, goals to move_base, ~frontiers, ~status and diagnostics out, ~resume and another
client's goal heeded, bad maps dropped; two rooms explored to the end, and back home.
"""

import math
import tempfile
import time
import unittest

import numpy as np
import rospkg
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, Twist
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid, Odometry
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader
from sensor_msgs.msg import Range
from std_msgs.msg import Bool, String
from visualization_msgs.msg import Marker, MarkerArray

CELL, START = 0.05, (1.0, 1.0)
LAUNCH = f'{rospkg.RosPack().get_path("sara_slam")}/launch/explore.launch'
PATIENCE_S = 900.0  # of a test that hangs: it takes 60 s on an idle machine


def world():
    """Two rooms of 3 m x 3 m, with an opening of 1 m between them, which the robot does not see into at first."""
    cells = np.zeros((60, 120), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    cells[:, 59:61] = 100
    cells[36:56, 59:61] = 0
    message = OccupancyGrid(data=cells.ravel().tolist())
    message.info.height, message.info.width = cells.shape
    message.info.resolution, message.info.origin.orientation.w = CELL, 1.0
    return message


class ExploreTest(unittest.TestCase):
    def setUp(self):
        self.heard, self.said, self.markers = {}, [], []
        for topic, kind in (('map', OccupancyGrid), ('base_pose_ground_truth', Odometry), ('cmd_vel', Twist)):
            rospy.Subscriber(topic, kind, lambda m, name=topic: self.heard.update({name: m}))
        rospy.Subscriber('explore/status', String, lambda m: self.said.append(m.data))
        rospy.Subscriber('explore/frontiers', MarkerArray, self.markers.append)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)
        self.resume = rospy.Publisher('explore/resume', Bool, queue_size=1)
        self.goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        self.maps = rospy.Publisher('map', OccupancyGrid, queue_size=1)
        self.world = rospy.Publisher('world', OccupancyGrid, queue_size=1, latch=True)
        self.world.publish(world())

    def on_diagnostics(self, array):
        self.heard.update({status.name: status for status in array.status})

    def test_the_launch_file_leaves_a_files_topics_alone(self):
        def topics(*arguments):
            config = ROSLaunchConfig()
            XmlLoader().load(LAUNCH, config, argv=arguments)
            return [config.params[f'/explore/costmap{of}_topic'].value for of in ('', '_updates')]

        with tempfile.NamedTemporaryFile('w', suffix='.yaml') as file:
            file.write('{costmap_topic: costmap/costmap, costmap_updates_topic: costmap/updates}')
            file.flush()
            self.assertEqual(topics(f'params:={file.name}'), ['costmap/costmap', 'costmap/updates'])
            self.assertEqual(topics(f'params:={file.name}', 'map:=hall'), ['hall', 'hall_updates'])
        self.assertEqual(topics(), ['map', 'map_updates'])

    def until(self, condition, why):
        deadline = time.monotonic() + PATIENCE_S
        while not (found := condition()):
            self.assertLess(time.monotonic(), deadline, f'{why}; said: {self.said[-3:]}')
            time.sleep(0.02)
        return found

    def says(self, words, after=0):
        return self.until(lambda: any(words in line for line in self.said[after:]), f'it does not say {words}')

    def place(self):
        place = self.heard['base_pose_ground_truth'].pose.pose.position
        return place.x, place.y

    def diagnosed(self):
        return self.heard['explore: explore']

    def test_all(self):
        """One after the other, for the node goes on."""
        self.says('To a frontier')
        self.until(lambda: 'cmd_vel' in self.heard and self.heard['cmd_vel'].angular.z, 'the robot does not move')
        self.hears_range_sensors()
        self.pauses()
        self.gives_way_to_others()
        self.drops_bad_maps()
        self.explores_to_the_end()

    def hears_range_sensors(self):
        """The node explore_by_ranges waits for a first reading of which tf knows the place, and no longer."""
        said = []
        rospy.Subscriber('explore_by_ranges/status', String, lambda m: said.append(m.data))
        self.until(lambda: any('no range sensor of range_topics' in line for line in said), 'it does not wait')
        ranges = rospy.Publisher('front_range', Range, queue_size=1)
        reading = Range(field_of_view=1.0, min_range=0.2, max_range=2.4, range=1.0)

        def heard():
            reading.header.frame_id = 'base_link' if reading.header.frame_id == 'unheard_of' else 'unheard_of'
            ranges.publish(reading)
            time.sleep(0.1)
            return any('move_base is not there' in line for line in said)

        self.until(heard, 'no reading is used')
        self.hears_the_costmap()

    def hears_the_costmap(self):
        """What move_base plans by, and its updates; faulty ones are counted."""
        whole = rospy.Publisher('nobody/global_costmap/costmap', OccupancyGrid, queue_size=1, latch=True)
        updates = rospy.Publisher(
            'nobody/global_costmap/costmap_updates', OccupancyGridUpdate, queue_size=1, latch=True
        )

        def obstacles():
            values = self.heard['explore_by_ranges: explore'].values
            return {value.key: value.value for value in values}['obstacles']

        self.until(lambda: obstacles() == 'no costmap', 'a costmap comes from nowhere')
        whole.publish(world())
        self.until(lambda: obstacles() == '432 cells', 'the costmap is not used')
        updates.publish(OccupancyGridUpdate(x=30, y=30, width=2, height=1, data=[100, 100]))
        self.until(lambda: obstacles() == '434 cells', 'the update is not used')
        updates.publish(OccupancyGridUpdate(x=119, y=30, width=2, height=1, data=[100, 100]))
        count = lambda: {v.key: v.value for v in self.heard['explore_by_ranges: explore'].values}['bad_maps']
        self.until(lambda: count() == '1', 'a faulty update is not counted')
        self.assertEqual(obstacles(), '434 cells')

    def pauses(self):
        self.resume.publish(Bool(False))
        self.says('Exploring pauses: it was asked to.')
        self.until(lambda: self.heard['cmd_vel'] == Twist(), 'the robot is not stopped')
        self.until(lambda: self.diagnosed().level == DiagnosticStatus.WARN, 'a pause is not diagnosed')
        self.go_on()

    def go_on(self):
        """Until move_base has the goal: it is told of before it is given."""
        said = len(self.said)
        self.resume.publish(Bool(True))
        self.says('To a frontier', said)
        self.until(lambda: self.heard['cmd_vel'] != Twist(), 'the robot does not move again')

    def gives_way_to_others(self):
        goal = PoseStamped()
        goal.header.frame_id, goal.pose.position.x, goal.pose.orientation.w = 'map', 0.3, 1.0
        self.goals.publish(goal)
        self.says('somebody else has given the robot a goal')
        self.go_on()

    def drops_bad_maps(self):
        bad = OccupancyGrid(data=[0])
        bad.header.frame_id, bad.info.resolution, bad.info.width, bad.info.height = 'map', math.nan, 1, 1
        self.maps.publish(bad)
        count = lambda: {value.key: value.value for value in self.diagnosed().values}['bad_maps']
        self.until(lambda: count() == '1', 'a faulty map is not counted')

    def explores_to_the_end(self):
        self.says('Explored: ')
        self.says('Back where it began.')
        self.assertLess(math.dist(self.place(), START), 0.3)
        data = np.array(self.heard['map'].data)
        self.assertGreater(np.count_nonzero(data == 0) * CELL**2, 15.5)  # m2 of 16.9, less the walls' own cells
        first, shown = self.markers[0].markers, [m for array in self.markers for m in array.markers]
        self.assertEqual(first[0].action, Marker.DELETEALL)
        self.assertTrue({Marker.POINTS, Marker.SPHERE} <= {marker.type for marker in shown})
        self.until(lambda: self.diagnosed().message == 'Back where it began.', 'its end is not diagnosed')


if __name__ == '__main__':
    rospy.init_node('explore_test', disable_rostime=True)
    rostest.rosrun('sara_slam', 'explore_wiring', ExploreTest)
