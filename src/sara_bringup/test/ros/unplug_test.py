#!/usr/bin/env python3
"""The adapter is pulled out while the chair drives: it stops, says so once, and after plugging back waits for the next
goal.
"""

import sys
from pathlib import Path

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu

from sara_bringup.ros.goals import goal_at
from sara_sim.srv import Fault

sys.path.append(str(Path(__file__).resolve().parent / 'support'))
from driving_chair import BRAKE, MOVING, SILENT_S, DrivingChair  # noqa: E402

OUT_S = 4.0


class UnplugTest(DrivingChair):
    @classmethod
    def setUpClass(cls):
        cls.log = []
        rospy.Subscriber('/rosout', Log, cls.log.append)
        super().setUpClass()

    def lines(self, *words):
        """What canserial has logged with these words in it."""
        return [line.msg for line in self.log if line.name == '/canserial' and all(word in line.msg for word in words)]

    def test_unplugged_while_driving(self):
        client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        client.wait_for_server()
        client.send_goal(goal_at((5.0, 1.0, 0.0)))
        self.wait(lambda: self.speed() > MOVING, 10.0, 'the chair drives')
        before = self.speed()
        del self.log[:]
        out = rospy.ServiceProxy('/simulator/fault', Fault)('adapter_unplugged', f'duration: {OUT_S}')
        self.assertTrue(out.success, out.message)
        pulled_at = self.now()
        self.wait(lambda: self.stood_at(pulled_at), 3.0, 'the chair stands')
        # The answer of the service and the truth at 50 Hz blur the moment by a tenth of a second.
        self.assertLess(self.stood_at(pulled_at) - pulled_at, SILENT_S + before / BRAKE + 0.25 + 0.1)
        self.assertTrue(client.wait_for_result(rospy.Duration(3.0)))
        self.assertEqual(client.get_state(), GoalStatus.ABORTED)
        self.assertIn('because', client.get_goal_status_text())

        self.wait(lambda: self.lines('is open'), 2.0 * OUT_S + 10.0, 'the adapter is open again')
        self.assertEqual(len(self.lines('is lost')), 1, self.lines('is lost'))
        for topic, kind in (
            ('/imu/data', Imu),
            ('/diff_drive_controller/odom', Odometry),
            ('/odometry/filtered', Odometry),
        ):
            rospy.wait_for_message(topic, kind, 5.0)
        stood = self.truth.pose.pose.position
        rospy.sleep(3.0)
        self.assertLess(
            abs(self.truth.pose.pose.position.x - stood.x) + abs(self.truth.pose.pose.position.y - stood.y), 0.005
        )

        # The way that nobody heard the wheels go is known again: the goal is a place, not a distance.
        client.send_goal(goal_at((stood.x + 0.8, 1.0, 0.0)))
        self.assertTrue(client.wait_for_result(rospy.Duration(20.0)))
        self.assertEqual(client.get_state(), GoalStatus.SUCCEEDED, client.get_goal_status_text())
        self.assertAlmostEqual(self.truth.pose.pose.position.x, stood.x + 0.8, delta=0.1)


if __name__ == '__main__':
    rospy.init_node('unplug_test')
    rostest.rosrun('sara_bringup', 'unplug', UnplugTest)
