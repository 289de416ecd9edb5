"""nmea_serial_driver: a GPS receiver at a serial port to fix, vel, time_reference and /diagnostics."""

from __future__ import annotations

import termios
import threading
from dataclasses import fields, replace

import rospy
import serial
from geometry_msgs.msg import TwistStamped
from sensor_msgs.msg import NavSatFix, NavSatStatus, TimeReference

from nmea_navsat_driver.config import DriverConfig, prefixed
from nmea_navsat_driver.receiver import NO_FIX, Fix, Receiver, Velocity
from nmea_navsat_driver.sentences import Lines
from sara_common.config import ConfigError
from sara_common.diagnostics import ERROR, OK, WARN
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import start_node, until_shutdown

TIMEOUT = 0.2
FIRST_PAUSE, LAST_PAUSE = 0.2, 2.0
"""s of the wall clock."""
DIAGNOSTICS_PERIOD = 1.0
PORT_FAILS = (OSError, ValueError, termios.error)
"""What pyserial raises: OSError where there is no port, ValueError for an impossible baud rate, termios.error where the
port goes while it is opened.
"""


class DriverNode:
    """A thread reads the port, and opens it again when it is lost."""

    def __init__(self, config: DriverConfig):
        self.config = config
        self.receiver = Receiver(config, report=rospy.logwarn, inform=rospy.loginfo)
        self.fix_pub = rospy.Publisher('fix', NavSatFix, queue_size=10, tcp_nodelay=True)
        self.vel_pub = rospy.Publisher('vel', TwistStamped, queue_size=10, tcp_nodelay=True)
        self.time_pub = rospy.Publisher('time_reference', TimeReference, queue_size=10)
        self.diagnostics = Diagnostics('receiver', config.port)
        self._closed: str = 'not opened yet'  # why nothing is read; '' while the port is open
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name='gps', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._ending.set()
        self._thread.join(2.0)

    def diagnose(self) -> None:
        """Say how things are on /diagnostics."""
        without = self.receiver.without_since
        level, message = OK, f'{self.receiver.fixes} fixes'
        if self._closed:
            level, message = ERROR, f'{self.config.port}: {self._closed}'
        elif without is not None:
            level, message = WARN, f'no fix for {max(0.0, rospy.get_time() - without):.0f} s'
        elif not self.receiver.fixes:
            level, message = WARN, 'the receiver has said nothing yet'
        elif self.receiver.silent(rospy.get_time()):
            level, message = WARN, f'the receiver is silent, after {self.receiver.fixes} fixes'
        damaged = {f'damaged: {kind}': count for kind, count in self.receiver.problems.items()}
        self.diagnostics.publish(level, message, {'fixes': self.receiver.fixes, **damaged})

    def _run(self):
        pause = FIRST_PAUSE
        while not self._ending.is_set():
            try:
                with serial.Serial(self.config.port, self.config.baud, timeout=TIMEOUT) as port:
                    port.reset_input_buffer()  # what waited is old
                    rospy.loginfo('reading the GPS receiver at %s, %d baud', self.config.port, self.config.baud)
                    self._closed, pause = '', FIRST_PAUSE
                    self._read(port)
            except PORT_FAILS as error:
                if self._closed != str(error) and not self._ending.is_set():
                    self._closed = str(error)
                    rospy.logwarn('the GPS receiver is not read: %s; it is tried again and again', error)
            self._ending.wait(pause)
            pause = min(2.0 * pause, LAST_PAUSE)

    def _read(self, port):
        lines = Lines()
        while not self._ending.is_set():
            data = port.read(max(port.in_waiting, 1))
            for line in lines.feed(data):
                with until_shutdown():
                    self._publish(self.receiver.on_line(line, rospy.get_time()))

    def _publish(self, messages):
        for message in messages:
            header = {'stamp': rospy.Time.from_sec(message.stamp), 'frame_id': self.config.frame_id}
            if isinstance(message, Fix):
                self.fix_pub.publish(_fix(message, header))
            elif isinstance(message, Velocity):
                self.vel_pub.publish(_velocity(message, header))
            else:
                self.time_pub.publish(_time(message, header, self.config.time_ref_source or self.config.frame_id))


def _headed(msg, header):
    msg.header.stamp, msg.header.frame_id = header['stamp'], header['frame_id']
    return msg


def _fix(fix, header):
    msg = _headed(NavSatFix(), header)
    msg.status.status = fix.status
    msg.status.service = NavSatStatus.SERVICE_GPS if fix.status != NO_FIX else 0
    msg.latitude, msg.longitude, msg.altitude = fix.latitude, fix.longitude, fix.altitude
    east, north, up = fix.variances
    msg.position_covariance = [east, 0.0, 0.0, 0.0, north, 0.0, 0.0, 0.0, up]
    msg.position_covariance_type = fix.covariance_type
    return msg


def _velocity(velocity, header):
    msg = _headed(TwistStamped(), header)
    msg.twist.linear.x, msg.twist.linear.y = velocity.east, velocity.north
    return msg


def _time(reference, header, source):
    msg = _headed(TimeReference(), header)
    msg.time_ref, msg.source = rospy.Time.from_sec(reference.utc), source
    return msg


def _config() -> DriverConfig:
    """From the private parameters, and `tf_prefix` of the nearest namespace. Raises ConfigError."""
    given = rospy.get_param('~', {})
    known = {field.name: field for field in fields(DriverConfig)}
    unknown = sorted(set(given) - {*known, 'tf_prefix'})
    if unknown:
        rospy.logwarn('%s has no parameter %s', rospy.get_name(), ', '.join(unknown))
    config = DriverConfig(**{name: value for name, value in given.items() if name in known})
    where = rospy.search_param('tf_prefix')
    return replace(config, frame_id=prefixed(config.frame_id, where and rospy.get_param(where)))


def main() -> None:
    """Run the node until ROS shuts down; exit status 1 for parameters that are not allowed."""
    start_node('nmea_serial_driver')
    try:
        config = _config()
    except ConfigError as error:
        rospy.logfatal('wrong configuration of %s: %s', rospy.get_name(), error)
        raise SystemExit(1) from None
    node = DriverNode(config)
    while not rospy.is_shutdown():
        with until_shutdown():
            node.diagnose()
        rospy.rostime.wallsleep(DIAGNOSTICS_PERIOD)
    node.close()
