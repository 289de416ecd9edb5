#!/usr/bin/env python3
"""sara.launch comes up whole and clean, and the simulated chair shares only its serial port with the stack."""

import unittest

import rosgraph
import rosnode
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseActionResult
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, Range

from sara_bringup.ros.goals import until
from sara_common.platforms import chosen

NODES = {
    '/simulator',
    '/canserial',
    '/read',
    '/diff_drive_controller',
    '/cmd_vel_mux',
    '/safety_gate',
    '/ekf_se',
    '/map_server',
    '/move_base',
    '/robot_state_publisher',
}
RANGES = tuple(chosen().sonars)
PATIENCE_S = 60.0  # of wall time, for what comes with the start


class BringupTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.log = []
        rospy.Subscriber('/rosout', Log, cls.log.append)
        rospy.wait_for_message('/imu/data', Imu)
        rospy.wait_for_message('/odometry/filtered', Odometry)
        rospy.sleep(1.0)

    def test_1_nodes_are_there(self):
        until(lambda: set(rosnode.get_node_names()) >= NODES, 'all nodes', PATIENCE_S)

    def test_2_fused_pose_comes_at_50_hz_of_simulated_time(self):
        stamps = []
        subscriber = rospy.Subscriber('/odometry/filtered', Odometry, lambda m: stamps.append(m.header.stamp.to_sec()))
        rospy.sleep(5.0)
        subscriber.unregister()
        self.assertAlmostEqual((len(stamps) - 1) / (stamps[-1] - stamps[0]), 50.0, delta=2.5)

    def test_3_frames(self):
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        for parent, child in [
            ('map', 'odom'),
            ('odom', 'base_link'),
            ('base_link', 'imu_link'),
            ('base_link', 'left_wheel'),
        ] + [('base_link', f'{name}_frame') for name in RANGES]:
            buffer.lookup_transform(parent, child, rospy.Time(0), rospy.Duration(PATIENCE_S))

    def test_4_ranges(self):
        for name in RANGES:
            self.assertEqual(rospy.wait_for_message(f'/{name}_range', Range, 10.0).header.frame_id, f'{name}_frame')

    def test_5_simulator_shares_nothing_but_its_serial_port(self):
        publishers, subscribers, services = rosgraph.Master('/bringup_test').getSystemState()
        published = {topic for topic, nodes in publishers if '/simulator' in nodes}
        self.assertLessEqual(published, {'/clock', '/ground_truth', '/diagnostics', '/rosout', '/simulator/obstacles'})
        self.assertEqual({topic for topic, nodes in subscribers if '/simulator' in nodes} - {'/clock'}, set())
        # Services are hands that reach into the world: nothing of the stack calls them.
        hands = {
            f'/simulator/{name}' for name in ('get_loggers', 'set_logger_level', 'fault', 'clear_faults', 'calibrate')
        }
        self.assertLessEqual({name for name, nodes in services if '/simulator' in nodes}, hands)
        readers = {node for topic, nodes in subscribers if topic == '/ground_truth' for node in nodes}
        self.assertEqual(readers & NODES, set())

    def test_6_simple_goal_moves_the_chair(self):
        start = rospy.wait_for_message('/ground_truth', Odometry).pose.pose.position
        publisher = rospy.Publisher('/move_base_simple/goal', PoseStamped, queue_size=1)
        while not publisher.get_num_connections():
            rospy.sleep(0.05)
        goal = PoseStamped()
        goal.header.frame_id, goal.header.stamp = 'map', rospy.Time.now()
        goal.pose.position.x, goal.pose.position.y, goal.pose.orientation.w = 2.0, 1.0, 1.0
        publisher.publish(goal)
        rospy.wait_for_message('/move_base/result', MoveBaseActionResult, PATIENCE_S)
        rospy.sleep(1.0)
        end = rospy.wait_for_message('/ground_truth', Odometry).pose.pose.position
        self.assertAlmostEqual(end.x - start.x, 1.0, delta=0.15)
        self.assertAlmostEqual(end.y - start.y, 0.0, delta=0.15)

    def test_7_no_error_lines(self):
        self.assertIn(
            '/move_base', {line.name for line in self.log}, 'the log must be heard for its silence to mean something'
        )
        errors = [f'{m.name}: {m.msg}' for m in self.log if m.level >= Log.ERROR]
        self.assertEqual(errors, [])


if __name__ == '__main__':
    rospy.init_node('bringup_test')
    rostest.rosrun('sara_bringup', 'bringup', BringupTest)
