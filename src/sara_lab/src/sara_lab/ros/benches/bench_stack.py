"""The whole stack with the simulator, as `roslaunch sara_bringup sara.launch calibration:=saved` starts it: how long
until the chair moves, how soon a goal becomes a command, and what every process costs while it drives. In real time, on
a ROS master of its own.
"""

import math
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import actionlib
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import Twist
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from canserial.calibration.calibration_file import Calibration, save
from sara_bringup.ros.goals import goal_at, wait_for_launch
from sara_bringup.ros.masters import environment, in_a_process, launched
from sara_control.gate.reasons import HOLDS
from sara_lab.benches.timed import Limit, Timed, timed
from sara_lab.workers.cost import cpu_seconds, descendants, peak_memory_mb, share_of_memory_mb

GOAL, NEXT = (5.0, 1.0, math.pi / 2), (5.0, 5.0, math.pi)  # of the square: x m, y m, yaw rad
STARTS = 3  # launches, of which the last goes on driving
MORE = 6  # goals of which only the first command is waited for
MOVES = 0.02  # m/s, rad/s: the chair moves
PATIENCE_S = 60.0
LOG = Path('out/bench_stack.log')
SIMULATED = Calibration(gyro_offset=(0.0, 0.0, 0.0), gyro_sigma=(0.09, 0.09, 0.08), gyro_frames=100, gain=1.083)
"""What a calibration of the simulated chair finds, about: its sensor node has taken the offset off already."""


class Ears:
    """When (monotonic s) things happened first since `forget`: "command" of move_base, "motion" of the chair."""

    def __init__(self) -> None:
        self.first, self.why = {}, None
        self._subscribers = [
            rospy.Subscriber('/cmd_vel/navigation', Twist, lambda m: self._heard('command', m), tcp_nodelay=True),
            rospy.Subscriber(
                '/ground_truth', Odometry, lambda m: self._heard('motion', m.twist.twist), tcp_nodelay=True
            ),
            rospy.Subscriber(
                '/odometry/filtered',
                Odometry,
                lambda m: self.first.setdefault('pose', time.monotonic()),
                tcp_nodelay=True,
            ),
            rospy.Subscriber('/safety_gate/status', String, self._status),
        ]

    def _status(self, message):
        self.why = message.data
        if self.why not in HOLDS:
            self.first.setdefault('gate', time.monotonic())

    def _heard(self, what, twist):
        if abs(twist.linear.x) > MOVES or abs(twist.angular.z) > MOVES:
            self.first.setdefault(what, time.monotonic())

    def forget(self) -> None:
        """Listen anew."""
        self.first = {}

    def wait(self, *names, seconds: float = PATIENCE_S) -> None:
        """Until all of them happened. Raises TimeoutError."""
        end = time.monotonic() + seconds
        while not all(name in self.first for name in names):
            if time.monotonic() > end:
                raise TimeoutError(
                    f'no {", ".join(name for name in names if name not in self.first)} after {seconds:.0f} s; '
                    f'{self.why}'
                )
            time.sleep(0.002)


def name_of(pid: int) -> str:
    """The node's name (`__name:=`), else the program's."""
    words = Path(f'/proc/{pid}/cmdline').read_text().split('\0')
    named = [word.removeprefix('__name:=') for word in words if word.startswith('__name:=')]
    programs = [word for word in words if word and not word.startswith('-') and 'python' not in word.rpartition('/')[2]]
    return (named or [program.rpartition('/')[2] for program in programs[:1]] or [str(pid)])[0]


def _costs(pids, drive):
    """({pid: % of a core while `drive()` runs}, its result)."""
    before, began = {pid: cpu_seconds(pid) for pid in pids}, time.monotonic()
    result = drive()
    lasted = time.monotonic() - began
    return {pid: 100.0 * (cpu_seconds(pid) - before[pid]) / lasted for pid in pids}, result


def _until_command(client, ears):
    """Seconds from a goal to the first command; the goal is taken back then."""
    ears.forget()
    sent = time.monotonic()
    client.send_goal(goal_at(NEXT))
    ears.wait('command')
    client.cancel_goal()
    client.wait_for_result(rospy.Duration(5.0))
    time.sleep(1.0)  # the chair comes to rest
    return ears.first['command'] - sent


