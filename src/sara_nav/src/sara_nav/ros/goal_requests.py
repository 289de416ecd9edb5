"""Goals from clients: by action, and by topic as RViz sends them; and their results."""

import actionlib
import rospy
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult

from sara_common.planar import Pose2D
from sara_nav.goals.goal_input import GoalError
from sara_nav.goals.move_base_config import ABORTED, PREEMPTED, SUCCEEDED, StepResult
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.ros import conversions as conv
from sara_nav.ros.robot_inputs import RobotInputs


class GoalRequests:
    """Hands goals to the machine, and tells clients what comes of them. frame: the global one. cmd_vel: the publisher
    that stops the robot. ``refused``: how many goals were not taken; ``last_end``: how the last one ended, in words.
    """

    def __init__(self, machine: MoveBase, robot: RobotInputs, frame: str, cmd_vel: rospy.Publisher):
        self._machine, self._robot, self._frame, self._cmd_vel = machine, robot, frame, cmd_vel
        self._server = None
        self._current_goal = rospy.Publisher('~current_goal', PoseStamped, queue_size=1)
        self.refused, self.last_end = 0, ''

    def start(self) -> None:
        """Listen to clients."""
        self._server = actionlib.SimpleActionServer('move_base', MoveBaseAction, auto_start=False)
        self._server.start()
        status = self._server.action_server
        if status.status_timer is not None:  # actionlib's own ends when the clock is set back
            status.status_timer.shutdown()
            period = rospy.Duration(1.0 / status.status_frequency)
            status.status_timer = rospy.Timer(period, status.publish_status_async, reset=True)
        self._goals = rospy.Publisher('move_base/goal', MoveBaseActionGoal, queue_size=1)
        self._simple_subscriber = rospy.Subscriber(
            'move_base_simple/goal', PoseStamped, self._on_simple_goal, queue_size=1, tcp_nodelay=True
        )

    def _on_simple_goal(self, msg):
        action = MoveBaseActionGoal(goal=MoveBaseGoal(target_pose=msg))
        action.header.stamp = rospy.Time.now()
        self._goals.publish(action)

    @property
    def listening(self) -> bool:
        """True after ``start``."""
        return self._server is not None

    @property
    def waiting(self) -> bool:
        """True when a goal has come that was not taken yet."""
        return self.listening and self._server.is_new_goal_available()

    def time_went_back(self) -> None:
        """The clock was set back: whatever came before it is older than what comes from now on. actionlib takes no goal
        with a stamp before that of the last one, or of the last cancel.
        """
        server = self._server.action_server
        with server.lock:
            server.last_cancel = rospy.Time()
            for tracker in server.status_list:
                tracker.status.goal_id.stamp = rospy.Time()

    def take(self, t: float) -> None:
        """Take what clients have asked for by t (s): a goal, or that there be none."""
        if self._server.is_new_goal_available():
            self._accept(self._server.accept_new_goal(), t)
        if self._server.is_preempt_requested() and not self._server.is_new_goal_available():
            self._machine.cancel(t)

    def _accept(self, goal, t):
        try:
            pose = self._robot.global_pose(goal.target_pose)
        except GoalError as error:
            text = f'{error}.'
            self._machine.abort(text)
        else:
            text = self._machine.set_goal(pose, t)
        if text:
            self.refused += 1
            self._machine.take_end()  # it is said here
            self.finish(StepResult((0.0, 0.0), ABORTED, text))
            return
        rospy.loginfo('goal (%.2f, %.2f, %.2f rad)', pose.x, pose.y, pose.yaw)
        self.show(pose, rospy.Time.now())

    def show(self, pose: Pose2D, now: rospy.Time) -> None:
        """Publish where the robot drives to."""
        self._current_goal.publish(conv.pose_stamped(pose, self._frame, now))

    def feedback(self, pose: Pose2D, now: rospy.Time) -> None:
        """Tell the client where the robot is."""
        self._server.publish_feedback(MoveBaseFeedback(base_position=conv.pose_stamped(pose, self._frame, now)))

    def tell(self, text: str) -> None:
        """Say on the action's status what is being done; who sees it need not listen to anything else."""
        if self._server.is_active():
            self._server.current_goal.status_tracker.status.text = text

    def finish(self, result: StepResult) -> None:
        """Stand still and tell the client how it ended."""
        self._cmd_vel.publish(conv.twist_to_msg(*result.command))
        self.last_end = result.text
        if not self._server.is_active():
            return
        if result.status == SUCCEEDED:
            rospy.loginfo('%s', result.text)
            self._server.set_succeeded(MoveBaseResult(), result.text)
        elif result.status == PREEMPTED:
            rospy.loginfo('%s', result.text)
            self._server.set_preempted(MoveBaseResult(), result.text)
        else:
            rospy.logerr('%s', result.text)
            self._server.set_aborted(MoveBaseResult(), result.text)

    def give_up(self, text: str) -> None:
        """The node ends: tell the client that its goal is given up."""
        if self._server.is_active():
            self._server.set_aborted(MoveBaseResult(), text)
