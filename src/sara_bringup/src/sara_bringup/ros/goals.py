"""move_base's action for the command line: waits by name for what is missing, sends a goal, says how it goes, cancels
it on Ctrl-C.
"""

from __future__ import annotations

import argparse
import math
import signal
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import actionlib
import rosgraph
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Quaternion
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from std_msgs.msg import String

from sara_bringup.missions.mission import MissionError
from sara_bringup.missions.patrol import Progress, ended
from sara_common.planar import Pose2D, is_apart, yaw_of
from sara_control.gate.reasons import HOLDS
from sara_nav.maps import places

if TYPE_CHECKING:
    from sara_nav.maps.places import Place

REACHED, MISSED, WRONG, INTERRUPTED = 0, 1, 2, 130  # exit statuses
SILENT_S = 5.0  # s of wall time without a word of move_base's status, which comes five times a second of the clock
TAKEN_S = 3.0  # s of wall time within which move_base's status is to name a goal
FRESH_S = 1.0  # s, the oldest pose that is written down as a place
MOVED, TURNED = 0.2, 0.3  # m and rad that the chair is off where it stood: somebody has moved it
UNDER_WAY = (GoalStatus.PENDING, GoalStatus.ACTIVE)


class Unavailable(RuntimeError):
    """What is needed is not there; the text is a sentence."""


def say(text: str) -> None:
    """A line on the terminal, at once."""
    print(text, flush=True)


def until(condition: Callable[[], object], what: str, seconds: float) -> None:
    """Until condition() holds, looked at again and again. Raises Unavailable after so long (s of wall time); `what` is
    waited for.
    """
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise Unavailable(f'{what}: not within {seconds:.0f} s')
        time.sleep(0.02)


def pause(seconds: float, ends: Callable[[], bool] = lambda: False) -> None:
    """So long of ROS time, whatever the clock does, or until ends(); Ctrl-C gets through."""
    end = rospy.get_time() + seconds
    while rospy.get_time() < end and not ends():
        time.sleep(0.02)


def wait_for_launch(seconds: float) -> None:
    """Until the launch beside has set its parameters: a node that begins earlier may take another clock than everybody
    else. Raises Unavailable.

    roslaunch starts the master, then sets all parameters, then starts the nodes; so a move_base is a sign, too, where
    nobody says whose clock there is.
    """
    master, status = rosgraph.Master('/sara_bringup'), rospy.resolve_name('move_base/status')

    def ready():
        return master.is_online() and (
            master.hasParam('/use_sim_time') or any(topic == status for topic, _ in master.getSystemState()[0])
        )

    until(ready, 'the launch, with move_base or /use_sim_time', seconds)


def goal_at(pose: Sequence[float], frame: str = 'map') -> MoveBaseGoal:
    """The MoveBaseGoal of a pose (x m, y m, yaw rad) in a frame, as of now."""
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id, goal.target_pose.header.stamp = frame, rospy.Time.now()
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = pose[:2]
    goal.target_pose.pose.orientation = Quaternion(0.0, 0.0, math.sin(pose[2] / 2.0), math.cos(pose[2] / 2.0))
    return goal


def begin(name: str) -> None:
    """Become a ROS node whose Ctrl-C is a KeyboardInterrupt. Raises Unavailable without a master."""
    if not rosgraph.is_master_online():
        raise Unavailable('no ROS master answers: start `roslaunch sara_bringup sara.launch` first')
    rospy.init_node(name, anonymous=True, disable_signals=True)
    for number in (signal.SIGTERM, signal.SIGHUP):  # as Ctrl-C: the goal is cancelled
        signal.signal(number, signal.default_int_handler)


def places_file(arguments: argparse.Namespace) -> Path | str:
    """The places file: of --places, beside --map, or the running launch's. Raises Unavailable."""
    if arguments.places or arguments.map:
        return arguments.places or places.beside(arguments.map)
    if rosgraph.is_master_online():
        named = rospy.get_param('/places_file', '')
        if named:
            return named
    raise Unavailable(
        "which map's places? Start `roslaunch sara_bringup sara.launch`, or name --map MAP.yaml or --places FILE"
    )


def add_file_options(parser: argparse.ArgumentParser) -> None:
    """--places and --map."""
    parser.add_argument(
        '--places',
        metavar='FILE',
        help='the places file; without it, the one beside the map that sara.launch runs with',
    )
    parser.add_argument('--map', metavar='MAP.yaml', help='the places file beside this map')


class Robot:
    """Where the chair is, by tf."""

    def __init__(self) -> None:
        self.map_frame = rospy.get_param('move_base/global_costmap/global_frame', 'map').lstrip('/')
        self.base_frame = rospy.get_param('move_base/global_costmap/robot_base_frame', 'base_link').lstrip('/')
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)

    def pose(self) -> tuple[float, float, float] | None:
        """(stamp s, x, y, yaw) in the map, None before it is known."""
        try:
            found = self._buffer.lookup_transform(self.map_frame, self.base_frame, rospy.Time(0))
        except tf2_ros.TransformException:
            return None
        return (
            found.header.stamp.to_sec(),
            found.transform.translation.x,
            found.transform.translation.y,
            yaw_of(found.transform.rotation),
        )

    def wait(self, seconds: float, fresh: bool = False) -> tuple[float, float, float]:
        """The pose, waited for so long (s of wall time; said after the first). Raises Unavailable."""
        end, said = time.monotonic() + seconds, time.monotonic() + 1.0
        while True:
            pose = self.pose()
            if pose is not None and not (fresh and abs(rospy.get_time() - pose[0]) > FRESH_S):
                return pose
            if time.monotonic() > end:
                raise Unavailable(
                    f"the chair's pose is not known: no{' fresh' if pose else ''} transform from "
                    f'{self.map_frame} to {self.base_frame} for {seconds:.0f} s'
                )
            if time.monotonic() > said:
                say(
                    f"waiting for the chair's pose ({self.map_frame} -> {self.base_frame}); after a start the "
                    'gyro is calibrated first, about 20 s'
                )
                said = math.inf
            time.sleep(0.05)


