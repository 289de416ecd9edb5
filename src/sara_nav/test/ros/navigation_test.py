#!/usr/bin/env python3
"""map_server and move_base wired together, driving a robot made up here: it obeys cmd_vel and publishes TF and odom.

It publishes /clock too, at twice real time.
"""
import math
import threading
import time
import unittest

import actionlib
import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionResult, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.srv import GetMap
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String


class FakeRobot:
    """Integrates cmd_vel at 50 Hz; map -> odom is a fixed shift, odom -> base_link the drive."""

    SHIFT = 0.5

    def __init__(self):
        self.x, self.y, self.yaw = 1.0, 1.0, 0.0
        self.v = self.w = 0.0
        self.command = (0.0, 0.0)
        self.last_command = None
        self.silent = False
        self.lock = threading.Lock()
        self.tf = tf2_ros.TransformBroadcaster()
        self.odom = rospy.Publisher('odom', Odometry, queue_size=1, tcp_nodelay=True)
        self.subscriber = rospy.Subscriber('cmd_vel', Twist, self.on_command, queue_size=1, tcp_nodelay=True)
        self.clock = rospy.Publisher('/clock', Clock, queue_size=1, tcp_nodelay=True)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()
        while rospy.Time.now().is_zero() and not rospy.is_shutdown():
            time.sleep(0.01)

    def on_command(self, msg):
        with self.lock:
            self.command = msg.linear.x, msg.angular.z
            self.last_command = rospy.Time.now()

    def run(self):
        """Let 10 ms pass every 5 ms, the robot moving every 20."""
        begin, ticks = time.monotonic(), 10000
        while not rospy.is_shutdown():
            now = rospy.Time(ticks // 100, ticks % 100 * 10 ** 7)
            try:
                self.clock.publish(now)
                if ticks % 2 == 0:
                    self.tick(now)
            except rospy.ROSException:  # the topics close when ROS shuts down
                return
            ticks += 1
            time.sleep(max(0.0, begin + 0.005 * (ticks - 10000) - time.monotonic()))

    def tick(self, now):
        with self.lock:
            self.v += (self.command[0] - self.v) * 0.18
            self.w += (self.command[1] - self.w) * 0.18
            self.x += self.v * 0.02 * math.cos(self.yaw)
            self.y += self.v * 0.02 * math.sin(self.yaw)
            self.yaw += self.w * 0.02 / 1.27
            if self.silent:
                return
            self.tf.sendTransform([self.transform('map', 'odom', self.SHIFT, 0.0, 0.0, now),
                                   self.transform('odom', 'base_link', self.x - self.SHIFT, self.y, self.yaw, now)])
            odom = Odometry(child_frame_id='base_link')
            odom.header.stamp, odom.header.frame_id = now, 'odom'
            odom.twist.twist.linear.x, odom.twist.twist.angular.z = self.v, self.w / 1.27
            self.odom.publish(odom)

    @staticmethod
    def transform(parent, child, x, y, yaw, stamp):
        msg = TransformStamped(child_frame_id=child)
        msg.header.frame_id, msg.header.stamp = parent, stamp
        msg.transform.translation.x, msg.transform.translation.y = x, y
        msg.transform.rotation.z, msg.transform.rotation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        return msg

    def put(self, x, y, yaw):
        with self.lock:
            self.x, self.y, self.yaw, self.v, self.w, self.silent = x, y, yaw, 0.0, 0.0, False


def stamped(x, y, yaw, frame='map'):
    msg = PoseStamped()
    msg.header.frame_id, msg.header.stamp = frame, rospy.Time.now()
    msg.pose.position.x, msg.pose.position.y = x, y
    msg.pose.orientation.z, msg.pose.orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    return msg


class NavigationTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot()
        cls.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        assert cls.client.wait_for_server(rospy.Duration(30.0)), 'no move_base action server'

    def setUp(self):
        self.robot.put(1.0, 1.0, 0.0)
        rospy.sleep(0.5)

    def ask(self, pose, wait=40.0):
        """Send a goal; return (state, text) of its end."""
        self.client.send_goal(MoveBaseGoal(target_pose=pose))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(wait)), 'the goal has no end')
        return self.client.get_state(), self.client.get_goal_status_text()

    def assert_at(self, x, y, yaw):
        self.assertLess(math.hypot(self.robot.x - x, self.robot.y - y), 0.07)
        self.assertLess(abs((self.robot.yaw - yaw + math.pi) % (2 * math.pi) - math.pi), math.radians(2.5))

    def assert_stands(self):
        self.assertEqual(self.robot.command, (0.0, 0.0))

    def start_driving(self):
        """Send a far goal and return once the robot drives."""
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(6.0, 1.0, 0.0)))
        end = rospy.Time.now() + rospy.Duration(10.0)
        while self.robot.v < 0.2:
            self.assertLess(rospy.Time.now(), end, 'the robot does not drive')
            rospy.sleep(0.05)

    def test_map_is_served(self):
        grid = rospy.wait_for_message('map', OccupancyGrid, 5.0)
        self.assertEqual((grid.info.width, grid.info.height, grid.header.frame_id), (160, 160, 'map'))
        self.assertEqual((grid.data[0], grid.data[170], grid.data[-1], grid.data[5 * 160 + 150]), (100, 0, 100, -1))
        rospy.wait_for_service('static_map', 5.0)
        self.assertEqual(rospy.ServiceProxy('static_map', GetMap)().map.data, grid.data)

    def test_costmap_is_published_as_the_peer_scales_it(self):
        grid = rospy.wait_for_message('move_base/global_costmap/costmap', OccupancyGrid, 5.0)
        row = grid.data[80 * 160:80 * 160 + 30]
        self.assertEqual(row[0], 100)
        self.assertEqual(set(row[1:6]), {99})
        self.assertTrue(all(0 <= b <= a <= 98 for a, b in zip(row[6:], row[7:])))
        self.assertEqual(row[-1], 0)

    def test_goal_by_action_is_reached(self):
        feedback = []
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(3.0, 1.0, math.pi / 2)), feedback_cb=feedback.append)
        self.assertTrue(self.client.wait_for_result(rospy.Duration(40.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.SUCCEEDED)
        self.assertEqual(self.client.get_goal_status_text(), 'Goal reached.')
        self.assertGreater(len(feedback), 50)
        self.assertLess(abs(feedback[-1].base_position.pose.position.x - 3.0), 0.07)
        self.assert_at(3.0, 1.0, math.pi / 2)
        self.assert_stands()

    def test_goal_by_topic_is_reached(self):
        results = []
        subscriber = rospy.Subscriber('move_base/result', MoveBaseActionResult, results.append, tcp_nodelay=True)
        publisher = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        while publisher.get_num_connections() == 0 or subscriber.get_num_connections() == 0:
            rospy.sleep(0.05)
        publisher.publish(stamped(1.0, 2.0, math.pi))
        end = rospy.Time.now() + rospy.Duration(40.0)
        while not results and rospy.Time.now() < end:
            rospy.sleep(0.05)
        self.assertEqual([r.status.status for r in results], [GoalStatus.SUCCEEDED])
        self.assert_at(1.0, 2.0, math.pi)

    def test_goal_in_another_frame_is_transformed(self):
        state, text = self.ask(stamped(1.5, 1.0, 0.0, frame='odom'))
        self.assertEqual((state, text), (GoalStatus.SUCCEEDED, 'Goal reached.'))
        self.assert_at(2.0, 1.0, 0.0)

    def test_cancel_stops_within_a_cycle(self):
        self.start_driving()
        asked = rospy.Time.now()
        self.client.cancel_goal()
        while self.robot.command != (0.0, 0.0) and (rospy.Time.now() - asked).to_sec() < 2.0:
            time.sleep(0.002)
        self.assertLess((rospy.Time.now() - asked).to_sec(), 0.2)  # a cycle of 50 ms, and the messages' way
        self.client.wait_for_result(rospy.Duration(2.0))
        self.assertEqual(self.client.get_state(), GoalStatus.PREEMPTED)
        rospy.sleep(0.3)
        self.assert_stands()

    def test_new_goal_preempts(self):
        self.start_driving()
        state, _ = self.ask(stamped(self.robot.x + 1.0, 1.0, 0.0))
        self.assertEqual(state, GoalStatus.SUCCEEDED)

    def test_refusals_say_why(self):
        nan, flat = stamped(2.0, 1.0, 0.0), stamped(2.0, 1.0, 0.0)
        nan.pose.position.x = float('nan')
        flat.pose.orientation.z = flat.pose.orientation.w = 0.0
        for goal, reason in ((stamped(-1.0, 1.0, 0.0), 'overlap an obstacle'), (stamped(50.0, 1.0, 0.0), 'off the map'),
                             (nan, 'NaN'), (flat, 'unit quaternion'), (stamped(1.0, 1.0, 0.0, 'nowhere'), 'nowhere'),
                             (stamped(1.0, 1.0, 0.0, ''), 'frame_id is empty')):
            state, text = self.ask(goal, 5.0)
            self.assertEqual(state, GoalStatus.ABORTED)
            self.assertIn(reason, text)
            self.assert_stands()

    def test_whoever_stops_the_robot_has_the_goal_aborted_in_his_words(self):
        abort = rospy.Publisher('/move_base/abort', String, queue_size=1)
        while not abort.get_num_connections():
            rospy.sleep(0.05)
        abort.publish('There is no goal to give up.')
        rospy.sleep(1.0)  # it goes another way than the goal
        self.start_driving()
        abort.publish('The wheels are off.')
        self.assertTrue(self.client.wait_for_result(rospy.Duration(2.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        self.assertIn('The wheels are off.', self.client.get_goal_status_text())
        self.assert_stands()

    def test_lost_localization_stops_and_aborts(self):
        self.start_driving()
        self.robot.silent = True
        self.assertTrue(self.client.wait_for_result(rospy.Duration(5.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        self.assertIn('transform_tolerance', self.client.get_goal_status_text())
        self.assert_stands()

    def test_diagnostics_name_the_node(self):
        names = set()
        end = rospy.Time.now() + rospy.Duration(5.0)
        while rospy.Time.now() < end and len(names) < 2:
            names |= {s.name for s in rospy.wait_for_message('/diagnostics', DiagnosticArray, 5.0).status}
        self.assertTrue({'move_base: navigation', 'map_server: map'} <= names, names)


if __name__ == '__main__':
    rospy.init_node('navigation_test')
    rostest.rosrun('sara_nav', 'navigation', NavigationTest)
