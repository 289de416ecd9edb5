"""What the commands beside the chair share: they read canrx themselves, and tell read.py what they found.

The offset of the gyroscope is measured first, so that nothing depends on what read.py is set to.
"""

from __future__ import annotations

import argparse
import threading
import time
from collections.abc import Sequence
from typing import NamedTuple

import rospy
from std_srvs.srv import Trigger

from canserial.calibration.calibration_file import Calibration
from canserial.dbc.bus import BusDescription
from canserial.msg import CAN
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from canserial.reader.status import status_of
from canserial.ros import conversions


class GivenUp(Exception):
    """The procedure cannot go on; nothing is saved."""


class BusTool:
    """`reader`: Reader of canrx, behind `lock`; `options`: the command line."""

    def __init__(self, options: argparse.Namespace, stored: Calibration | None, gain: float | None) -> None:
        """stored: what is known of the chair; gain: of the turned angle, None: the stored one."""
        self.options = options
        config = ReaderConfig.of(gain=gain, calibration_time=options.calibration_time)
        bus = BusDescription.named(options.dbc) if options.dbc else BusDescription.default()
        self.reader = Reader(config, bus, stored)
        self.lock = threading.Lock()
        rospy.Subscriber('canrx', CAN, self.on_can, tcp_nodelay=True)  # of a full queue frames would be lost unseen

    def on_can(self, message: CAN) -> None:
        """A frame to the reader."""
        with self.lock:
            self.on_readings(self.reader.on_frame(conversions.msg_to_frame(message)))

    def on_readings(self, readings: Sequence[NamedTuple]) -> None:
        """What a frame said; called with the lock held."""

    def measure_offset(self) -> None:
        """Wait until the reader has measured the offset at rest."""
        print(f'Keep the chair still for {self.options.calibration_time:g} s.', flush=True)
        said = None
        while not self.reader.ready:
            self.pause(0.1)
            with self.lock:
                text, restarts = status_of(self.reader, rospy.get_time()).text, self.reader.calibration.restarts
            news = text.split(':')[0], restarts
            if news != said:
                said = news
                print(f'  {text}', flush=True)
        with self.lock:
            self.reader.set_yaw(0.0, rospy.get_time())  # how it stood until now does not matter
        print('  offset {:.4f}, {:.4f}, {:.4f} deg/s'.format(*self.reader.offset), flush=True)

    @staticmethod
    def pause(seconds: float) -> None:
        """Wall time, for the bus does not wait for simulated time."""
        time.sleep(seconds)
        if rospy.is_shutdown():
            raise GivenUp('ROS was shut down')


def common_arguments(parser: argparse.ArgumentParser, dbc: str, what: str) -> None:
    """--file, --calibration-time, --dbc (with this default), --node and --dry-run of a command that finds `what`."""
    parser.add_argument(
        '--file', default='', help='calibration file (that of --node); a relative path lies in ROS_HOME'
    )
    parser.add_argument(
        '--calibration-time', type=float, default=20.0, metavar='S', help='of the offset, at rest, first (20)'
    )
    own = dbc or "the robot's"
    parser.add_argument('--dbc', default=dbc, help=f'name or path of the bus description ({own})')
    parser.add_argument('--node', default='read', help=f'the read.py that is to take the {what} (read)')
    parser.add_argument('--dry-run', action='store_true', help=f'print the {what}, save nothing')


def reload(node: str, what: str) -> str:
    """Ask a running read.py to take the new `what` (gain, compass); returns a sentence about the outcome."""
    service = rospy.resolve_name(f'{node}/reload_{what}')
    try:
        rospy.wait_for_service(service, timeout=0.5)
        answer = rospy.ServiceProxy(service, Trigger)()
    except rospy.ROSException:
        return f'{service} is not there: the {what} counts from the next start of read.py'
    except rospy.ServiceException as error:
        return f'{service} failed: {error}'
    return f'{service}: {answer.message}'
