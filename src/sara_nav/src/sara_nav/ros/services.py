"""move_base's services: ~make_plan, ~clear_costmaps and ~<planner>/make_plan."""

from typing import Any

import rospy
from nav_msgs.srv import GetPlan, GetPlanResponse
from std_srvs.srv import Empty, EmptyResponse

from sara_nav.goals.goal_input import GoalError
from sara_nav.goals.goal_search import GivenUp
from sara_nav.ros import conversions as conv
from sara_nav.ros.publishers import short_name


class Services:
    """Answers from the machine while no control cycle runs (``node.lock``). What is wrong is the caller's error
    text.
    """

    def __init__(self, node: Any):
        self._node = node
        self._of_planner = None
        self._make_plan = rospy.Service('~make_plan', GetPlan, self._on_make_plan)
        self._clear = rospy.Service('~clear_costmaps', Empty, self._on_clear)
        self.offer(node.machine.global_planner)

    def offer(self, planner: Any) -> None:
        """Answer for this planner under its name; for no other any more."""
        if self._of_planner is not None:
            self._of_planner.shutdown('another planner is used')
        self._of_planner = rospy.Service(f'~{short_name(planner)}/make_plan', GetPlan, self._on_planners_make_plan)

    def _poses(self, request):
        """Return start and goal (Pose2D, global frame) of a request; a start without a frame is the robot's pose."""
        node = self._node
        if request.start.header.frame_id:
            start = node.robot.global_pose(request.start)
        else:
            start = node.robot.poses()[0]
            if start is None:
                raise GoalError(
                    'move_base cannot make a plan for you because it could not get the start pose of the robot'
                )
        return start, node.robot.global_pose(request.goal)

    def _on_make_plan(self, request):
        node = self._node
        try:
            start, goal = self._poses(request)
            with node.lock:
                plan, text = node.machine.make_plan(rospy.get_time(), start, goal, request.tolerance, node.is_wanted)
        except GivenUp:
            raise rospy.ServiceException('given up, because a goal came') from None
        except ValueError as error:
            rospy.logerr('%s', error)
            raise rospy.ServiceException(str(error)) from None
        if text:
            rospy.logwarn('make_plan: %s', text)
        return self._answer(plan)

    def _on_planners_make_plan(self, request):
        node = self._node
        try:
            start, goal = self._poses(request)
            with node.lock:
                node.machine.costmaps.ensure(rospy.get_time())
                plan, text = node.machine.plans.of_planner(start, goal, node.machine.active)
        except ValueError as error:
            rospy.logerr('%s', error)
            raise rospy.ServiceException(str(error)) from None
        if text:
            rospy.logwarn('make_plan: %s', text)
        return self._answer(plan)

    def _answer(self, plan):
        """Return the response; a plan that there is not has no poses, as the peer has it."""
        frame, now = self._node.settings.global_frame, rospy.Time.now()
        response = GetPlanResponse()
        response.plan.header.frame_id, response.plan.header.stamp = frame, now
        if plan is not None:
            response.plan = conv.path_to_msg(plan, frame, now)
        return response

    def _on_clear(self, _request):
        node = self._node
        pose, _, local_pose = node.robot.poses()
        with node.lock:
            node.machine.costmaps.reset(rospy.get_time(), pose, local_pose)
        rospy.loginfo('both costmaps are cleared')
        return EmptyResponse()
