#!/usr/bin/env python3
"""canserial, read, diff_drive_controller, the filter, range_localization and map_server in one process: the same topics
and services; killed while the chair drives, it leaves a chair that stops in the times of docs/safety.md.
"""

import os
import signal
import sys
from pathlib import Path

import actionlib
import rosgraph
import rosnode
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction

from sara_bringup.ros.goals import goal_at
from sara_bringup.ros.processes import process_of

sys.path.append(str(Path(__file__).resolve().parent / 'support'))
from driving_chair import BRAKE, MOVING, SILENT_S, DrivingChair  # noqa: E402

NODE = '/composed'
TOPICS = {
    '/canrx',
    '/map',
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
SERVICES = {
    '/static_map',
    '/read/calibrate',
    '/diff_drive_controller/set_parameters',
    '/ekf_se/reset',
    '/global_localization',
}


class ComposedTest(DrivingChair):
    def test_it_is_one_node_with_the_topics_of_six_and_the_chair_stops_when_it_is_killed(self):
        def missing():
            """What it does not offer yet."""
            published, _, services = rosgraph.Master('/test').getSystemState()
            return (TOPICS | SERVICES) - {name for name, nodes in published + services if NODE in nodes}

        self.wait(lambda: not missing(), 30.0, 'all topics and services')
        self.assertEqual(missing(), set())
        self.assertFalse(
            {'/canserial', '/read', '/ekf_se', '/range_localization', '/map_server'} & set(rosnode.get_node_names())
        )

        client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        client.wait_for_server()
        client.send_goal(goal_at((1.6, 1.0, 0.0)))
        self.assertTrue(client.wait_for_result(rospy.Duration(20.0)))
        self.assertEqual(client.get_state(), GoalStatus.SUCCEEDED, client.get_goal_status_text())
        self.assertAlmostEqual(self.truth.pose.pose.position.x, 1.6, delta=0.1)

        client.send_goal(goal_at((5.0, 1.0, 0.0)))
        self.wait(lambda: self.speed() > MOVING, 10.0, 'the chair drives')
        pid = process_of(NODE)
        before, killed_at = self.speed(), self.now()
        os.kill(pid, signal.SIGKILL)
        self.wait(lambda: self.stood_at(killed_at), 3.0, 'the chair stands')
        # The signal and the truth at 50 Hz blur the moment by a tenth of a second.
        took = self.stood_at(killed_at) - killed_at
        self.assertLess(took, SILENT_S + before / BRAKE + 0.25 + 0.1)
        self.assertTrue(client.wait_for_result(rospy.Duration(3.0)))
        self.assertEqual(client.get_state(), GoalStatus.ABORTED)
        self.assertIn('because', client.get_goal_status_text())


if __name__ == '__main__':
    rospy.init_node('composed_drive_test')
    rostest.rosrun('sara_bringup', 'composed_drive', ComposedTest)
