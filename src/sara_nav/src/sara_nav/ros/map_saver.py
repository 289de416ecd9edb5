"""The program map_saver: writes the next map on topic ``map`` (map:=TOPIC for another) into files, and ends.

It keeps the options of the C++ map_saver; --fmt and --mode are added.
"""

import argparse
import sys
import threading

import rospy
from nav_msgs.msg import OccupancyGrid

from sara_common.ros.node import start_node
from sara_nav.grids.grid import GridError
from sara_nav.maps.map_io import MapError
from sara_nav.maps.map_saver import FORMATS, SAVED_MODES, SaveError, SaverConfig, save_map
from sara_nav.ros.conversions import grid_from_msg


class Parser(argparse.ArgumentParser):
    """An argument parser whose exit status is the peer's."""

    def error(self, message: str) -> None:
        """Print the usage and why; end with status 1."""
        self.print_usage(sys.stderr)
        self.exit(1, f'{self.prog}: {message}\n')


def configuration(arguments: list[str]) -> SaverConfig:
    """Return the SaverConfig of a command line; ends the program for a bad one."""
    parser = Parser(
        prog='map_saver',
        description=__doc__,
        allow_abbrev=False,
        usage=(
            'map_saver [-h] [--occ THRESHOLD] [--free THRESHOLD] [-f NAME] [--fmt {}] [--mode {}] [map:=TOPIC]'.format(
                '|'.join(FORMATS), '|'.join(SAVED_MODES)
            )
        ),
    )
    default = SaverConfig()
    parser.add_argument(
        '--occ', type=int, default=default.occupied, metavar='1..100', help='occupied from this value on (%(default)s)'
    )
    parser.add_argument(
        '--free', type=int, default=default.free, metavar='0..100', help='free up to this value (%(default)s)'
    )
    parser.add_argument(
        '-f', dest='name', default=default.name, metavar='NAME', help='writes NAME.pgm and NAME.yaml (%(default)s)'
    )
    parser.add_argument('--fmt', default=default.image_format, help='pgm or png (%(default)s)')
    parser.add_argument(
        '--mode', default=default.mode, help='trinary, or raw: every value as it is, for maps with shades (%(default)s)'
    )
    given = parser.parse_args(arguments)
    config = SaverConfig(given.name, given.occ, given.free, given.fmt, given.mode)
    if config.faults():
        parser.error('; '.join(config.faults()))
    return config


def main() -> None:
    """Exit status 0 when a map was written."""
    config = configuration(rospy.myargv(sys.argv)[1:])
    start_node('map_saver', anonymous=True)
    arrived, maps = threading.Event(), []

    def take(msg):
        if not arrived.is_set():
            maps.append(msg)
            arrived.set()

    subscriber = rospy.Subscriber('map', OccupancyGrid, take, queue_size=1)
    while not arrived.wait(0.1):
        if rospy.is_shutdown():
            sys.exit(1)
        _say_what_is_missing(subscriber)
    info = maps[0].info
    rospy.loginfo('a map of %d x %d cells of %.3g m came', info.width, info.height, info.resolution)
    try:
        written = save_map(grid_from_msg(maps[0]), config)
    except (SaveError, GridError, MapError) as error:
        rospy.logerr('%s', error)
        sys.exit(1)
    rospy.loginfo('written: %s and %s', *written)


def _say_what_is_missing(subscriber):
    topic = subscriber.resolved_name
    if subscriber.get_num_connections():
        rospy.loginfo_throttle(5.0, f'waiting for a map on {topic}')
    else:
        rospy.loginfo_throttle(5.0, f'waiting for a map on {topic}, which nobody publishes')
