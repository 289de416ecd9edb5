"""What move_base costs while it drives 12 m at 10 Hz over ROS: CPU, memory, cycles missed; for each local planner.

The robot is made up here: it obeys cmd_vel with a lag, and publishes odometry and TF at 50 Hz and nine echoless Range
topics at 5 Hz. In
real time: speed is the question. The C++ move_base was measured the same way, without ranges.
"""

import argparse
import json
import math
import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

import actionlib
import rosgraph
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped, Twist
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Range

from sara_bringup.lockstep.ranges import mountings
from sara_bringup.ros.goals import goal_at
from sara_bringup.ros.masters import environment, in_a_process, launched
from sara_bringup.ros.processes import process_of
from sara_common.platforms import chosen
from sara_lab.journeys.journeys import PLANNERS
from sara_lab.workers.cost import cpu_seconds, peak_memory_mb

START, GOAL = (2.0, 4.0, 0.4), (14.0, 4.6, 0.0)  # in the hall: x m, y m, yaw rad
PEERS = {'TrajectoryPlannerROS': 6.3, 'DWAPlannerROS': 4.1}  # % of a core
MOST_CPU = 25.0  # %
PERIOD, LAG = 0.02, 0.18
LOG = Path('out/bench_nav.log')


class Robot:
    """A point that turns; `pose` is (x, y, yaw). `alive`: while it moves and speaks."""

    def __init__(self) -> None:
        self.pose, self.speed, self._command = START, (0.0, 0.0), (0.0, 0.0)
        self.alive, self._broadcaster = True, tf2_ros.TransformBroadcaster()
        self._odometry = rospy.Publisher('odom', Odometry, queue_size=1, tcp_nodelay=True)
        self._places = mountings(chosen())
        self._ranges = {
            name: rospy.Publisher(f'/{name}_range', Range, queue_size=1, tcp_nodelay=True) for name in self._places
        }
        self._subscriber = rospy.Subscriber('cmd_vel', Twist, self._obey, queue_size=1, tcp_nodelay=True)
        static = tf2_ros.StaticTransformBroadcaster()
        static.sendTransform(
            [
                _transform('map', 'odom', (0.0, 0.0, 0.0)),
                *(_transform('base_link', f'{name}_frame', place) for name, place in self._places.items()),
            ]
        )
        self._static = static
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _obey(self, message):
        self._command = message.linear.x, message.angular.z

    def _run(self):
        start = time.monotonic()
        for tick in range(10**9):
            if not self.alive or rospy.is_shutdown():
                return
            (x, y, yaw), (v, w) = (
                self.pose,
                tuple(old + (new - old) * PERIOD / LAG for old, new in zip(self.speed, self._command)),
            )
            self.speed, self.pose = (
                (v, w),
                (x + v * PERIOD * math.cos(yaw), y + v * PERIOD * math.sin(yaw), yaw + w * PERIOD),
            )
            self._speak(rospy.Time.now(), tick % 10 == 0)
            time.sleep(max(0.0, start + (tick + 1) * PERIOD - time.monotonic()))

    def _speak(self, now, with_ranges):
        transform = _transform('odom', 'base_link', self.pose, now)
        self._broadcaster.sendTransform(transform)
        odometry = Odometry(child_frame_id='base_link')
        odometry.header = transform.header
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = self.pose[:2]
        odometry.pose.pose.orientation = transform.transform.rotation
        odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = self.speed
        self._odometry.publish(odometry)
        for name, publisher in self._ranges.items() if with_ranges else ():
            message = Range(
                radiation_type=Range.ULTRASOUND,
                field_of_view=math.radians(60.0),
                min_range=0.16,
                max_range=6.0,
                range=math.inf,
            )
            message.header.stamp, message.header.frame_id = now, f'{name}_frame'
            publisher.publish(message)


def _transform(parent, child, pose, stamp=None):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, stamp or rospy.Time.now()
    message.transform.translation.x, message.transform.translation.y = pose[:2]
    message.transform.rotation.z, message.transform.rotation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
    return message


