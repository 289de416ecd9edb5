#!/usr/bin/env python3
"""read, diff_drive_controller, the filter and range_localization in one process: the same topics and services; killed
while the chair drives, it leaves a chair that stops in the times of docs/safety.md.
"""

import os
import signal
import unittest
from xmlrpc.client import ServerProxy

import actionlib
import rosgraph
import rosnode
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_bringup.ros.goals import goal_at

NODE = '/composed'
TOPICS = {
    '/imu/data',
    '/encoders',
    '/SDI_range',
    '/battery',
    '/diff_drive_controller/odom',
    '/joint_states',
    '/odometry/reckoned',
    '/odometry/filtered',
    '/tf',
}
SERVICES = {'/read/calibrate', '/diff_drive_controller/set_parameters', '/ekf_se/reset', '/global_localization'}
MOVING, AT_REST = 0.4, 0.05  # m/s
SILENT_S, BRAKE = 0.25, 1.5  # s until no frame, or no encoder, is a hazard; m/s2


class ComposedTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.truth = None
        rospy.Subscriber(
            '/ground_truth', Odometry, lambda message: setattr(cls, 'truth', message), queue_size=1, tcp_nodelay=True
        )
        rospy.wait_for_message('/imu/data', Imu)
        rospy.wait_for_message('/odometry/filtered', Odometry)

    def speed(self):
        """True speed, m/s."""
        return abs(self.truth.twist.twist.linear.x)

    def wait(self, condition, seconds, what):
        end = rospy.get_time() + seconds
        while not condition():
            self.assertLess(rospy.get_time(), end, f'not within {seconds} s: {what}')
            rospy.sleep(0.01)

    def test_it_is_one_node_with_the_topics_of_four_and_the_chair_stops_when_it_is_killed(self):
        published, _, services = rosgraph.Master('/test').getSystemState()
        own = {topic for topic, nodes in published if NODE in nodes}
        self.assertLessEqual(TOPICS, own)
        self.assertLessEqual(SERVICES, {service for service, nodes in services if NODE in nodes})
        self.assertFalse({'/read', '/ekf_se', '/range_localization'} & set(rosnode.get_node_names()))

        client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        client.wait_for_server()
        client.send_goal(goal_at((1.6, 1.0, 0.0)))
        self.assertTrue(client.wait_for_result(rospy.Duration(20.0)))
        self.assertEqual(client.get_state(), GoalStatus.SUCCEEDED, client.get_goal_status_text())
        self.assertAlmostEqual(self.truth.pose.pose.position.x, 1.6, delta=0.1)

        client.send_goal(goal_at((5.0, 1.0, 0.0)))
        self.wait(lambda: self.speed() > MOVING, 10.0, 'the chair drives')
        pid = pid_of(NODE)
        before, killed_at = self.speed(), self.truth.header.stamp.to_sec()
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: self.speed() < AT_REST, 3.0, 'the chair stands')
        # The signal and the truth at 50 Hz blur the moment by a tenth of a second.
        took = self.truth.header.stamp.to_sec() - killed_at
        self.assertLess(took, SILENT_S + before / BRAKE + 0.25 + 0.1)
        self.assertTrue(client.wait_for_result(rospy.Duration(3.0)))
        self.assertEqual(client.get_state(), GoalStatus.ABORTED)
        self.assertIn('because', client.get_goal_status_text())


def pid_of(name):
    """The process of a node, as it says itself."""
    code, _, pid = ServerProxy(rosgraph.Master('/test').lookupNode(name)).getPid('/test')
    assert code == 1
    return pid


if __name__ == '__main__':
    rospy.init_node('composed_drive_test')
    rostest.rosrun('sara_bringup', 'composed_drive', ComposedTest)
