#!/usr/bin/env python3
"""make_plan, clear_costmaps, dynamic_reconfigure and the planners' topics of move_base, on the wires."""

import math
import os
import sys
import time
import unittest

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid, Path
from nav_msgs.srv import GetPlan, GetPlanRequest
from sensor_msgs.msg import PointCloud2, Range
from std_srvs.srv import Empty

sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))
from fake_robot import FakeRobot, is_connected, stamped  # noqa: E402


class ServicesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = FakeRobot()
        cls.client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        assert cls.client.wait_for_server(rospy.Duration(60.0)), 'no move_base action server'
        cls.make_plan = rospy.ServiceProxy('move_base/make_plan', GetPlan)

    def setUp(self):
        self.robot.put(1.0, 1.0, 0.0)
        rospy.sleep(0.5)

    def wait(self, what, text, seconds=20.0):
        end = rospy.Time.now() + rospy.Duration(seconds)
        while not what():
            self.assertLess(rospy.Time.now(), end, text)
            time.sleep(0.005)

    # -- make_plan ---------------------------------------------------------------------------------------------

    def test_make_plan_from_the_robot_and_from_elsewhere(self):
        plan = self.make_plan(GetPlanRequest(goal=stamped(5.0, 3.0, 1.0))).plan
        self.assertEqual(plan.header.frame_id, 'map')
        first, last = plan.poses[0].pose, plan.poses[-1].pose
        self.assertLess(math.hypot(first.position.x - 1.0, first.position.y - 1.0), 0.1)
        self.assertEqual((last.position.x, last.position.y), (5.0, 3.0))
        self.assertAlmostEqual(last.orientation.z, math.sin(0.5))
        plan = self.make_plan(
            GetPlanRequest(start=stamped(1.5, 3.0, 0.0, frame='odom'), goal=stamped(5.0, 3.0, 1.0))
        ).plan
        self.assertLess(math.hypot(plan.poses[0].pose.position.x - 2.0, plan.poses[0].pose.position.y - 3.0), 0.1)

    def test_a_goal_in_the_wall_is_planned_to_within_the_tolerance(self):
        self.assertEqual(self.make_plan(GetPlanRequest(goal=stamped(-0.99, 3.0, 0.0))).plan.poses, [])
        poses = self.make_plan(GetPlanRequest(goal=stamped(-0.99, 3.0, 0.0), tolerance=1.0)).plan.poses
        self.assertAlmostEqual(poses[-1].pose.position.x, -0.99)  # make_plan_add_unreachable_goal
        self.assertGreater(poses[-2].pose.position.x, -0.8)
        self.assertLess(poses[-2].pose.position.x, 0.02)

    def test_make_plan_is_refused_with_the_reason(self):
        for request, reason in (
            (GetPlanRequest(goal=stamped(5.0, 3.0, 0.0, frame='nowhere')), 'nowhere'),
            (GetPlanRequest(goal=PoseStamped()), 'frame_id is empty'),
            (GetPlanRequest(goal=stamped(float('nan'), 3.0, 0.0)), 'NaN'),
        ):
            with self.assertRaisesRegex(rospy.ServiceException, reason):
                self.make_plan(request)

    def test_make_plan_is_refused_while_a_goal_is_driven_to(self):
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(6.0, 1.0, 0.0)))
        self.wait(lambda: self.robot.v > 0.1, 'the robot does not drive')
        with self.assertRaisesRegex(rospy.ServiceException, 'must be in an inactive state'):
            self.make_plan(GetPlanRequest(goal=stamped(5.0, 3.0, 0.0)))
        self.robot.cancel(self.client)
        self.assertTrue(self.robot.stands_within(0.5))

    def test_the_planners_own_make_plan(self):
        plan = rospy.ServiceProxy('move_base/NavfnROS/make_plan', GetPlan)(
            GetPlanRequest(start=stamped(1.0, 1.0, 0.0), goal=stamped(5.0, 3.0, 1.0))
        ).plan
        self.assertGreater(len(plan.poses), 50)

    # -- costmaps ----------------------------------------------------------------------------------------------

    def test_clear_costmaps_forgets_what_sensors_saw(self):
        grids = []
        subscriber = rospy.Subscriber('move_base/local_costmap/costmap', OccupancyGrid, grids.append)
        publisher = rospy.Publisher('/SDI_range', Range, queue_size=1)

        def obstacles():
            grid = grids[-1]
            self.assertEqual(grid.header.frame_id, 'odom')
            column = int((2.54 - FakeRobot.SHIFT - grid.info.origin.position.x) / grid.info.resolution)
            row = int((1.0 - grid.info.origin.position.y) / grid.info.resolution)
            return sum(
                grid.data[r * grid.info.width + column + c] == 100
                for r in range(row - 3, row + 4)
                for c in range(-3, 4)
            )

        def seen():
            msg = Range(radiation_type=Range.ULTRASOUND, field_of_view=0.5, min_range=0.16, max_range=2.5, range=1.0)
            msg.header.frame_id, msg.header.stamp = 'SDI_frame', rospy.Time.now()
            publisher.publish(msg)
            time.sleep(0.05)
            return grids and obstacles()

        self.wait(seen, 'what the sensor sees is not in the costmap')
        rospy.sleep(1.0)
        self.assertTrue(obstacles(), 'forgotten by itself')
        rospy.ServiceProxy('move_base/clear_costmaps', Empty)()
        self.wait(lambda: not obstacles(), 'still there')
        subscriber.unregister()

    # -- planners' topics --------------------------------------------------------------------------------------

    def test_driving_the_planners_show_what_they_do(self):
        got = {}
        kinds = {
            'NavfnROS/plan': Path,
            'NavfnROS/potential': PointCloud2,
            'TrajectoryPlannerROS/global_plan': Path,
            'TrajectoryPlannerROS/local_plan': Path,
            'TrajectoryPlannerROS/cost_cloud': PointCloud2,
            'current_goal': PoseStamped,
        }
        subscribers = [
            rospy.Subscriber('move_base/' + name, kind, lambda msg, name=name: got.setdefault(name, msg))
            for name, kind in kinds.items()
        ]
        self.wait(lambda: all(map(is_connected, subscribers)), 'not all is advertised')
        rospy.sleep(1.0)
        got.clear()
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(3.0, 1.0, 0.0)))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(60.0)))
        self.assertEqual(
            (self.client.get_state(), self.client.get_goal_status_text()), (GoalStatus.SUCCEEDED, 'Goal reached.')
        )
        self.assertEqual(set(got), set(kinds))
        self.assertGreater(len(got['NavfnROS/plan'].poses), 10)
        self.assertLess(len(got['TrajectoryPlannerROS/local_plan'].poses), 200)
        self.assertEqual([f.name for f in got['NavfnROS/potential'].fields], ['x', 'y', 'z', 'pot'])
        self.assertEqual(
            [f.name for f in got['TrajectoryPlannerROS/cost_cloud'].fields],
            ['x', 'y', 'z', 'path_cost', 'goal_cost', 'occ_cost', 'total_cost'],
        )
        self.assertGreater(got['TrajectoryPlannerROS/cost_cloud'].width, 100)
        for subscriber in subscribers:
            subscriber.unregister()

    # -- dynamic_reconfigure -----------------------------------------------------------------------------------

    def test_parameters_of_move_base_can_be_changed_and_bad_values_are_not_taken(self):
        client = Client('move_base', timeout=20.0)
        before = client.get_configuration()
        self.assertEqual((before['controller_patience'], before['planner_frequency']), (15.0, 0.0))
        after = client.update_configuration({'planner_frequency': 2.0, 'oscillation_timeout': 45.0})
        self.assertEqual((after['planner_frequency'], after['oscillation_timeout']), (2.0, 45.0))
        self.assertEqual(after['controller_patience'], 15.0, "the peer's falls to 5 s")
        self.assertEqual(rospy.get_param('move_base/planner_frequency'), 2.0)
        self.assertEqual(client.update_configuration({'planner_frequency': 1e6})['planner_frequency'], 100.0)
        limits = {entry['name']: (entry['min'], entry['max']) for entry in client.get_parameter_descriptions()}
        self.assertEqual(limits['controller_frequency'], (0.0, 100.0))  # those of the peer's MoveBase.cfg
        self.assertEqual(limits['oscillation_timeout'], (0.0, 60.0))
        self.assertEqual(client.update_configuration({'controller_frequency': 0.0})['controller_frequency'], 20.0)
        self.assertEqual(
            client.update_configuration({'base_local_planner': 'teb/Teb'})['base_local_planner'],
            'base_local_planner/TrajectoryPlannerROS',
        )
        restored = client.update_configuration({'restore_defaults': True})
        self.assertFalse(restored['restore_defaults'])
        for name in ('planner_frequency', 'oscillation_timeout'):
            self.assertEqual(restored[name], before[name])
        client.close()

    def test_planners_can_be_changed_and_tuned(self):
        tuner = Client('move_base/TrajectoryPlannerROS', timeout=20.0)
        self.assertEqual(tuner.get_configuration()['max_vel_x'], 0.4)
        self.assertNotIn('xy_goal_tolerance', tuner.get_configuration())  # the peer does not let it be changed either
        tuner.update_configuration({'max_vel_x': 0.2})
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(3.0, 1.0, 0.0)))
        fastest, end = 0.0, rospy.Time.now() + rospy.Duration(4.0)
        while rospy.Time.now() < end:
            fastest = max(fastest, self.robot.command[0])
            time.sleep(0.01)
        self.assertAlmostEqual(fastest, 0.2, 2)
        self.robot.cancel(self.client)
        self.assertTrue(self.robot.stands_within(0.5))
        tuner.close()
        client = Client('move_base', timeout=20.0)
        client.update_configuration(
            {
                'base_local_planner': 'dwa_local_planner/DWAPlannerROS',
                'base_global_planner': 'global_planner/GlobalPlanner',
            }
        )
        tuner = Client('move_base/DWAPlannerROS', timeout=20.0)
        self.assertEqual(tuner.get_configuration()['sim_time'], 1.7)
        tuner.close()
        plan = rospy.ServiceProxy('move_base/GlobalPlanner/make_plan', GetPlan)
        self.assertGreater(len(plan(GetPlanRequest(goal=stamped(5.0, 3.0, 1.0))).plan.poses), 50)
        got = {}
        kinds = {
            'GlobalPlanner/potential': OccupancyGrid,
            'DWAPlannerROS/trajectory_cloud': PointCloud2,
            'DWAPlannerROS/cost_cloud': PointCloud2,
        }
        subscribers = [
            rospy.Subscriber('move_base/' + name, kind, lambda msg, name=name: got.setdefault(name, msg))
            for name, kind in kinds.items()
        ]
        self.wait(lambda: all(map(is_connected, subscribers)), 'not all is advertised')
        rospy.sleep(1.0)
        self.client.send_goal(MoveBaseGoal(target_pose=stamped(3.0, 1.0, 0.0)))
        self.wait(lambda: len(got) == len(kinds), f'not all is published: {set(got)}')
        self.robot.cancel(self.client)
        self.assertTrue(self.robot.stands_within(0.5))
        potential = got['GlobalPlanner/potential']
        self.assertEqual((len(potential.data), max(potential.data), min(potential.data)), (160 * 160, 100, -1))
        self.assertEqual(got['DWAPlannerROS/trajectory_cloud'].header.frame_id, 'odom')
        self.assertEqual(
            [f.name for f in got['DWAPlannerROS/trajectory_cloud'].fields], ['x', 'y', 'z', 'theta', 'cost']
        )
        for subscriber in subscribers:
            subscriber.unregister()
        client.update_configuration({'restore_defaults': True})
        client.close()

    def test_a_layer_can_be_tuned(self):
        client = Client('move_base/global_costmap/inflation_layer', timeout=20.0)
        self.assertEqual(client.update_configuration({'inflation_radius': 0.9})['inflation_radius'], 0.9)
        client.update_configuration({'restore_defaults': True})
        client.close()


if __name__ == '__main__':
    rospy.init_node('services_test')
    rostest.rosrun('sara_nav', 'services', ServicesTest)
