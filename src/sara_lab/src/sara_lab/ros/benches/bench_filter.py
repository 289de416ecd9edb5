"""What a live filter node costs: CPU and memory of the whole process, 50 Hz out, odometry at 50 Hz and an IMU at 100 Hz
in.

    rosrun sara_lab bench_filter [--filter ekf|ukf|both] [--seconds 20] [--out FILE.json]

A master of its own is started, so that nothing on the machine is disturbed. Beside the filter, at the same time and
from the same publishers, runs a bare rospy node with the same traffic (bench_bare.py): what a machine makes of a rospy
node swings by a factor of two, and the ratio of the two much less. robot_localization's node took, on the machine that
its figure was taken on (2 cores, C++),
1.77 % of a core for the EKF, 1.93 % for the UKF; a bare rospy node there took 1.5 %.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage

from sara_bringup.ros.own_master import own_master, running
from sara_bringup.ros.processes import process_of
from sara_lab.workers.cost import cpu_seconds, peak_memory_mb
from sara_localization.ros.wire import unread

PEER_PERCENT = {'ekf': 1.77, 'ukf': 1.93}
PEERS_BARE_PERCENT = 1.5
ALLOWED_PERCENT = 3.5
OUTPUTS = {'/filter': ('odometry/filtered', '/tf'), '/bare': ('bare/odometry', 'bare/tf')}
RAMP = 4.0  # s: connections and compiled code settle


def _messages():
    odometry, imu = Odometry(), Imu()
    odometry.header.frame_id, odometry.child_frame_id, imu.header.frame_id = 'odom', 'base_link', 'base_link'
    odometry.pose.pose.orientation.w = imu.orientation.w = 1.0
    odometry.twist.twist.linear.x, imu.linear_acceleration.z = 0.3, 9.81
    odometry.pose.covariance = odometry.twist.covariance = [1e-3 if k % 7 == 0 else 0.0 for k in range(36)]
    imu.orientation_covariance = imu.angular_velocity_covariance = imu.linear_acceleration_covariance = [
        1e-3 if k % 4 == 0 else 0.0 for k in range(9)
    ]
    return odometry, imu


def _feed(seconds, odometry_pub, imu_pub, odometry, imu):
    """100 steps a second for so long."""
    began = time.monotonic()
    for k in range(int(100 * seconds)):
        wait = began + k / 100.0 - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        odometry.header.stamp = imu.header.stamp = rospy.Time.now()
        imu_pub.publish(imu)
        if k % 2 == 0:
            odometry_pub.publish(odometry)


def measure(seconds: float, odometry_pub: rospy.Publisher, imu_pub: rospy.Publisher) -> dict[str, dict]:
    """{node: {cpu_percent, peak_mb, output_hz}} of /filter and /bare on the present master."""
    arrived, ears, outputs = {node: [] for node in OUTPUTS}, [], []
    for node, (odometry, transforms) in OUTPUTS.items():
        outputs.append(rospy.Subscriber(odometry, unread(Odometry), arrived[node].append, queue_size=100))
        ears.append(rospy.Subscriber(transforms, unread(TFMessage), lambda msg: None, queue_size=100))
    while not (
        all(s.get_num_connections() for s in outputs + ears)
        and min(odometry_pub.get_num_connections(), imu_pub.get_num_connections()) >= len(OUTPUTS)
    ):
        time.sleep(0.05)
    messages = _messages()
    _feed(RAMP, odometry_pub, imu_pub, *messages)
    pids = {node: process_of(node) for node in OUTPUTS}
    before, counts, began = (
        {node: cpu_seconds(pid) for node, pid in pids.items()},
        {n: len(a) for n, a in arrived.items()},
        time.monotonic(),
    )
    _feed(seconds, odometry_pub, imu_pub, *messages)
    lasted, result = time.monotonic() - began, {}
    for node, pid in pids.items():
        result[node] = {
            'cpu_percent': 100.0 * (cpu_seconds(pid) - before[node]) / lasted,
            'peak_mb': peak_memory_mb(pid),
            'output_hz': (len(arrived[node]) - counts[node]) / lasted,
        }
    for subscriber in outputs + ears:
        subscriber.unregister()
    return result


def runs(kinds: Sequence[str], seconds: float, rounds: int = 1) -> Iterator[tuple[str, dict[str, dict]]]:
    """Yield (kind, measure()'s result) for each of the kinds, `rounds` times in turn, on a master of their own. Makes
    this process a ROS node.
    """
    with own_master() as port:
        rospy.init_node('bench_filter', disable_signals=True)
        odometry_pub = rospy.Publisher('/diff_drive_controller/odom', Odometry, queue_size=10, tcp_nodelay=True)
        imu_pub = rospy.Publisher('/imu/data', Imu, queue_size=10, tcp_nodelay=True)
        for _ in range(rounds):
            for kind in kinds:
                with (
                    running(
                        'roslaunch',
                        '--no-summary',
                        '-p',
                        str(port),
                        'sara_lab',
                        'bench_filter.launch',
                        'filter:=' + kind,
                    ),
                    running(sys.executable, '-m', __name__.rpartition('.')[0] + '.bench_bare'),
                ):
                    yield kind, measure(seconds, odometry_pub, imu_pub)
        rospy.signal_shutdown('done')


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog='bench_filter', description='CPU and memory of a live filter node.')
    parser.add_argument('--filter', choices=['ekf', 'ukf', 'both'], default='both')
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--out', type=Path, help='JSON file')
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    results = {}
    for kind, result in runs(('ekf', 'ukf') if arguments.filter == 'both' else (arguments.filter,), arguments.seconds):
        node, bare = result['/filter'], result['/bare']
        results[kind] = {**node, 'bare': bare}
        print(
            '{}_localization_node: {:.2f} % of a core, {:.0f} MB, {:.1f} Hz out (the peer: {:.2f} %); {:.2f} '
            'of a bare rospy node with this traffic, '
            'which takes {:.2f} %, {:.0f} MB (the peer: {:.2f} of 1.5 %)'.format(
                kind,
                node['cpu_percent'],
                node['peak_mb'],
                node['output_hz'],
                PEER_PERCENT[kind],
                node['cpu_percent'] / bare['cpu_percent'],
                bare['cpu_percent'],
                bare['peak_mb'],
                PEER_PERCENT[kind] / PEERS_BARE_PERCENT,
            ),
            flush=True,
        )
    if arguments.out:
        arguments.out.write_text(json.dumps(results, indent=1))
    sys.exit(0 if all(result['cpu_percent'] <= ALLOWED_PERCENT for result in results.values()) else 1)
