"""square.py: drives a mission's goals through move_base's action, with progress, and keeps what happened.

On the chair as in simulation; /ground_truth is used for the report where somebody publishes it.
"""

from __future__ import annotations

import json
import math
import threading
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING

import actionlib
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_bringup.missions.drive import Drive, pose_at
from sara_bringup.missions.mission import load_mission
from sara_bringup.missions.report import table
from sara_bringup.paths import config_file
from sara_bringup.ros import goals
from sara_common.planar import yaw_of
from sara_common.ros.node import on_shutdown

if TYPE_CHECKING:
    from sara_bringup.missions.mission import Mission

LAUNCH_S = 60.0  # of the wall clock, for a launch that may still be starting
MOST_WAITING = 100  # fused poses that wait for the true one, which may have ceased; true ones kept for late fused ones
SETTLE_S = 1.0  # the chair comes to rest before a corner is judged


def _pose(message):
    pose = message.pose.pose
    return pose.position.x, pose.position.y, yaw_of(pose.orientation)


class Recorder:
    """Adds a sample to the drive with each fused pose: the newest odometry, and the true pose at the stamp of the fused
    one, where somebody publishes it.
    """

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.lock = threading.Lock()
        self.odometry, self.recording = None, False
        self._truths = deque(maxlen=MOST_WAITING)  # (stamp s, pose), the newest last
        self._waiting = deque(maxlen=MOST_WAITING)  # (stamp s, fused, odometry) newer than the newest truth
        rospy.Subscriber('/ground_truth', Odometry, self._on_truth, tcp_nodelay=True)
        rospy.Subscriber('/diff_drive_controller/odom', Odometry, self._on_odometry, tcp_nodelay=True)
        rospy.Subscriber('/odometry/filtered', Odometry, self._on_fused, tcp_nodelay=True)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self._on_diagnostics)

    def _on_truth(self, message):
        with self.lock:
            self._truths.append((message.header.stamp.to_sec(), _pose(message)))
            while self._waiting and self._waiting[0][0] <= self._truths[-1][0]:
                self._add(*self._waiting.popleft())

    def _on_odometry(self, message):
        self.odometry = _pose(message)

    def _on_fused(self, message):
        with self.lock:
            if not self.recording or self.odometry is None:
                return
            sample = message.header.stamp.to_sec(), _pose(message), self.odometry
            if self._truths and sample[0] > self._truths[-1][0]:
                self._waiting.append(sample)
            else:
                self._add(*sample)

    def _add(self, stamp, fused, odometry):
        self.drive.add_sample(stamp, pose_at(stamp, self._truths), fused, odometry)

    def _on_diagnostics(self, message):
        for status in message.status:
            for value in status.values:
                if value.key == 'contacts':
                    self.drive.contacts = int(value.value)

    def stop(self) -> None:
        """Record no more, not even what waits for a true pose."""
        with self.lock:
            self.recording = False
            self._waiting.clear()

    def corner(self, *corner) -> None:
        """As Drive.add_corner."""
        with self.lock:
            self.drive.add_corner(*corner)


def _wait(what, topic, kind):
    rospy.loginfo('waiting for %s (%s)', what, topic)
    rospy.wait_for_message(topic, kind)


def _drive_to(client, pose, number, mission, recorder):
    """Send one goal and wait for its end, saying where the chair is; return move_base's verdict and words."""
    client.send_goal(goals.goal_at(pose))
    end = rospy.Time.now() + rospy.Duration(mission.leg_timeout_s)
    while not client.wait_for_result(rospy.Duration(2.0)):
        if rospy.is_shutdown():
            return False, 'shut down'
        if rospy.Time.now() > end:
            client.cancel_goal()
            return False, f'not there after {mission.leg_timeout_s:.0f} s'
        if recorder.drive.samples:
            _, _, (x, y, yaw), _ = recorder.drive.samples[-1]
            rospy.loginfo(
                'corner %d of %d: %.2f m to go, at (%.2f, %.2f), yaw %.0f deg',
                number,
                len(mission.goals),
                math.hypot(pose[0] - x, pose[1] - y),
                x,
                y,
                math.degrees(yaw) % 360.0,
            )
    return client.get_state() == GoalStatus.SUCCEEDED, client.get_goal_status_text()


def _cancel(client):
    """The node ends: the chair is not to drive on."""
    if client.simple_state != actionlib.SimpleGoalState.DONE:
        client.cancel_goal()
        rospy.rostime.wallsleep(0.1)  # the message is to get out


def drive_mission(mission: Mission, drive: Drive) -> None:
    """Drive `mission` and fill `drive`; waits by name for what is not there yet. An initialised node calls it; the goal
    under way is cancelled when that node is shut down.
    """
    recorder = Recorder(drive)
    client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
    on_shutdown(lambda: _cancel(client))
    _wait('the IMU: its gyro is being calibrated, the chair must stand still', '/imu/data', Imu)
    _wait('the fused pose', '/odometry/filtered', Odometry)
    rospy.loginfo('waiting for move_base')
    client.wait_for_server()
    recorder.recording = True
    for number, pose in enumerate(mission.goals, 1):
        rospy.loginfo(
            'corner %d of %d: to (%.2f, %.2f), yaw %.0f deg',
            number,
            len(mission.goals),
            pose[0],
            pose[1],
            math.degrees(pose[2]),
        )
        given = rospy.get_time()
        reached, text = _drive_to(client, pose, number, mission, recorder)
        if rospy.is_shutdown():
            break
        ended = rospy.get_time()
        rospy.sleep(SETTLE_S)
        recorder.corner(pose, reached, text, given, ended)
        rospy.loginfo(
            'corner %d of %d: %s', number, len(mission.goals), 'reached' if reached else f'NOT reached: {text}'
        )
    recorder.stop()


def square() -> int:
    """Drive ~mission (a YAML file; default: the square), write ~result (JSON) if named; returns the exit status, not 0
    if a goal was missed. Raises Unavailable where there is no stack to drive with, MissionError.
    """
    if not rosgraph.is_master_online():
        goals.say('waiting for `roslaunch sara_bringup sara.launch`')
    # a node that begins before the launch has set /use_sim_time would keep to the wall clock
    goals.wait_for_launch(LAUNCH_S)
    goals.begin('square')
    mission = load_mission(rospy.get_param('~mission', str(config_file('square.yaml'))))
    drive = Drive(mission.name, rospy.get_param('~seed', 0), mission.start, rospy.get_param('~ekf', 'default'))
    drive_mission(mission, drive)
    if rospy.is_shutdown():
        return goals.INTERRUPTED
    result = rospy.get_param('~result', '')
    if result:
        Path(result).write_text(json.dumps(drive.to_file_data()))
    print(table(drive), flush=True)
    return goals.REACHED if all(corner.reached for corner in drive.corners) else goals.MISSED


def main() -> None:
    """The command; exit status 0 all reached, 1 not all, 2 no stack to drive with, 130 interrupted."""
    goals.run(square)
