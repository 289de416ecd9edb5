"""Drives a Course over ROS and keeps what drives.Recorded keeps in lockstep; a process of its own, for a process can be
a node of one master only.

    python3 -m sara_lab.ros.experiments.course_node COURSE.pickle ROWS.pickle

course_over_ros.py starts it beside the launch. What is heard is kept with its stamp; a row is, at each true pose, the
newest of everything, as in lockstep.
"""

from __future__ import annotations

import math
import pickle
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_bringup.lockstep.localization import RVIZ_COVARIANCE
from sara_bringup.ros import goals
from sara_common.planar import compose, yaw_of
from sara_lab.experiments.courses import BOTH, TRUTH, WHEELS
from sara_lab.experiments.drives import CLICK_TICKS, CLICKS, SHOWN_M
from sara_lab.judge.judgement import Goal
from sara_nav.maps.places import pose as place
from sara_sim.chair import STEP_S

if TYPE_CHECKING:
    from sara_lab.experiments.courses import Course, SetUp

TRUE, FUSED, ODOMETRY, IMU, COMMAND = (
    '/ground_truth',
    '/odometry/filtered',
    '/diff_drive_controller/odom',
    '/imu/data',
    '/diff_drive_controller/cmd_vel',
)
WIDTHS = {TRUE: 3, FUSED: 3, ODOMETRY: 4, IMU: 2, COMMAND: 2}
WAIT_S = 120.0  # of the wall clock, for the stack to come up: the gyro's calibration is 20 s of the chair's time
HEARD_S = 10.0  # of the wall clock, for what comes 50 times a second, or once


def of(topic: str, message: Any) -> tuple[float, ...]:
    """What is kept of a message."""
    if topic == COMMAND:
        return message.linear.x, message.angular.z
    if topic == IMU:
        return yaw_of(message.orientation), message.angular_velocity.z
    position = message.pose.pose.position
    pose = position.x, position.y, yaw_of(message.pose.pose.orientation)
    return (*pose, message.twist.twist.angular.z) if topic == ODOMETRY else pose


class Listener:
    """Everything that is heard from now on: {topic: [(stamp s, values...)]}, and the simulator's count of contacts."""

    def __init__(self) -> None:
        self.heard, self.contacts, self.told = {topic: [] for topic in WIDTHS}, 0, 0
        for topic, kind in ((TRUE, Odometry), (FUSED, Odometry), (ODOMETRY, Odometry), (IMU, Imu), (COMMAND, Twist)):
            rospy.Subscriber(topic, kind, self._keep, topic, tcp_nodelay=True)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self._on_diagnostics)

    def _keep(self, message, topic):
        stamp = rospy.get_time() if topic == COMMAND else message.header.stamp.to_sec()
        self.heard[topic].append((stamp, *of(topic, message)))

    def _on_diagnostics(self, message):
        for status in message.status:
            for value in status.values:
                if value.key == 'contacts':
                    self.contacts, self.told = int(value.value), self.told + 1

    def newest(self, topic: str) -> tuple[float, ...] | None:
        """Its values, None before the first."""
        return self.heard[topic][-1][1:] if self.heard[topic] else None

    def rows(self, since: float, until: float, start: tuple[float, float, float], fusion: str) -> np.ndarray:
        """(n, drive_data.COLUMNS) of the true poses from `since` to `until`; `start`: of the course, on the map."""
        kept = {
            topic: np.array(sorted(rows)) if rows else np.empty((0, WIDTHS[topic] + 1))
            for topic, rows in self.heard.items()
        }
        true = kept[TRUE][(kept[TRUE][:, 0] >= since) & (kept[TRUE][:, 0] <= until)]
        t = true[:, 0]
        wheels = _newest(kept[ODOMETRY], t)
        placed = np.array([compose(start, tuple(row)) for row in wheels[:, :3]]).reshape(-1, 3)
        known = np.searchsorted(
            t, kept[ODOMETRY][np.searchsorted(kept[ODOMETRY][:, 0], t, 'right') - 1, 0]
        )  # the true pose is told with the odometry
        fused = (
            placed
            if fusion == WHEELS
            else true[np.clip(known, 0, len(t) - 1), 1:]
            if fusion == TRUTH
            else _newest(kept[FUSED], t)
        )
        return np.column_stack([true, fused, placed, _newest(kept[IMU], t), wheels[:, 3], _newest(kept[COMMAND], t)])


