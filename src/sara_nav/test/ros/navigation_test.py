#!/usr/bin/env python3
"""map_server and move_base wired together, driving a robot made up here: it obeys cmd_vel and publishes TF and odom.

It publishes /clock too, at twice real time.
"""

import math
import os
import sys
import unittest
from types import SimpleNamespace

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionResult, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid, Path
from nav_msgs.srv import GetMap
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from sara_common.ros.clock import Clock
from sara_nav.ros.common import TransformListener
from sara_nav.ros.robot_inputs import RobotInputs

sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))
from fake_robot import FakeRobot, is_connected, stamped  # noqa: E402


def keep_out(x, y, value=100):
    """A mask of 0.4 m square about a place, without an orientation, as messages are made."""
    msg = OccupancyGrid()
    msg.header.frame_id = 'map'
    msg.info.resolution, msg.info.width, msg.info.height = 0.05, 8, 8
    msg.info.origin.position.x, msg.info.origin.position.y = x - 0.2, y - 0.2
    msg.data = [value] * 64
    return msg


def frames(world, local, base):
    """Settings of RobotInputs with these frames."""
    planner = SimpleNamespace(config=None)
    return SimpleNamespace(global_frame=world, local_frame=local, robot_base_frame=base, local_planner=planner)


class NavigationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot()
        cls.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        assert cls.client.wait_for_server(rospy.Duration(120.0)), 'no move_base action server'

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
        self.assertTrue(
            self.robot.stands_within(0.3)
        )  # the zero command goes out first, but on a connection of its own

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
        row = grid.data[80 * 160 : 80 * 160 + 30]
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

    def test_the_status_of_the_goal_says_what_is_being_done(self):
        said = []
        subscriber = rospy.Subscriber(
            'move_base/status',
            GoalStatusArray,
            lambda message: said.extend(
                status.text for status in message.status_list if status.status == GoalStatus.ACTIVE
            ),
        )
        self.start_driving()
        end = rospy.Time.now() + rospy.Duration(5.0)
        while 'follows the path, 0.80 m/s' not in said and rospy.Time.now() < end:
            rospy.sleep(0.05)
        self.client.cancel_goal()
        self.client.wait_for_result(rospy.Duration(5.0))
        subscriber.unregister()
        self.assertIn('follows the path, 0.80 m/s', said)

    def test_cancel_stops_within_a_cycle(self):
        self.start_driving()
        self.robot.cancel(self.client)
        self.assertTrue(self.robot.stands_within(0.2))  # a cycle of 50 ms, and the messages' way
        self.client.wait_for_result(rospy.Duration(20.0))
        self.assertEqual(self.client.get_state(), GoalStatus.PREEMPTED)
        rospy.sleep(0.3)
        self.assert_stands()

    def test_new_goal_preempts(self):
        self.start_driving()
        state, _ = self.ask(stamped(self.robot.x + 1.0, 1.0, 0.0))
        self.assertEqual(state, GoalStatus.SUCCEEDED)

    def test_a_mask_is_planned_on_where_it_lies_on_the_plan(self):
        plans = []
        heard = rospy.Subscriber('move_base/LatticePlanner/plan', Path, plans.append)
        masks = rospy.Publisher('keepout_filter_mask', OccupancyGrid, queue_size=1)
        while not (masks.get_num_connections() and is_connected(heard)):
            rospy.sleep(0.05)
        idle = rospy.Time.now() - rospy.Duration(0.3)  # setUp waits for longer
        self.start_driving()
        end = rospy.Time.now() + rospy.Duration(5.0)
        while not (plans and plans[-1].header.stamp > idle):  # it comes by another connection than the command
            self.assertLess(rospy.Time.now(), end, 'no plan is published')
            rospy.sleep(0.05)
        before = len(plans)
        for k in range(10):
            masks.publish(keep_out(1.0 + 0.1 * k, 5.0))
            rospy.sleep(0.2)
        self.assertEqual(len(plans), before)
        masks.publish(keep_out(self.robot.x + 1.5, 1.0))
        end = rospy.Time.now() + rospy.Duration(5.0)
        while len(plans) == before:
            self.assertLess(rospy.Time.now(), end, 'a mask on the plan is not planned on')
            rospy.sleep(0.05)
        self.client.cancel_goal()
        masks.publish(keep_out(0.0, 0.0, 0))  # and `masks` stays: what is on its way would be lost with it
        heard.unregister()

    def test_refusals_say_why(self):
        nan, flat = stamped(2.0, 1.0, 0.0), stamped(2.0, 1.0, 0.0)
        nan.pose.position.x = float('nan')
        flat.pose.orientation.z = flat.pose.orientation.w = 0.0
        for goal, reason in (
            (stamped(-1.0, 1.0, 0.0), 'overlap an obstacle'),
            (stamped(50.0, 1.0, 0.0), 'off the map'),
            (nan, 'NaN'),
            (flat, 'unit quaternion'),
            (stamped(1.0, 1.0, 0.0, 'nowhere'), 'nowhere'),
            (stamped(1.0, 1.0, 0.0, ''), 'frame_id is empty'),
        ):
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

    def test_when_the_clock_is_set_back_the_goal_ends_and_the_next_one_is_driven_to(self):
        self.start_driving()
        self.robot.clock_back = 60
        self.assertTrue(self.client.wait_for_result())
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        self.assertIn('time went back', self.client.get_goal_status_text())
        self.assert_stands()
        said = []
        subscriber = rospy.Subscriber('move_base/status', GoalStatusArray, said.append)
        self.assertEqual(self.ask(stamped(self.robot.x + 0.5, 1.0, 0.0)), (GoalStatus.SUCCEEDED, 'Goal reached.'))
        subscriber.unregister()
        self.assertGreater(len(said), 5, 'its status goes on')
        place = rospy.wait_for_message('rolling/costmap/costmap', OccupancyGrid, 5.0).info.origin.position
        self.assertAlmostEqual(place.x + 2.0, self.robot.x - FakeRobot.SHIFT, delta=0.2)

    def test_lost_localization_stops_and_aborts(self):
        tolerances = [Client(f'move_base/{name}_costmap', timeout=20.0) for name in ('global', 'local')]
        tuned = [client.update_configuration({'transform_tolerance': 0.4}) for client in tolerances]
        self.assertEqual([config['transform_tolerance'] for config in tuned], [0.4, 0.5])  # the local one has no effect
        self.start_driving()
        self.robot.silent = True
        self.assertTrue(self.client.wait_for_result(rospy.Duration(5.0)))
        self.assertEqual(self.client.get_state(), GoalStatus.ABORTED)
        self.assertIn('0.40 s (transform_tolerance)', self.client.get_goal_status_text())
        self.assert_stands()
        tolerances[0].update_configuration({'restore_defaults': True})
        for client in tolerances:
            client.close()

    def test_the_pose_is_the_newest_odometry_on_the_newest_correction_though_that_is_dated_ahead(self):
        tf = TransformListener()
        settings = frames('hall', 'wheels', 'body')
        inputs = RobotInputs(settings, tf)
        self.assertEqual(inputs.poses(), (None, None, None))
        self.assertIn('hall', inputs.problem)

        def heard(parent, child, x, yaw, seconds):
            tf._add(TFMessage([FakeRobot.transform(parent, child, x, 0.0, yaw, rospy.Time.from_sec(seconds))]), False)

        for k in range(4):
            heard('wheels', 'axle', 1.0 + k, 0.0, 100.0 + 0.1 * k)
            heard('axle', 'body', 0.5, 0.0, 100.0 + 0.1 * k)
            heard('hall', 'wheels', 10.0 * k, 0.0, 100.05 + 0.1 * k)
        pose, stamp, local = inputs.poses()
        self.assertAlmostEqual(
            tf.latest('hall', 'body').transform.translation.x, 29.5, 5
        )  # 4.5 on 25.0, half a period old
        self.assertAlmostEqual(pose.x, 34.5, 5)
        self.assertAlmostEqual(stamp, 100.3, 5)
        self.assertAlmostEqual(local.x, 4.5, 5)
        heard('wheels', 'axle', 5.0, 0.0, 100.8)
        heard('axle', 'body', 0.5, 0.0, 100.8)
        self.assertAlmostEqual(inputs.poses()[1], 100.35, 5)  # who corrects is silent: that is how old the pose is
        settings.global_frame = 'axle'
        self.assertAlmostEqual(RobotInputs(settings, tf).poses()[0].x, 0.5, 5)

    def test_a_robot_on_a_slope_has_a_pose_and_one_that_lies_on_its_side_has_none(self):
        tf = TransformListener()
        settings = frames('slope', 'slope', 'rider')
        for pitch in (0.1, 1.5):
            s, c = math.sin(0.5 * pitch), math.cos(0.5 * pitch)
            tipped = FakeRobot.transform('slope', 'rider', 1.0, 0.0, 1.0, rospy.Time.from_sec(100.0 + pitch))
            q = tipped.transform.rotation
            q.x, q.y, q.z, q.w = -q.z * s, q.w * s, q.z * c, q.w * c
            tf._add(TFMessage([tipped]), False)
            pose = RobotInputs(settings, tf).poses()[0]
            self.assertEqual(pose is None, pitch > 1.0)
            self.assertTrue(pose is None or abs(pose.yaw - 1.0) < 1e-6)

    def test_what_was_heard_before_the_clock_was_set_back_is_forgotten(self):
        clock, tf = Clock(map(rospy.Time, (100, 100, 95, 96)).__next__), TransformListener()
        self.assertEqual([clock.went_back() for _ in range(4)], [0.0, 0.0, 5.0, 0.0])
        for subscriber in tf._subscribers:  # what the robot says would be taken to come after another setting back
            subscriber.unregister()
        for back, seconds, x in ((0.0, 100.0, 1.0), (5.0, 95.0, 2.0)):
            tf._clock = SimpleNamespace(went_back=lambda back=back: back)
            tf._add(TFMessage([FakeRobot.transform('yard', 'mower', x, 0.0, 0.0, rospy.Time.from_sec(seconds))]), False)
        self.assertEqual(tf.latest('yard', 'mower').transform.translation.x, 2.0)

    def test_diagnostics_name_the_node(self):
        # one subscriber for both: a new one for each message may miss the same node every time
        names, wanted = set(), {'move_base: navigation', 'map_server: map'}
        heard = rospy.Subscriber(
            '/diagnostics', DiagnosticArray, lambda array: names.update(s.name for s in array.status)
        )
        end = rospy.Time.now() + rospy.Duration(40.0)
        while rospy.Time.now() < end and not wanted <= names:
            rospy.sleep(0.05)
        heard.unregister()
        self.assertLessEqual(wanted, names)


if __name__ == '__main__':
    rospy.init_node('navigation_test')
    rostest.rosrun('sara_nav', 'navigation', NavigationTest)
