"""E1 to E6 over ROS: listens to the chair on the bench, and turns it by its joystick; a process of its own, for a
process can be a node of one master only.

    python3 -m sara_lab.ros.experiments.bench_node WHAT OUT.pickle       WHAT: one of TASKS

bench_over_ros.py starts it beside launch/bench_top.launch, and makes the experiments' results of what it leaves.
"""

from __future__ import annotations

import math
import pickle
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_srvs.srv import Trigger

from canserial.calibration.gain import ANGLES, GainProcedure
from canserial.msg import CAN
from canserial.ros.conversions import msg_to_frame
from sara_bringup.ros import goals
from sara_common.planar import yaw_of
from sara_lab.experiments.sensor_experiments import MINUTE_S, PAUSE_S, TURN_AXIS
from sara_lowlevel.config import SensorConfig
from sara_sim.srv import Fault

if TYPE_CHECKING:
    from canserial.frame import Frame

WAIT_S = 180.0  # of the wall clock, for read.py's calibration or a turn


class Bench:
    """Everything that is heard from now on: `frames` of the bus; `imu`: (t, yaw), `true`: (t, yaw), rad."""

    def __init__(self) -> None:
        self.frames, self.imu, self.true = [], [], []
        rospy.Subscriber(
            '/canrx', CAN, lambda message: self.frames.append(msg_to_frame(message)), queue_size=1000, tcp_nodelay=True
        )
        rospy.Subscriber(
            '/imu/data',
            Imu,
            lambda message: self.imu.append((message.header.stamp.to_sec(), yaw_of(message.orientation))),
            tcp_nodelay=True,
        )
        rospy.Subscriber(
            '/ground_truth',
            Odometry,
            lambda message: self.true.append((message.header.stamp.to_sec(), yaw_of(message.pose.pose.orientation))),
            tcp_nodelay=True,
        )
        goals.until(lambda: self.frames and self.true, 'frames of the bus and the true pose', WAIT_S)

    def settle(self) -> None:
        """Until a chip that nobody waited for has settled."""
        goals.until(lambda: rospy.get_time() >= SensorConfig.settle_time, 'the clock', WAIT_S)

    def calibrated(self) -> None:
        """Until read.py gives a yaw."""
        goals.until(lambda: self.imu, "read.py's calibration", WAIT_S)

    def minute(self) -> list[Frame]:
        """Frames of a minute."""
        first = len(self.frames)
        goals.pause(MINUTE_S)
        return self.frames[first:]

    def yaw(self) -> tuple[np.ndarray, np.ndarray]:
        """(t, yaw) of a minute by read.py, rad, unwrapped."""
        first = len(self.imu)
        goals.pause(MINUTE_S)
        t, yaw = np.array(self.imu[first:]).T
        return t, np.unwrap(yaw)

    def turn_to(self, angle: float, since: float) -> tuple[float, float]:
        """By the joystick until the chair has turned `angle` deg (left positive) since the time `since` (s); (true,
        measured) then, deg.
        """
        side = 1 if angle > self.turned(self.true, since) else -1
        hand = rospy.ServiceProxy('/simulator/fault', Fault)
        answer = hand('joystick_grabbed', f'{{x: {512 - side * TURN_AXIS}, y: 512}}')
        if not answer.success:
            raise goals.Unavailable(f'the joystick cannot be moved: {answer.message}')
        goals.until(lambda: side * (angle - self.turned(self.true, since)) <= 0.0, f'a turn to {angle:g} deg', WAIT_S)
        rospy.ServiceProxy('/simulator/clear_faults', Trigger)()
        goals.pause(PAUSE_S)
        return self.turned(self.true, since), self.turned(self.imu, since)

    @staticmethod
    def turned(rows: Sequence[tuple[float, float]], since: float) -> float:
        """deg since a time."""
        rows = np.array(rows)
        return math.degrees(np.diff(np.unwrap(rows[max(0, np.searchsorted(rows[:, 0], since) - 1) :, 1])).sum())


def minute_before(bench: Bench) -> list[Frame]:
    """Frames of a minute of a chip that has settled."""
    bench.settle()
    return bench.minute()


def yaw_of_read(bench: Bench) -> tuple[np.ndarray, np.ndarray]:
    """A minute of yaw by read.py, calibrated."""
    bench.calibrated()
    return bench.yaw()


def turns(bench: Bench) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """E6: (true, measured) at each mark both ways, then of a full turn each way, deg."""
    bench.calibrated()
    marks, since = [], None
    for angle in GainProcedure().angles:
        if abs(angle) == ANGLES[0]:
            since = rospy.get_time()
        marks.append(bench.turn_to(angle, since))
    return marks, [bench.turn_to(angle, rospy.get_time()) for angle in (360.0, -360.0)]


def filters(bench: Bench) -> list[tuple[list[Frame], np.ndarray]]:
    """E4: ((frames, true yaws) of a minute at rest, of a full turn to the left, to the right)."""
    bench.calibrated()
    found = []
    for angle in (0.0, 360.0, -360.0):
        first, frame, since = len(bench.true), len(bench.frames), rospy.get_time()
        if angle:
            bench.turn_to(angle, since)
        else:
            goals.pause(MINUTE_S)
        t, yaw = np.array(bench.true[first:]).T
        frames = bench.frames[frame:]
        found.append((frames, np.interp([one.time for one in frames], t, np.unwrap(yaw))))
    return found


TASKS = {'before': minute_before, 'after': Bench.minute, 'yaw': yaw_of_read, 'turns': turns, 'filters': filters}


def main(words: Sequence[str]) -> int:
    """The process."""
    goals.wait_for_launch(WAIT_S)
    goals.begin('bench')
    Path(words[1]).write_bytes(pickle.dumps(TASKS[words[0]](Bench())))
    return goals.REACHED


if __name__ == '__main__':
    goals.run(lambda: main(sys.argv[1:]))
