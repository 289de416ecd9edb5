"""Goals from clients: by action, and by topic as RViz sends them; and their results."""

import rospy
from move_base_msgs.msg import (
    MoveBaseActionGoal,
    MoveBaseGoal,
    MoveBaseResult,
)

from sara_nav.goals.goal_input import GoalError
from sara_nav.goals.move_base_config import ABORTED, PREEMPTED, SUCCEEDED, StepResult
from sara_nav.ros import conversions as conv


class GoalRequests:
    """How MoveBaseNode takes goals and says what came of them; a part of it."""

    def _on_simple_goal(self, msg):
        action = MoveBaseActionGoal(goal=MoveBaseGoal(target_pose=msg))
        action.header.stamp = rospy.Time.now()
        self._goal_publisher.publish(action)

    def _take_requests(self, t):
        if self.server.is_new_goal_available():
            self._accept(self.server.accept_new_goal(), t)
        if self.server.is_preempt_requested() and not self.server.is_new_goal_available():
            self.machine.cancel(t)

    def _accept(self, goal, t):
        try:
            pose = self.robot.global_pose(goal.target_pose)
        except GoalError as error:
            text = f'{error}.'
            self.machine.abort(text)
        else:
            text = self.machine.set_goal(pose, t)
        if text:
            self.counts['refused_goals'] += 1
            self.machine.take_end()  # it is said here
            self._finish(StepResult((0.0, 0.0), ABORTED, text))
            return
        rospy.loginfo('goal (%.2f, %.2f, %.2f rad)', pose.x, pose.y, pose.yaw)
        self.current_goal.publish(conv.pose_stamped(pose, self.settings.global_frame, rospy.Time.now()))

    def _finish(self, result):
        """Stand still and tell the client how it ended."""
        self.cmd_vel.publish(conv.twist_to_msg(*result.command))
        self.last_end = result.text
        if not self.server.is_active():
            return
        if result.status == SUCCEEDED:
            rospy.loginfo('%s', result.text)
            self.server.set_succeeded(MoveBaseResult(), result.text)
        elif result.status == PREEMPTED:
            rospy.loginfo('%s', result.text)
            self.server.set_preempted(MoveBaseResult(), result.text)
        else:
            rospy.logerr('%s', result.text)
            self.server.set_aborted(MoveBaseResult(), result.text)
