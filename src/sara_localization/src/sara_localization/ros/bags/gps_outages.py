"""How far a filter is off after a time without GPS: a bag is filtered again and again, each time with the fixes of
another window withheld.

    rosrun sara_localization gps_outages IN.bag --params FILE.yaml --navsat NAVSAT.yaml [--fix /fix] [--imu /imu/data]
        [--windows 20] [--seconds 60] [--filter ekf|ukf] [--static-tf "X Y Z YAW PITCH ROLL PARENT CHILD"]...

Windows lie evenly over the drive, the first after as long with GPS as without. A window's error is the distance of the
filter's position at its end from odometry/gps, interpolated, of the same time. The last line on stdout is JSON:
{"median": m, "worst": m, "errors": [m, ...], "driven": [m, ...]}.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import rosbag
import rospy
from tqdm import tqdm

from sara_localization.config.filter_config import FilterConfig
from sara_localization.ros.bags import bag_tools, gps_options
from sara_localization.ros.bags.bag_tools import UsageError
from sara_localization.ros.bags.gps_filter import GpsBagFilter, GpsInputs
from sara_localization.ros.inputs import resolved


class Drive:
    """A bag's messages, ready to be filtered many times."""

    def __init__(self, path: str, gps: GpsInputs, config: FilterConfig, static: Sequence):
        self.gps, self.config, self.static = gps, config, static
        topics = GpsBagFilter(gps, config, static).topics
        with rosbag.Bag(path) as bag:
            names = [name for name in bag.get_type_and_topic_info().topics if resolved(name) in topics]
            self.messages = list(bag_tools.unread_messages(bag, names))

    def filtered(self, without: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
        """(t, x, y) (n, 3) of the filter until the end of a window (s; the whole drive for an empty one) whose fixes
        it is not given, and (t, x, y) (m, 3) of odometry/gps.
        """
        begin, end = without
        track, places = [], []
        machine = GpsBagFilter(
            self.gps,
            self.config,
            self.static,
            on_gps=lambda now, data: places.append((data.stamp, *data.position[:2])),
            given=lambda stamp: not begin < stamp <= end,
            on_output=lambda now, output: track.append((output.stamp, *output.state[:2])),
        )
        for message in self.messages:
            machine.deliver(*message)
            if end and track and track[-1][0] > end:
                break
        else:
            machine.finish()
        return np.reshape(track, (-1, 3)), np.reshape(places, (-1, 3))


def outages(
    drive: Drive, windows: int, seconds: float, progress: Callable[[Iterable[float]], Iterable[float]] = iter
) -> list[tuple[float, float]]:
    """(error, way driven) in m of each window: evenly over the drive, the first after as long with GPS as without."""
    track, places = drive.filtered()
    if len(places) < 2:
        raise UsageError('no odometry/gps came out of the bag')
    first, last = places[0, 0] + seconds, places[-1, 0] - seconds
    if first > last:
        raise UsageError(f'the drive is too short: {seconds:g} s without GPS come after as long with it')
    found = []
    for begin in progress(np.linspace(first, last, windows)):
        end = begin + seconds
        at = drive.filtered((begin, end))[0]
        off = [np.interp(end, at[:, 0], at[:, k]) - np.interp(end, places[:, 0], places[:, k]) for k in (1, 2)]
        inside = track[(track[:, 0] >= begin) & (track[:, 0] <= end), 1:]
        driven = np.hypot(*np.diff(inside, axis=0).T).sum()
        found.append((float(np.hypot(*off)), float(driven)))
    return found


def main(argv: list[str] | None = None) -> None:
    """The program; its status is 1 where something cannot be used."""
    parser = argparse.ArgumentParser(prog='gps_outages', description='How far a filter is off without GPS.')
    add = parser.add_argument
    add('in_bag', metavar='IN.bag')
    add('--params', required=True, metavar='FILE.yaml', help='the parameters of the filter')
    add('--filter', default='ekf', choices=['ekf', 'ukf'], help='which filter (default: ekf)')
    add('--windows', type=int, default=20, help='how many (default: %(default)s)')
    add('--seconds', type=float, default=60.0, help='without GPS (default: %(default)s)')
    gps_options.add(parser, required=True)
    bag_tools.add_static_option(parser)
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    if arguments.windows < 1 or not arguments.seconds > 0.0:
        parser.error('--windows must be 1 or more and --seconds above 0')
    try:
        config = bag_tools.checked_config(bag_tools.load_params(arguments.params), arguments.filter)
        static = [bag_tools.static_transform(text) for text in arguments.static_tf]
        drive = Drive(arguments.in_bag, gps_options.inputs(arguments), config, static)
        found = outages(
            drive,
            arguments.windows,
            arguments.seconds,
            lambda it: tqdm(it, unit='window', file=sys.stderr, disable=None),
        )
    except (UsageError, OSError, rosbag.ROSBagException) as error:
        sys.exit(f'gps_outages: {error}')
    errors, driven = ([round(value, 3) for value in column] for column in zip(*found))
    print(
        json.dumps(
            {'median': round(float(np.median(errors)), 3), 'worst': max(errors), 'errors': errors, 'driven': driven}
        )
    )