def measure(planner: str, timeout: float = 120.0) -> dict[str, Any]:
    """{name: figure} of one drive with a planner (a name of journeys.PLANNERS), in the ROS graph of this node."""
    robot = Robot()
    cycles = {}

    def listen(message):
        for status in message.status:
            if status.name.startswith('move_base'):
                cycles.update(
                    {
                        value.key: value.value
                        for value in status.values
                        if value.key in ('missed_cycles', 'worst_cycle_s')
                    }
                )

    diagnostics = rospy.Subscriber('/diagnostics', DiagnosticArray, listen)
    try:
        client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
        if not client.wait_for_server(rospy.Duration(60.0)):
            raise RuntimeError('move_base is not there after 60 s')
        pid = process_of('/move_base')
        time.sleep(3.0)
        idle = _share_of_core(pid, lambda: time.sleep(4.0))
        began = time.monotonic()
        used = _share_of_core(pid, lambda: client.send_goal_and_wait(goal_at(GOAL), rospy.Duration(timeout)))
        seconds = time.monotonic() - began
        return {
            'planner': planner,
            'reached': client.get_state() == GoalStatus.SUCCEEDED,
            'text': client.get_goal_status_text(),
            'seconds': seconds,
            'cpu_percent': 100.0 * used,
            'idle_percent': 100.0 * idle,
            'peers_percent': PEERS.get(planner),
            'memory_mb': peak_memory_mb(pid),
            **cycles,
        }
    finally:
        robot.alive = False
        diagnostics.unregister()


def _share_of_core(pid, work):
    """The share of a core that a process takes while `work()` lasts."""
    before, began = cpu_seconds(pid), time.monotonic()
    work()
    return (cpu_seconds(pid) - before) / (time.monotonic() - began)


def drive(planner: str) -> dict[str, Any]:
    """Start map_server and move_base with a ROS master of their own, and measure."""
    env = environment()
    os.environ['ROS_MASTER_URI'] = env['ROS_MASTER_URI']
    with (
        open(LOG, 'a', encoding='utf-8') as log,
        launched('sara_lab', 'bench_nav.launch', {'planner': PLANNERS[planner].file}, env, stdout=log, stderr=log),
    ):
        while not rosgraph.is_master_online():
            time.sleep(0.1)
        rospy.init_node('bench_nav', disable_signals=True)
        return measure(planner)


def main() -> None:
    """Exit status 0 if every drive ended at its goal and took no more CPU than it may."""
    parser = argparse.ArgumentParser(prog='bench_nav', description=__doc__)
    parser.add_argument('planners', nargs='*', metavar='PLANNER', help=f'of {", ".join(PLANNERS)}; all without it')
    parser.add_argument('--out', type=Path, help='JSON file')
    arguments = parser.parse_args()
    unknown = [name for name in arguments.planners if name not in PLANNERS]
    if unknown:
        parser.error(f'there is no planner {", ".join(unknown)}; there are {", ".join(PLANNERS)}')
    results = []
    LOG.parent.mkdir(exist_ok=True)
    LOG.unlink(missing_ok=True)
    print(
        f'move_base driving {math.dist(START[:2], GOAL[:2]):.1f} m at 10 Hz over ROS; % of a core (log: {LOG})',
        flush=True,
    )
    for planner in arguments.planners or PLANNERS:
        results.append(in_a_process(drive, planner))
        result = results[-1]
        peer = f' (C++: {result["peers_percent"]} %)' if result['peers_percent'] else ''
        print(
            f'  {planner:22} {result["cpu_percent"]:5.1f} %{peer}, idle {result["idle_percent"]:.1f} %, '
            f'{result["memory_mb"]:.0f} MB, {result["seconds"]:.0f} s, '
            f'{result.get("missed_cycles", "?")} cycles missed, '
            f'{"there" if result["reached"] else "NOT there: " + result["text"]}',
            flush=True,
        )
    if arguments.out:
        arguments.out.write_text(json.dumps(results, indent=1))
    sys.exit(0 if all(result['reached'] and result['cpu_percent'] <= MOST_CPU for result in results) else 1)
