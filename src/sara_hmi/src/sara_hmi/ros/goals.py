"""The goals that the page gives move_base, one at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Quaternion
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

from sara_common.planar import quaternion_from_yaw
from sara_hmi.words import endings

UNDER_WAY = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)
SERVER_S = 1.0
"""s that move_base is waited for."""
SILENT_S = 5.0
"""s of wall time without a word of move_base's status, which comes five times a second of the clock."""


class Goals:
    """map_frame: of the goals. settle_s: s after the page has driven until a goal is sent: before, cmd_vel_mux takes it
    to drive still, and cancels the goal. on_end: called with number, key and reason when a goal has ended. on_idle:
    called while move_base has no goal, of the page or of others.

    A goal that waits is `wanted` by its number; whoever drives, stops or cancels meanwhile forgets it.
    """

    def __init__(
        self,
        map_frame: str,
        settle_s: float,
        on_end: Callable[[int, str, str], None],
        on_idle: Callable[[], None],
    ) -> None:
        self._frame, self._settle_s, self._on_end, self._on_idle = map_frame, settle_s, on_end, on_idle
        self._client = actionlib.ActionClient('move_base', MoveBaseAction)
        self._handle: actionlib.ClientGoalHandle | None = None
        self._lock, self._driven, self._wanted = threading.Lock(), -float('inf'), None
        self._sent, self._heard_at = 0, -float('inf')
        rospy.Subscriber('move_base/status', GoalStatusArray, self._on_status, queue_size=1)

    def _on_status(self, message):
        self._heard_at = time.monotonic()
        if not any(one.status in UNDER_WAY for one in message.status_list):
            self._on_idle()

    def drove(self, moves: bool) -> None:
        """The page has commanded the wheels just now; moves: to turn."""
        self._driven = time.monotonic()
        if moves:
            self._wanted = None

    def want(self, number: int) -> None:
        """This goal is to be sent; the one before that has not been is not any more."""
        self._wanted = number

    def forget(self) -> None:
        """No goal is to be sent."""
        with self._lock:
            self._wanted = None

    def cancel(self) -> None:
        """End the goal under way, and the one that waits."""
        with self._lock:
            self._wanted = None
            if self._handle is not None:
                self._handle.cancel()

    def end_if_unheard(self) -> None:
        """Cancel the goal under way, and say that it has ended, where move_base has been silent for SILENT_S: nobody
        would say so any more. To be called about once a second.
        """
        with self._lock:
            handle = self._handle
            if (
                handle is None
                or handle.get_comm_state() == actionlib.CommState.DONE
                or time.monotonic() - self._heard_at < SILENT_S
            ):
                return
            self._handle = None
            handle.cancel()
        self._on_idle()
        self._on_end(self._sent, 'goal.aborted', 'why.no_navigation')

    def send(self, number: int, pose: tuple[float, float, float]) -> bool:
        """Send a goal (x, y, yaw; m, rad) once the page has not driven for settle_s, if it is wanted still. Waits; not
        for the server's thread. False: there is no move_base.
        """
        if not self._client.wait_for_server(rospy.Duration(SERVER_S)):
            self._on_end(number, 'goal.rejected', 'why.no_navigation')
            return False
        while number == self._wanted and (rest := self._driven + self._settle_s - time.monotonic()) > 0.0:
            rospy.rostime.wallsleep(rest)
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id, goal.target_pose.header.stamp = self._frame, rospy.Time.now()
        goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = pose[:2]
        goal.target_pose.pose.orientation = Quaternion(*quaternion_from_yaw(pose[2]))

        def heard(handle: actionlib.ClientGoalHandle) -> None:
            if handle.get_comm_state() != actionlib.CommState.DONE:
                return
            status, text = handle.get_goal_status(), handle.get_goal_status_text()
            rospy.loginfo('the goal of the page has ended: %s', text)
            unreached = endings.ending(status) in ('goal.aborted', 'goal.rejected')
            self._on_end(number, endings.ending(status), endings.why(text) if unreached else '')

        with self._lock:
            if number == self._wanted:
                self._sent, self._heard_at = number, time.monotonic()
                self._handle = self._client.send_goal(goal, heard)
                return True
        self._on_end(number, 'goal.cancelled', '')
        return True