def _newest(rows, t):
    """(len(t), columns) of the newest row at each time; not a number before the first."""
    at = np.searchsorted(rows[:, 0], t, 'right') - 1
    found = np.full((len(t), rows.shape[1] - 1), math.nan)
    found[at >= 0] = rows[at[at >= 0], 1:]
    return found


def point_out(listener: Listener, start: tuple[float, float, float], posed: str) -> int:
    """RViz's "2D Pose Estimate", again until the filter shows it; experiment.launch has seen to who hears it. Returns
    how often it took.
    """
    told = rospy.Publisher('/set_pose', PoseWithCovarianceStamped, queue_size=1)
    goals.until(lambda: told.get_num_connections() >= (2 if posed == BOTH else 1), 'listeners to /set_pose', HEARD_S)
    clicks = 0
    while clicks < CLICKS:
        clicks += 1
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.header.stamp = 'map', rospy.Time.now()
        message.pose.pose.position.x, message.pose.pose.position.y = start[:2]
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = (
            math.sin(start[2] / 2.0),
            math.cos(start[2] / 2.0),
        )
        message.pose.covariance = RVIZ_COVARIANCE.ravel().tolist()
        told.publish(message)
        goals.pause(CLICK_TICKS * STEP_S)
        if math.dist(listener.newest(FUSED)[:2], start[:2]) < SHOWN_M:
            break
    return clicks


def drive(course: Course, setup: SetUp) -> dict[str, Any]:
    """Drive it; {rows, goals, contacts, clicks} for drive_data.figures, and the `speed` that the machine kept up,
    times real time. Raises goals.Unavailable.
    """
    listener, driver = Listener(), goals.Driver(WAIT_S)
    goals.until(
        lambda: all(listener.heard[topic] for topic in (TRUE, ODOMETRY, IMU)) and listener.told,
        "the true pose, the odometry, the IMU and the simulator's diagnostics",
        HEARD_S,
    )
    start = before = course.placed(course.start)
    began, wall = rospy.get_time(), time.monotonic()
    clicks, contacts, done = point_out(listener, start, setup.posed) if setup.posed else 0, listener.contacts, []
    for goal in course.goals:
        asked, given = course.placed(goal), rospy.get_time()
        reached, text = driver.go(place(asked[0], asked[1], math.degrees(asked[2])), course.timeout_s)
        ended = rospy.get_time()
        goals.pause(course.pause_s)
        done.append(
            Goal(asked, given, ended, reached, text, rospy.get_time(), before[:2], math.dist(before[:2], asked[:2]))
        )
        before = asked
    speed, told = (rospy.get_time() - began) / (time.monotonic() - wall), listener.told
    goals.until(lambda: listener.told > told, "the simulator's diagnostics", HEARD_S)
    rows = listener.rows(done[0].given, done[-1].judged, start, setup.fusion)
    if len(rows) < 2:
        raise goals.Unavailable(f'no true pose was heard in the {done[-1].judged - done[0].given:.0f} s of the drive')
    return {
        'rows': rows,
        'goals': tuple(done),
        'contacts': listener.contacts - contacts,
        'clicks': clicks,
        'speed': speed,
    }


def main(words: Sequence[str]) -> int:
    """The process: what is pickled in the first file is driven, what came of it goes into the second."""
    course, setup = pickle.loads(Path(words[0]).read_bytes())
    goals.wait_for_launch(WAIT_S)
    goals.begin('course')
    Path(words[1]).write_bytes(pickle.dumps(drive(course, setup)))
    return goals.REACHED


if __name__ == '__main__':
    goals.run(lambda: main(sys.argv[1:]))
