"""read.py: frames of `canrx` to standard messages; the shell around canserial.reader.Reader."""

import math
import threading

import rospy
from canserial.bus import DEFAULT_DBC, BusDescription, BusError
from canserial.config import ReaderConfig
from canserial.msg import CAN, Encoder
from canserial.ranges import NAMES
from canserial.reader import Reader
from canserial.readings import (BatteryReading, EncoderReading, ImpactReading, ImuReading, JoystickReading, ModeReading,
                                RangeReading)
from canserial.ros import conversions
from canserial.ros.node import ERROR, OK, WARN, Diagnostics, config_from_params, stop
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import BatteryState, Imu, Joy, Range
from std_msgs.msg import Bool, UInt8

DROPPED = {
    'unknown_id': 'frames of an id that the bus description does not hold',
    'bad_length': 'frames of a wrong length',
    'joystick_implausible': 'joystick frames beyond the range of the joystick',
    'imu_gaps': 'gaps between IMU frames',
    'imu_without_acceleration': 'IMU frames without recent accelerations (0x203)',
    'imu_without_angles': 'IMU frames without recent angles (0x205)',
    'set_pose_not_finite': 'poses on /set_pose without a yaw',
}


class ReadNode:
    """Publishes what the frames say."""

    def __init__(self):
        config = config_from_params(ReaderConfig)
        try:
            bus = BusDescription(rospy.get_param('~dbc', str(DEFAULT_DBC)))
        except BusError as error:
            stop(f'wrong configuration of {rospy.get_name()}: dbc: {error}')
        self.reader = Reader(config, bus)
        self.lock = threading.Lock()
        self.imu_frame = rospy.get_param('~imu_frame', 'base_link')
        self.warned = set()
        self.stopping = threading.Event()
        self.diagnostics = Diagnostics('frames to readings', 'CAN bus')
        advertise = self.advertise
        imu = advertise('imu/data', Imu)
        encoders = advertise('encoders', Encoder)
        joystick, battery = advertise('joystick', Joy), advertise('battery', BatteryState)
        mode, impact = advertise('mode', UInt8), advertise('impact', Bool)
        ranges = {name: advertise(f'{name}_range', Range) for name in NAMES}
        variances = config.variances
        self.publish = {
            ImuReading: lambda r: imu.publish(conversions.imu_to_msg(r, self.imu_frame, variances)),
            EncoderReading: lambda r: encoders.publish(conversions.encoder_to_msg(r)),
            JoystickReading: lambda r: joystick.publish(conversions.joystick_to_msg(r)),
            BatteryReading: lambda r: battery.publish(conversions.battery_to_msg(r)),
            ModeReading: lambda r: mode.publish(UInt8(r.mode)),
            ImpactReading: lambda r: impact.publish(Bool(r.impact)),
            RangeReading: lambda r: ranges[r.name].publish(
                conversions.range_to_msg(r, config.range_min, config.range_max)),
        }
        rospy.Subscriber('set_pose', PoseWithCovarianceStamped, self.on_set_pose, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber('canrx', CAN, self.on_can, queue_size=1000, tcp_nodelay=True)
        rospy.on_shutdown(self.stopping.set)

    @staticmethod
    def advertise(topic, message_type):
        """A publisher."""
        return rospy.Publisher(topic, message_type, queue_size=10, tcp_nodelay=True)

    def on_can(self, message):
        """One frame to its readings' topics."""
        with self.lock:
            readings = self.reader.on_frame(conversions.msg_to_frame(message))
        for reading in readings:
            self.publish[type(reading)](reading)

    def on_set_pose(self, message):
        """The pose's yaw becomes the yaw at the pose's stamp (now, if it has none or lies in the future)."""
        now, stamp = rospy.get_time(), message.header.stamp.to_sec()
        yaw = conversions.yaw_of(message.pose.pose.orientation)
        with self.lock:
            self.reader.set_yaw(yaw, now if stamp <= 0.0 else min(stamp, now))
        if not math.isnan(yaw):
            rospy.loginfo('the yaw was set to %.3f rad', yaw)

    def run(self):
        """Diagnostics once a second of wall time until ROS shuts down."""
        silent_since, frames, restarts, said_ready = 0, -1, 0, False
        while not self.stopping.wait(1.0):
            with self.lock:
                counters = dict(self.reader.counters)
                calibration = self.reader.calibration
                collected, reason = calibration.collected, calibration.reason
                restarted, restarts = calibration.restarts > restarts, calibration.restarts
                ready, offset = calibration.done, calibration.offset
            total = counters.get('frames', 0)
            silent_since = silent_since + 1 if total == frames else 0
            frames = total
            if restarted and not ready:
                rospy.logwarn('the calibration of the gyroscope started over: %s. Keep the chair still.', reason)
            if ready and not said_ready:
                rospy.loginfo('the gyroscope is calibrated: offset %.4f, %.4f, %.4f deg/s', *offset)
                said_ready = True
            for kind in DROPPED.keys() & counters.keys() - self.warned:
                rospy.logwarn('%s: counted in /diagnostics', DROPPED[kind])
                self.warned.add(kind)
            progress = f'{collected} of {calibration.frames} IMU frames'
            if silent_since >= 2:
                level, text = ERROR, f'waiting for frames on {rospy.resolve_name("canrx")}'
                rospy.logwarn_throttle(10.0, text)
            elif not ready:
                level, text = WARN, f'calibrating the gyroscope at rest: {progress}'
                rospy.loginfo_throttle(5.0, text)
            else:
                level, text = OK, 'publishing'
            self.diagnostics.publish(level, text, {**counters, 'calibration': progress, 'calibration_restarts': restarts})


def main():
    """Run the node."""
    rospy.init_node('read')
    ReadNode().run()
    rospy.spin()  # until rospy has ended its own shutdown, so that the master forgets the node
