"""1000 frames a second from the adapter's bytes through canserial.py and read.py to a topic: losses, latency, CPU.

An emulated Lawicel adapter on a pseudo-terminal writes encoder frames whose step counter is their number; this process
writes them and receives `encoders`, so both ends of a latency are read from one clock. Not simulated time: speed is the
question.
"""

import argparse
import json
import os
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import IO, Any

import numpy as np
import rosgraph
import rospy
from nav_msgs.msg import Odometry

from canserial.dbc.bus import BusDescription
from canserial.msg import Encoder
from sara_bringup.ros.masters import environment, launched
from sara_bringup.ros.processes import process_of
from sara_lab.workers.cost import cpu_seconds, peak_memory_mb
from sara_sim.bus.lawicel import LawicelAdapter
from sara_sim.bus.terminal import Terminal

RAMP_S = 2.0  # not counted: connections and caches settle
DRAIN_S = 2.0


class Feed:
    """The bus: encoder frames of both wheels, in turn, at a fixed rate."""

    def __init__(self, terminal: Terminal, rate: float) -> None:
        self.terminal, self.rate = terminal, rate
        self.adapter = LawicelAdapter()
        self.bus = BusDescription.default()
        self.sent = {}  # number -> when its bytes were written, s
        self.dropped = 0

    def listen(self) -> None:
        """Answer the PC once."""
        answer, _ = self.adapter.feed(self.terminal.read(0.0))
        if answer:
            self.terminal.write(answer)

    def run(self, seconds: float) -> None:
        """Write frames for so long; the caller's thread keeps the pace."""
        names, start = ('ENCODER_RIGHT', 'ENCODER_LEFT'), time.monotonic()
        for number in range(int(seconds * self.rate)):
            self.listen()
            due = start + number / self.rate
            wait = due - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            # Both counters of one wheel move on as those of a wheel that turns slowly.
            data = self.adapter.frame_bytes(
                self.bus.encode(names[number % 2], steps=number, time=number * 10000 // self.rate)
            )
            self.sent[number] = time.monotonic()
            self.dropped += not self.terminal.write(data)


def measure(rate: float, seconds: float, log: IO[str] | None = None) -> dict[str, Any]:
    """{name: figure} of one run. log: a file for what the nodes say; None: the terminal."""
    env = environment()
    os.environ['ROS_MASTER_URI'] = env['ROS_MASTER_URI']
    arrived = {}
    with tempfile.TemporaryDirectory(prefix='sara_') as folder, Terminal(f'{folder}/can') as terminal:
        feed = Feed(terminal, rate)
        with launched('canserial', 'canserial.launch', {'port': f'{folder}/can'}, env, stdout=log, stderr=log):
            while not rosgraph.is_master_online():
                time.sleep(0.1)
            rospy.init_node('bench_bus', disable_signals=True)
            topic = rospy.Subscriber(
                'encoders',
                Encoder,
                lambda message: arrived.setdefault(message.steps, time.monotonic()),
                queue_size=10000,
                tcp_nodelay=True,
            )
            while not (feed.adapter.is_open and topic.get_num_connections()):
                feed.listen()
                time.sleep(0.001)
            feeding = threading.Thread(target=feed.run, args=(RAMP_S + seconds,))
            feeding.start()
            time.sleep(RAMP_S)
            pids = {name: process_of(name) for name in ('/canserial', '/read')}
            before, began = {name: cpu_seconds(pid) for name, pid in pids.items()}, time.monotonic()
            feeding.join()
            memory = max(peak_memory_mb(pid) for pid in pids.values())
            used = {name: (cpu_seconds(pid) - before[name]) / (time.monotonic() - began) for name, pid in pids.items()}
            time.sleep(DRAIN_S)
    return _figures(feed, arrived, rate, seconds, (memory, used))


def _figures(feed, arrived, rate, seconds, costs):
    """Plain data; `arrived`: {number of a frame: when}; `costs`: memory in MB, {node: share of a core}."""
    counted, (memory, used) = range(int(RAMP_S * rate), int((RAMP_S + seconds) * rate)), costs
    latency = 1e3 * np.array([arrived[number] - feed.sent[number] for number in counted if number in arrived])
    return {
        'frames': len(counted),
        'seconds': seconds,
        'lost': len(counted) - len(latency),
        'refused_by_the_port': feed.dropped,
        'p50_ms': float(np.percentile(latency, 50)),
        'p99_ms': float(np.percentile(latency, 99)),
        'max_ms': float(latency.max()),
        'memory_mb': memory,
        'cpu_percent': {name: 100.0 * share for name, share in used.items()},
    }


FRAMES_PERIOD_S = 0.1  # of each wheel's counter, as on the chair
PAIR_S = 0.02  # between the two wheels' frames


def measure_odometry(seconds: float, log: IO[str] | None = None) -> tuple[list[float], int]:
    """([ms from the bytes of the later frame of a pair to the odometry made of it, ...], how many pairs made none),
    with diff_drive_controller; log: as in `measure`.
    """
    env = environment()
    os.environ['ROS_MASTER_URI'] = env['ROS_MASTER_URI']
    arrived, latency, lost = [], [], 0
    with tempfile.TemporaryDirectory(prefix='sara_') as folder, Terminal(f'{folder}/can') as terminal:
        feed = Feed(terminal, 1.0 / FRAMES_PERIOD_S)
        with launched('sara_lab', 'bench_odometry.launch', {'port': f'{folder}/can'}, env, stdout=log, stderr=log):
            while not rosgraph.is_master_online():
                time.sleep(0.1)
            rospy.init_node('bench_odometry', disable_signals=True)
            topic = rospy.Subscriber(
                '/diff_drive_controller/odom',
                Odometry,
                lambda message: arrived.append(time.monotonic()),
                queue_size=100,
                tcp_nodelay=True,
            )
            while not (feed.adapter.is_open and topic.get_num_connections()):
                feed.listen()
                time.sleep(0.001)
            pairs = int((RAMP_S + seconds) / FRAMES_PERIOD_S)
            _feed_pairs(feed, terminal, pairs)
            time.sleep(0.2)
    for number in range(2 * int(RAMP_S / FRAMES_PERIOD_S) + 1, 2 * pairs - 2, 2):
        came = [at for at in arrived if feed.sent[number] <= at < feed.sent[number + 1]]
        if came:
            latency.append(1e3 * (came[0] - feed.sent[number]))
        else:
            lost += 1
    return latency, lost


def _feed_pairs(feed, terminal, pairs):
    """Both wheels' frames, as often as the chair sends them."""
    start = time.monotonic()
    for number in range(2 * pairs):
        due = start + number // 2 * FRAMES_PERIOD_S + number % 2 * PAIR_S
        while time.monotonic() < due:
            feed.listen()
            time.sleep(max(0.0, min(0.005, due - time.monotonic())))
        data = feed.adapter.frame_bytes(
            feed.bus.encode(
                ('ENCODER_RIGHT', 'ENCODER_LEFT')[number % 2],
                steps=100 * (number // 2),
                time=1000 * (number // 2),
            )
        )
        feed.sent[number] = time.monotonic()
        feed.dropped += not terminal.write(data)


def main() -> None:
    """Exit status 0 if nothing was lost and the 99th percentile is under 5 ms."""
    parser = argparse.ArgumentParser(prog='bench_bus', description=__doc__)
    parser.add_argument('--rate', type=int, default=1000, help='frames per second')
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--out', type=Path, help='JSON file')
    arguments = parser.parse_args()
    print(f'{arguments.rate} frames/s through canserial.py and read.py for {arguments.seconds:g} s', flush=True)
    result = measure(arguments.rate, arguments.seconds)
    print(
        f'  lost {result["lost"]} of {result["frames"]} ({result["refused_by_the_port"]} not taken by the '
        f'port); byte to topic p50 {result["p50_ms"]:.2f} ms, p99 {result["p99_ms"]:.2f} ms, '
        f'max {result["max_ms"]:.1f} ms; CPU '
        + ', '.join(f'{name[1:]} {share:.0f} %' for name, share in result['cpu_percent'].items())
    )
    if arguments.out:
        arguments.out.write_text(json.dumps(result, indent=1))
    sys.exit(0 if result['lost'] == 0 and result['p99_ms'] < 5.0 else 1)