class Driver:
    """Sends goals. `wait`: s of wall time for move_base and the pose. Raises Unavailable."""

    def __init__(self, wait: float) -> None:
        self.robot = Robot()
        self._client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        self._heard, self._why, self.taken = time.monotonic(), '', False
        self._own, self._others = None, False  # the id of its newest goal; whether another's goal is under way
        rospy.Subscriber('move_base/status', GoalStatusArray, self._on_status)
        rospy.Subscriber('safety_gate/status', String, lambda message: setattr(self, '_why', message.data))
        self._patience = wait
        end = self._wait_for_server()
        self.robot.wait(max(0.1, end - time.monotonic()))
        self._wait_for_the_gate(end)

    def _on_status(self, message):
        self._heard, known = time.monotonic(), message.status_list
        self._others = any(goal.status in UNDER_WAY and goal.goal_id.id != self._own for goal in known)

    def pause(self, seconds: float) -> None:
        """Stand for so long (s of ROS time). `taken`: somebody gave another goal meanwhile, or moved the chair."""
        began = self.robot.pose()
        pause(seconds, lambda: self._others)
        stood, stands = (pose and Pose2D(*pose[1:]) for pose in (began, self.robot.pose()))
        self.taken = self._others or bool(stood and stands and is_apart(stood, stands, MOVED, TURNED))

    def _wait_for_server(self):
        """Until move_base is there; it may have been started anew. Returns when its patience is over (wall, s). Raises
        Unavailable.
        """
        wait = self._patience
        end, said = time.monotonic() + wait, time.monotonic() + 1.0
        while not self._client.wait_for_server(rospy.Duration(0.05)):
            if time.monotonic() > end:
                raise Unavailable(
                    f'move_base does not answer after {wait:.0f} s: is its node running, and has it got a map?'
                )
            if time.monotonic() > said:
                say('waiting for move_base')
                said = math.inf
            time.sleep(0.02)  # the clock may stand
        return end

    def _wait_for_the_gate(self, end):
        """Where there is a safety gate, it latches what it says; a goal that it would give up at once waits for it,
        until `end` (wall, s). Raises Unavailable.
        """
        said, settled = '', time.monotonic() + 0.5
        while time.monotonic() < settled or self._why in HOLDS:
            if time.monotonic() > end:
                raise Unavailable(f'{self._why or "The safety gate has said nothing."} No goal is sent.')
            if self._why in HOLDS and self._why != said:
                said = self._why
                say(f'waiting. {said}')
            time.sleep(0.02)

    def go(self, place: Place, timeout: float = 0.0, quiet: bool = False) -> tuple[bool, str]:
        """Drive to a Place; returns (whether it was reached, move_base's words). `timeout`: s of ROS time, 0: none.
        KeyboardInterrupt cancels the goal and goes on. Raises Unavailable.
        """
        self._wait_for_server()
        over, began, progress = threading.Event(), rospy.get_time(), Progress(place)
        self._heard = sent = time.monotonic()
        say(f'going to {place}')
        self._client.send_goal(
            goal_at((place.x, place.y, place.yaw), self.robot.map_frame), done_cb=lambda _state, _result: over.set()
        )
        self._own = self._client.gh.comm_state_machine.action_goal.goal_id.id
        late = ''
        try:
            while not over.wait(0.1):
                now = rospy.get_time()
                gone = self._gone(time.monotonic() - sent)
                if gone:
                    self._client.cancel_goal()
                    return self._end(place, False, gone, now - began)
                if timeout and now - began > timeout and not late:
                    late = f'not there after {timeout:.0f} s'
                    self._client.cancel_goal()
                pose = None if quiet else self.robot.pose()
                text = progress.at(now, *pose[1:], self._why) if pose else None
                if text:
                    say(text)
        except BaseException as error:
            self._client.cancel_goal()
            stops = over.wait(3.0)
            if isinstance(error, KeyboardInterrupt):  # else nobody may be able to read it
                say(f'cancelled{": the chair stops" if stops else ", but move_base has not said that it stops"}')
            raise
        self.taken = not late and self._client.get_state() in (GoalStatus.PREEMPTED, GoalStatus.RECALLED)
        return self._end(
            place,
            self._client.get_state() == GoalStatus.SUCCEEDED,
            late or self._client.get_goal_status_text(),
            rospy.get_time() - began,
        )

    def _gone(self, since):
        """Why nothing is to be expected of the goal that was sent so long ago (s of wall time), or ''."""
        if time.monotonic() - self._heard > SILENT_S:
            return f'move_base has not been heard for {SILENT_S:.0f} s'
        if since > TAKEN_S and self._client.gh.get_comm_state() == actionlib.CommState.WAITING_FOR_GOAL_ACK:
            return f'move_base has not taken the goal within {TAKEN_S:.0f} s'
        return ''

    @staticmethod
    def _end(place, reached, text, seconds):
        say(ended(place, reached, text, seconds))
        return reached, text


def run(command: Callable[[], int]) -> None:
    """Call it, and end the process with the exit status it returns; what cannot be is said in a sentence."""
    import sys

    try:
        status = command()
    except (Unavailable, MissionError, places.PlacesError) as error:
        print(error, file=sys.stderr, flush=True)
        status = WRONG
    except KeyboardInterrupt:
        status = INTERRUPTED
    rospy.signal_shutdown('the end')
    sys.exit(status)
