"""`composed_kills`: kills the process `composed` (sara.launch composed:=true) while the simulated chair drives, so many
times, each on another chair, and tells how soon the chair stands.

It must be slower than 0.05 m/s after T + v / 1.5 + 0.25 s (docs/safety.md): with nothing heard of wheels, sensors and
controller any more T is 0.25 s. A tenth of a second is allowed besides, for the truth comes at 50 Hz.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import time
from typing import NamedTuple

import actionlib
import rosgraph
import rospy
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry

from canserial.calibration.calibration_file import save
from sara_bringup.ros.goals import goal_at, wait_for_launch
from sara_bringup.ros.masters import environment, in_a_process, launched
from sara_bringup.ros.processes import process_of
from sara_lab.ros.benches.bench_stack import SIMULATED, Ears

NODE, GOAL = '/composed', (5.0, 1.0, 0.0)
AT_REST = 0.05  # m/s
SILENT_S, BRAKE, BESIDES_S, BLUR_S = 0.25, 1.5, 0.25, 0.1
PATIENCE_S = 60.0


class Kill(NamedTuple):
    """speed: m/s, when it was killed. seconds: until the chair stood, of its own time. way: m meanwhile and in the two
    seconds behind that.
    """

    speed: float
    seconds: float
    way: float

    @property
    def in_time(self) -> bool:
        """Whether it stood as soon as it must."""
        return self.seconds <= SILENT_S + self.speed / BRAKE + BESIDES_S + BLUR_S


def kill_once(number: int) -> Kill:
    """On chair `number`: wait until it drives, at one of several speeds, and kill."""
    env = environment()
    os.environ['ROS_MASTER_URI'] = env['ROS_MASTER_URI']
    with tempfile.TemporaryDirectory(prefix='sara_') as folder, open(f'{folder}/log', 'w', encoding='utf-8') as log:
        save(f'{folder}/calibration.yaml', SIMULATED)
        arguments = {
            'composed': 'true',
            'seed': number,
            'calibration': 'saved',
            'calibration_file': f'{folder}/calibration.yaml',
            'port': f'{folder}/can',
        }
        with launched('sara_bringup', 'sara.launch', arguments, env, stdout=log, stderr=log):
            while not rosgraph.is_master_online():
                time.sleep(0.02)
            wait_for_launch(PATIENCE_S)
            rospy.init_node('composed_kills', disable_signals=True)
            return _kill(0.1 + 0.1 * (number % 6))


def _kill(least):
    truth = []
    rospy.Subscriber('/ground_truth', Odometry, truth.append, tcp_nodelay=True)
    client = actionlib.SimpleActionClient('move_base', MoveBaseAction)
    client.wait_for_server(rospy.Duration(PATIENCE_S))
    Ears().wait('pose', 'gate')
    end = time.monotonic() + PATIENCE_S
    client.send_goal(goal_at(GOAL))
    while not truth or truth[-1].twist.twist.linear.x < least:
        if time.monotonic() > end:
            raise TimeoutError(f'the chair does not drive at {least:.1f} m/s within {PATIENCE_S:.0f} s')
        time.sleep(0.005)
    os.kill(process_of(NODE), signal.SIGKILL)
    first = truth[-1]
    count, began = len(truth), first.header.stamp.to_sec()
    while truth[-1].header.stamp.to_sec() < began + 4.0 and time.monotonic() < end:
        time.sleep(0.01)
    after = truth[count - 1 :]
    moving = [m.header.stamp.to_sec() for m in after if abs(m.twist.twist.linear.x) >= AT_REST]
    return Kill(
        first.twist.twist.linear.x,
        max(moving, default=began) - began,
        after[-1].pose.pose.position.x - first.pose.pose.position.x,
    )


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/composed_kills; exit status 1 where the chair did not stand in time."""
    parser = argparse.ArgumentParser(prog='composed_kills', description=__doc__)
    parser.add_argument('--times', type=int, default=10, help='(default: %(default)s)')
    options = parser.parse_args(words)
    late = 0
    for number in range(options.times):
        kill = in_a_process(kill_once, number)
        late += not kill.in_time
        word = 'in time' if kill.in_time else 'TOO LATE'
        print(
            f'{number}: {kill.speed:.2f} m/s, stood after {kill.seconds:.2f} s and {kill.way:.2f} m: {word}', flush=True
        )
    print(f'{options.times - late} of {options.times} in time')
    sys.exit(bool(late))