def start_and_drive(driving: bool, composed: bool = False) -> dict[str, Any]:
    """A launch, `composed` or not, and its first goal: {"start": [(what, s since roslaunch), ...], "start_cpu": s of
    all processes until the chair moves}; where it goes on `driving`, the beginnings of more goals besides:
    {"commands": [s, ...], "cpu", "memory": {name: ...}, "of_the_machine": MB of all, what they share counted once}.
    """
    env = environment()
    os.environ['ROS_MASTER_URI'] = env['ROS_MASTER_URI']
    LOG.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix='sara_') as folder, open(LOG, 'w', encoding='utf-8') as log:
        save(f'{folder}/calibration.yaml', SIMULATED)
        arguments = {'calibration': 'saved', 'calibration_file': f'{folder}/calibration.yaml', 'port': f'{folder}/can'}
        arguments |= {'composed': 'true'} if composed else {}
        began, marks = time.monotonic(), []

        def mark(what, at=None):
            marks.append((what, (at or time.monotonic()) - began))

        with launched('sara_bringup', 'sara.launch', arguments, env, stdout=log, stderr=log) as process:
            while not rosgraph.is_master_online():
                time.sleep(0.02)
            mark('the master answers')
            wait_for_launch(PATIENCE_S)
            rospy.init_node('bench_stack', disable_signals=True)
            ears, client = Ears(), actionlib.SimpleActionClient('move_base', MoveBaseAction)
            while not client.wait_for_server(rospy.Duration(0.05)):
                time.sleep(0.01)
            mark('move_base answers')
            commands = [_first_goal(client, ears, mark)]
            pids = descendants(process.pid)
            start_cpu = sum(cpu_seconds(pid) for pid in pids)
            start = {'start': sorted(marks, key=lambda entry: entry[1]), 'start_cpu': start_cpu}
            return {**start, **(_drive_on(client, ears, pids, commands) if driving else {'commands': commands})}


def _first_goal(client, ears, mark):
    """Send the first goal once the chair may drive; s from it to the first command."""
    ears.wait('pose', 'gate')
    mark('the pose is known', ears.first['pose'])
    mark('the gate is open', ears.first['gate'])
    ears.forget()
    sent = time.monotonic()
    client.send_goal(goal_at(GOAL))
    ears.wait('command', 'motion')
    mark('the first goal is sent', sent)
    mark('the first command', ears.first['command'])
    mark('the chair moves', ears.first['motion'])
    return ears.first['command'] - sent


def _drive_on(client, ears, pids, commands):
    """To the first goal, then the beginnings of more."""
    cpu, reached = _costs(
        pids,
        lambda: client.wait_for_result(rospy.Duration(PATIENCE_S)) and client.get_state() == GoalStatus.SUCCEEDED,
    )
    if not reached:
        raise RuntimeError(f'the goal was not reached: {client.get_goal_status_text()}')
    commands = commands + [_until_command(client, ears) for _ in range(MORE)]
    names = {pid: name_of(pid) for pid in pids}
    memory = {names[pid]: peak_memory_mb(pid) for pid in pids}
    return {
        'commands': commands,
        'cpu': {names[pid]: share for pid, share in cpu.items()},
        'memory': memory,
        'of_the_machine': sum(map(share_of_memory_mb, pids)),
    }


def stack() -> Iterator[Timed | list[Timed]]:
    """From a few launches."""
    starts = sorted(
        (in_a_process(start_and_drive, number == STARTS - 1) for number in range(STARTS)),
        key=lambda start: start['start'][-1][1],
    )
    marks = '; '.join(f'{at:.2f} s {what}' for what, at in starts[len(starts) // 2]['start'])
    yield [
        timed(
            'roslaunch to first motion',
            's',
            [start['start'][-1][1] for start in starts],
            scaled=False,
            limit=Limit('median', 6.0),
            text=marks,
        ),
        timed('CPU of all processes until then', 's', [start['start_cpu'] for start in starts]),
    ]
    result = next(start for start in starts if 'cpu' in start)
    firsts = ', '.join(f'{start["commands"][0]:.2f}' for start in starts)
    yield timed(
        'goal to first command', 's', result['commands'], scaled=False, text=f'the first after each launch {firsts} s'
    )
    yield _costs_of_nodes(result, 'the whole stack with the simulator', 45.0, 1200.0)
    composed = in_a_process(start_and_drive, True, True)
    yield _costs_of_nodes(composed, 'the whole stack, composed', 35.0, 450.0)[:2]


def _costs_of_nodes(result, name, most, most_memory):
    total, memory = sum(result['cpu'].values()), sum(result['memory'].values())
    return [
        Timed(
            f'{name}, driving',
            '% of a core',
            total,
            None,
            1,
            limit=Limit('median', most),
            memory=memory,
        ),
        Timed(
            f'memory of {name}',
            'MB',
            memory,
            None,
            1,
            scaled=False,
            limit=Limit('median', most_memory),
            text='sum of what each process held at the most, what they share counted for each; '
            f'{result["of_the_machine"]:.0f} MB of the machine, counted once',
        ),
        *(
            Timed(f'node {name}, driving', '% of a core', share, None, 1, memory=result['memory'][name])
            for name, share in sorted(result['cpu'].items(), key=lambda item: -item[1])
        ),
    ]
