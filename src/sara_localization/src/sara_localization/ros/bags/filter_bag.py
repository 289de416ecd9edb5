"""The filter over a recorded bag, without a master: the same answer at every run, and faster than it was recorded.

    rosrun sara_localization filter_bag IN.bag OUT.bag --params FILE.yaml [--filter ekf|ukf] [--backend
    compiled|filterpy]
        [--plot FILE.png] [--csv FILE.csv] [--tum FILE.tum] [--reference TOPIC] [--static-tf "X Y Z YAW PITCH ROLL
        PARENT CHILD"]...
        [--navsat NAVSAT.yaml [--fix TOPIC] [--imu TOPIC]]

How time passes: bag_filter.py. OUT.bag holds odometry/filtered, /tf (what the filter broadcasts) and, if configured,
accel/filtered; "-" for OUT.bag writes none. With --reference (a topic of the bag: NavSatFix, Odometry, PoseStamped,
PoseWithCovarianceStamped) the distance from it after the best turn and move is told. With --navsat
navsat_transform_node runs beside the filter, and odometry/gps is in OUT.bag too. The last line on stdout is JSON.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import sys
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import rosbag
import rospy
from tf2_msgs.msg import TFMessage
from tqdm import tqdm

from sara_common.ros import bags
from sara_localization.bags.alignment import aligned, local_plane, rmse
from sara_localization.bags.export import CsvWriter, InputTrack, Track, TumWriter
from sara_localization.bags.plots import draw_drive
from sara_localization.config.filter_config import BACKENDS, FilterConfig
from sara_localization.geometry.rigid import rpy_from_quaternion
from sara_localization.gps.answers import UNMEASURED
from sara_localization.gps.fixes import NO_FIX
from sara_localization.ros import conversions
from sara_localization.ros.bags import bag_tools, gps_options
from sara_localization.ros.bags.bag_filter import BagFilter
from sara_localization.ros.bags.bag_tools import UsageError, checked_config, load_params, static_transform
from sara_localization.ros.bags.gps_filter import GPS, HEADING, GpsBagFilter, GpsInputs
from sara_localization.ros.inputs import resolved
from sara_localization.ros.navsat import messages


def _bag_writer(sink, config):
    def write(now, output):
        stamp = conversions.ros_time(now)
        if output.transform is not None:
            sink.write('/tf', TFMessage([conversions.transform_message(output.transform)]), stamp)
        if output.published:
            sink.write('odometry/filtered', conversions.odometry_message(output), stamp)
            if config.publish_acceleration:
                sink.write('accel/filtered', conversions.acceleration_message(output), stamp)

    return write


def _gps_writer(sink):
    def write(now, data):
        if sink:
            sink.write('odometry/gps', messages.odometry_message(data), conversions.ros_time(now))

    return write


class _Tracks:
    """The poses of the inputs, for the plot; `wanted`: whether there will be one."""

    def __init__(self, wanted: bool):
        self.wanted, self.by_name = wanted, {}

    def add(self, i, data):
        if not self.wanted or i.kind not in ('odom', 'pose'):
            return
        track = self.by_name.setdefault(i.name, InputTrack(f'{i.name} ({i.topic})'))
        P = data.pose_covariance if i.kind == 'odom' else data.covariance
        told = P[5, 5] < UNMEASURED  # else its places alone count, which are in the world's frame
        yaw = rpy_from_quaternion(data.orientation)[2] if told else math.nan
        track.add(data.stamp, data.position[0], data.position[1], yaw)


def _reference(bag, topic):
    """(times (n,) s, positions (n, 2) m) of a topic of the bag."""
    rows, fixes = [], False
    for _, msg, _ in bags.messages(bag, [resolved(topic), topic.lstrip('/')]):
        fixes = msg._type == 'sensor_msgs/NavSatFix'  # pylint: disable=protected-access
        if fixes:
            known = msg.status.status > NO_FIX
            place = (msg.latitude, msg.longitude) if known else (math.nan, math.nan)
        else:
            pose = getattr(msg, 'pose', None)
            position = getattr(getattr(pose, 'pose', pose), 'position', None)
            if position is None:
                raise UsageError(
                    f'--reference {topic} is a {msg._type}: it must be a NavSatFix, Odometry, PoseStamped or '
                    'PoseWithCovarianceStamped'
                )  # pylint: disable=protected-access
            place = position.x, position.y
        if all(map(math.isfinite, place)):
            rows.append((msg.header.stamp.to_sec(), *place))
    if len(rows) < 3:
        raise UsageError(f'--reference {topic}: the bag holds {len(rows)} usable messages of it; at least 3 are needed')
    table = np.array(sorted(rows))
    return table[:, 0], local_plane(table[:, 1], table[:, 2]) if fixes else table[:, 1:]


def _compared(track, times, places):
    """(root mean square distance in m, the reference (n, 2) turned and moved onto the track)."""
    t, way = np.array(track.t), np.array(track.pose)[:, :2]
    inside = (times >= t[0]) & (times <= t[-1])
    if inside.sum() < 3:
        raise UsageError('the reference and the estimate do not overlap in time')
    at = np.column_stack([np.interp(times[inside], t, way[:, k]) for k in (0, 1)])
    return rmse(t, way, times, places), aligned(places[inside], at)


class Wanted(NamedTuple):
    """What is asked for besides the bag: files to be written (a table, the poses in TUM's format, a picture), and the
    topic of the bag that holds better positions; gps: navsat_transform_node beside the filter.
    """

    csv: str | None = None
    tum: str | None = None
    plot: str | None = None
    reference: str | None = None
    gps: GpsInputs | None = None


def run(
    in_bag: str,
    out_bag: str | None,
    config: FilterConfig,
    static: Sequence = (),
    quiet: bool = False,
    wanted: Wanted = Wanted(),
) -> dict:
    """Filter a bag into another (None: into none) and into the files `wanted`; returns what is printed as JSON."""
    if out_bag is not None and os.path.realpath(in_bag) == os.path.realpath(out_bag):
        raise UsageError('OUT.bag must be another file than IN.bag')
    tracks, track = _Tracks(wanted.plot is not None), Track()
    with contextlib.ExitStack() as files:
        source = files.enter_context(rosbag.Bag(in_bag, skip_index=True))  # bag_reader.py reads it quicker
        sink = files.enter_context(rosbag.Bag(out_bag, 'w')) if out_bag is not None else None
        to_bag = _bag_writer(sink, config) if sink else None
        tables = [
            writer(files.enter_context(open(path, 'w')))
            for path, writer in ((wanted.csv, CsvWriter), (wanted.tum, TumWriter))
            if path
        ]
        tables += [track] if wanted.plot or wanted.reference else []
        known = _reference(source, wanted.reference) if wanted.reference else None
        said = bag_tools.Warnings(quiet)
        own = [(GPS, 'nav_msgs/Odometry'), (HEADING, 'sensor_msgs/Imu')] if wanted.gps else []
        for _, sentence in bag_tools.wrong_topics(config, bag_tools.topic_types(source) + own):
            said(sentence)
        rest = {'on_output': _spread(to_bag, tables), 'report': said, 'on_input': tracks.add}
        if wanted.gps:
            machine = GpsBagFilter(wanted.gps, config, static, _gps_writer(sink), inform=said.note, **rest)
        else:
            machine = BagFilter(config, static, **rest)
        seconds = _play(source, machine, quiet)
    if machine.last is None:
        lines = machine.engine.status_lines(0.0)
        raise UsageError('no estimate came out of {}:\n  {}'.format(in_bag, '\n  '.join(lines)))
    if not quiet:
        accounts = machine.navsat.accounts.values() if wanted.gps else ()
        for line in [*machine.engine.status_lines(machine.last.stamp), *(a.line(machine.last.stamp) for a in accounts)]:
            print(line, file=sys.stderr)
    result = {
        'final': [float(v) for v in machine.last.state[:6]],
        'messages': machine.messages,
        'seconds': round(seconds, 3),
    }
    if wanted.gps:
        fix = machine.navsat.accounts['fix']
        result['gps'] = {'fixes': fix.received, 'converted': fix.used}
    laid = None
    if known is not None:
        distance, laid = _compared(track, *known)
        result['rmse'] = round(distance, 4)
    if wanted.plot:
        draw_drive(wanted.plot, track, tracks.by_name.values(), os.path.basename(in_bag), laid)
    return result


def _spread(to_bag, tables):
    """A function of (time of the tick in s, FilterOutput) that gives it to to_bag (or None) and to the tables."""

    def on_output(now, output):
        if to_bag:
            to_bag(now, output)
        if output.published:
            for table in tables:
                table.write(output)

    return on_output


def _play(source, machine, quiet) -> float:
    """All of the bag through the filter; returns the seconds it took."""
    names = [topic for topic in source.get_type_and_topic_info().topics if resolved(topic) in machine.topics]
    total = source.get_message_count(names) if names else 0
    began = time.perf_counter()
    with tqdm(total=total, unit='msg', file=sys.stderr, disable=quiet, mininterval=0.2) as bar:
        for topic, msg, received in bag_tools.unread_messages(source, names) if names else ():
            machine.deliver(topic, msg, received)
            bar.update()
        machine.finish()
    return time.perf_counter() - began


def _parser():
    parser = argparse.ArgumentParser(prog='filter_bag', description='Run the filter over a bag, without a master.')
    add = parser.add_argument
    add('in_bag', metavar='IN.bag')
    add('out_bag', metavar='OUT.bag', help='where the estimate goes; - for nowhere')
    add('--params', required=True, metavar='FILE.yaml', help='the parameters of ekf_localization_node')
    add('--filter', default='ekf', choices=['ekf', 'ukf'], help='which filter (default: ekf)')
    add(
        '--backend',
        choices=BACKENDS,
        help='what computes it, in place of the `backend` in FILE.yaml (default: compiled)',
    )
    add('--csv', metavar='FILE.csv', help='a table of the estimates with their standard deviations')
    add('--tum', metavar='FILE.tum', help="the poses in TUM's format (evo)")
    add('--plot', metavar='FILE.png', help='a picture of the way, the yaw, their uncertainty and the speeds')
    add('--reference', metavar='TOPIC', help='a topic of the bag with better positions: the distance from it is told')
    add('--quiet', action='store_true', help='no progress, no warnings')
    gps_options.add(parser)
    bag_tools.add_static_option(parser)
    return parser


def _params(arguments):
    params = load_params(arguments.params)
    return {**params, 'backend': arguments.backend} if arguments.backend else params


def main(argv: list[str] | None = None) -> None:
    """The program; its status is 1 where something cannot be used."""
    arguments = _parser().parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    try:
        config = checked_config(_params(arguments), arguments.filter, arguments.quiet)
        static = [static_transform(text) for text in arguments.static_tf]
        out_bag = None if arguments.out_bag == '-' else arguments.out_bag
        gps = gps_options.inputs(arguments, arguments.quiet) if arguments.navsat else None
        wanted = Wanted(arguments.csv, arguments.tum, arguments.plot, arguments.reference, gps)
        result = run(arguments.in_bag, out_bag, config, static, arguments.quiet, wanted)
    except (UsageError, OSError, rosbag.ROSBagException) as error:
        sys.exit(f'filter_bag: {error}')
    print(json.dumps(result))
