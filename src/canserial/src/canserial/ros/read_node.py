"""read.py: frames of `canrx` to standard messages; the shell around canserial.reader.reader.Reader."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Vector3Stamped
from sensor_msgs.msg import BatteryState, Imu, Joy, MagneticField, Range
from std_msgs.msg import Bool, UInt8
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from canserial.calibration import calibration_file
from canserial.calibration.calibration import GyroCalibration
from canserial.calibration.calibration_file import Calibration, CalibrationFileError
from canserial.dbc.bus import BusDescription, BusError
from canserial.msg import CAN, Encoder
from canserial.reader.compass_config import CompassConfig
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from canserial.reader.readings import (
    AnglesReading,
    BatteryReading,
    EncoderReading,
    FieldReading,
    HeadingReading,
    ImpactReading,
    ImuReading,
    JoystickReading,
    ModeReading,
    RangeReading,
)
from canserial.reader.status import NO_HEADING, status_of
from canserial.ros import calibration_store, conversions
from canserial.ros.frames import yaw_in
from canserial.ros.node import config_from_params, stop, warn_of_unknown_params
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import on_shutdown, start_node, until_shutdown

WELL = 60.0  # s; a kind of fault that was away for so long is warned of again
NO_FRAMES = 5.0  # s of wall time without rates, after which a calibration is given up
QUEUE = 1000  # messages, as canrx: a listener that is kept waiting must not lose what the bus said
CALIBRATE = 'rosrun canserial calibrate_compass --place LATITUDE LONGITUDE'
PARAMETERS = ('dbc', 'imu_frame', 'map_frame', 'calibration_file', 'save_calibration')


class ReadNode:
    """Publishes what the frames say."""

    def __init__(self) -> None:
        config, compass = config_from_params(ReaderConfig), config_from_params(CompassConfig)
        warn_of_unknown_params({*ReaderConfig.__dataclass_fields__, *CompassConfig.__dataclass_fields__, *PARAMETERS})
        try:
            name = str(rospy.get_param('~dbc', ''))
            bus = BusDescription.named(name) if name else BusDescription.default()
        except BusError as error:
            stop(f'wrong configuration of {rospy.get_name()}: dbc: {error}')
        self.file = calibration_store.resolve(rospy.get_param('~calibration_file', ''))
        self.save_at_start = rospy.get_param('~save_calibration', False)
        if not isinstance(self.save_at_start, bool):
            stop(
                f'wrong configuration of {rospy.get_name()}: save_calibration is {self.save_at_start!r}, '
                'allowed are true and false'
            )
        self.gain_is_given = config.gain is not None
        self.reader = Reader(config, bus, calibration_store.load_at_start(self.file, config), compass)
        self.at_start = self.reader.ready, self.reader.calibration  # frames come before `run` begins
        self.lock = threading.Lock()
        self.imu_frame = rospy.get_param('~imu_frame', 'base_link')
        self.map_frame = rospy.get_param('~map_frame', 'map').lstrip('/')
        self.noticed, self.known = {}, {}
        self.stopping = threading.Event()
        self.diagnostics = Diagnostics('frames to readings', 'CAN bus')
        self.publish = self.advertise_all(config)
        if self.reader.compass is not None:
            self.publish |= self.advertise_compass(config.variances)
            rospy.Service('~reload_compass', Trigger, self.on_reload_compass)
            if self.reader.compass.filter is None:
                rospy.logwarn('the compass is not calibrated, so there is no heading: %s', CALIBRATE)
        rospy.Subscriber('set_pose', PoseWithCovarianceStamped, self.on_set_pose, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber('canrx', CAN, self.on_can, tcp_nodelay=True)  # of a full queue frames would be lost unseen
        rospy.Service('~calibrate', Trigger, self.on_calibrate)
        rospy.Service('~reload_gain', Trigger, self.on_reload_gain)
        on_shutdown(self.stopping.set)
        offset = self.reader.offset
        rospy.loginfo(
            'gain %.4f; %s',
            self.reader.gain,
            'the gyroscope is to be calibrated'
            if offset is None
            else 'saved offset {:.4f}, {:.4f}, {:.4f} deg/s'.format(*offset),
        )

    def advertise_all(self, config: ReaderConfig) -> dict[type, Callable]:
        """The publishers, as a mapping from the type of a reading to what publishes it."""
        advertise = self.advertise
        imu = advertise('imu/data', Imu)
        angles = {
            source: advertise(f'orientation/{source}', Vector3Stamped) for source in ('complementary', 'madgwick')
        }
        encoders = advertise('encoders', Encoder)
        joystick, battery = advertise('joystick', Joy), advertise('battery', BatteryState)
        mode, impact = advertise('mode', UInt8), advertise('impact', Bool)
        sensors, raw = sum(self.reader.bus.ranges.values(), ()), advertise('raw_ranges', Range)
        ranges = {name: advertise(f'{name}_range', Range) for name in sensors}
        limits = config.range_min, config.range_max
        variances = config.variances
        charge = config.battery_empty, config.battery_full, config.battery_charging
        return {
            ImuReading: lambda r: imu.publish(conversions.imu_to_msg(r, self.imu_frame, variances)),
            AnglesReading: lambda r: angles[r.source].publish(conversions.angles_to_msg(r, self.imu_frame)),
            EncoderReading: lambda r: encoders.publish(conversions.encoder_to_msg(r)),
            JoystickReading: lambda r: joystick.publish(conversions.joystick_to_msg(r)),
            BatteryReading: lambda r: battery.publish(conversions.battery_to_msg(r, *charge)),
            ModeReading: lambda r: mode.publish(UInt8(r.mode)),
            ImpactReading: lambda r: impact.publish(Bool(r.impact)),
            RangeReading: lambda r: (
                raw.publish(conversions.range_to_msg(r._replace(range=r.raw), *limits)),
                ranges[r.name].publish(conversions.range_to_msg(r, *limits)),
            ),
        }

    def advertise_compass(self, variances: tuple) -> dict[type, Callable]:
        """The same for what only a bus with a compass says."""
        field, heading = self.advertise('imu/mag', MagneticField), self.advertise('imu/heading', Imu)
        return {
            FieldReading: lambda r: field.publish(conversions.field_to_msg(r, self.imu_frame)),
            HeadingReading: lambda r: heading.publish(conversions.imu_to_msg(r, self.imu_frame, variances)),
        }

    @staticmethod
    def advertise(topic: str, message_type: type) -> rospy.Publisher:
        """A publisher."""
        return rospy.Publisher(topic, message_type, queue_size=QUEUE, tcp_nodelay=True)

    def on_can(self, message: CAN) -> None:
        """One frame to its readings' topics."""
        with self.lock:
            readings = self.reader.on_frame(conversions.msg_to_frame(message))
        with until_shutdown():
            for reading in readings:
                self.publish[type(reading)](reading)

    def on_set_pose(self, message: PoseWithCovarianceStamped) -> None:
        """The pose's yaw in the map becomes the yaw at the pose's stamp (now, if it has none or lies in the future)."""
        now, stamp = rospy.get_time(), message.header.stamp.to_sec()
        yaw = yaw_in(self.map_frame, message)
        with self.lock:
            self.reader.set_yaw(yaw, now if stamp <= 0.0 else min(stamp, now))
        if math.isnan(yaw):
            rospy.logwarn('set_pose is ignored: it is no pose, or in the unknown frame "%s"', message.header.frame_id)
        else:
            rospy.loginfo('the yaw was set to %.3f rad', yaw)

    def on_calibrate(self, _: TriggerRequest) -> TriggerResponse:
        """Measure the gyroscope's offset, wait until it is done, save it."""
        with self.lock:
            refusal = self.reader.calibrate(rospy.get_time())
            calibration = self.reader.calibration
        if refusal:
            return self.answer(False, f'not calibrated: {refusal}')
        rospy.loginfo('calibrating the gyroscope: keep the chair still for %.0f s', calibration.duration)
        self.wait_for(calibration)
        if not calibration.done:
            return self.answer(False, f'not calibrated, the old offset stays: {calibration.reason or "interrupted"}')
        text = 'the offset is {:.4f}, {:.4f}, {:.4f} deg/s'.format(*calibration.offset)
        try:
            self.save_offset(calibration)
        except CalibrationFileError as error:
            return self.answer(False, f'{text} and in use, but not saved: {error}')
        return self.answer(True, f'{text}; saved in {self.file}')

    def wait_for(self, calibration: GyroCalibration) -> None:
        """Until the measurement has ended, for good or ill."""
        frames, since = -1, time.monotonic()
        while not self.stopping.wait(0.05):
            with self.lock:
                if calibration.ended:
                    return
                if self.reader.calibration is not calibration:
                    calibration.start_over('the sensor node began anew')
                    return
                if calibration.frames != frames:
                    frames, since = calibration.frames, time.monotonic()
                elif time.monotonic() - since > NO_FRAMES:
                    calibration.start_over('no rates (IMPACT_GYRO) come any more')
                    return

    def save_offset(self, calibration: GyroCalibration) -> None:
        """Into the calibration file, beside the gain that it may hold. Raises CalibrationFileError."""
        calibration_store.update(
            self.file,
            gyro_offset=calibration.offset,
            gyro_sigma=calibration.sigma,
            gyro_frames=calibration.frames,
            gyro_measured=calibration_store.now_in_words(),
        )

    def on_reload_gain(self, _: TriggerRequest) -> TriggerResponse:
        """Take the gain from the calibration file."""
        if self.gain_is_given:
            return self.answer(False, 'the gain is not reloaded: ~gain is given')
        stored, refusal = self.stored('gain')
        if stored is None:
            return self.answer(False, refusal)
        with self.lock:
            self.reader.gain = stored.gain
        return self.answer(True, f'the gain is {stored.gain:.4f}')

    def on_reload_compass(self, _: TriggerRequest) -> TriggerResponse:
        """Take the compass's calibration from the file; the heading begins anew."""
        stored, refusal = self.stored('compass', 'iron')
        if stored is None:
            return self.answer(False, refusal)
        with self.lock:
            self.reader.compass.iron = stored.iron
        return self.answer(True, 'the compass is calibrated; stand still for 2 s where no steel is near')

    def stored(self, what: str, name: str = '') -> tuple[Calibration | None, str]:
        """The file's Calibration, or None and why `what` (its attribute `name`) cannot be taken from it."""
        refusal = f'the {what} is not reloaded'
        try:
            stored = calibration_file.load(self.file)
        except FileNotFoundError:
            return None, f'{refusal}: there is no calibration file {self.file}'
        except CalibrationFileError as error:
            return None, f'{refusal}: {error}'
        if getattr(stored, name or what) is None:
            return None, f'{refusal}: the calibration file {self.file} holds none'
        return stored, ''

    @staticmethod
    def answer(success: bool, text: str) -> TriggerResponse:
        """Said to the caller and in the log."""
        (rospy.loginfo if success else rospy.logwarn)(text)
        return TriggerResponse(success, text)

    def run(self) -> None:
        """Diagnostics once a second of wall time until ROS shuts down."""
        restarts, waits, (ready, awaited) = 0, False, self.at_start
        while not self.stopping.wait(1.0):
            with self.lock:
                status = status_of(self.reader, rospy.get_time())
                counters = dict(self.reader.counters)
                was_ready, ready, calibration = ready, self.reader.ready, self.reader.calibration
                waited, waits = waits, self.reader.compass is not None and self.reader.compass.waits
            text = status.text
            if not self.reader.frames:
                text = f'waiting for frames on {rospy.resolve_name("canrx")}'
            if status.silent or not self.reader.frames:
                rospy.logwarn_throttle(10.0, text)
            elif not ready:
                rospy.loginfo_throttle(5.0, text)
            elif waits:
                rospy.logwarn_throttle(10.0, f'{NO_HEADING}: let the chair stand')
            elif waited:
                rospy.loginfo('imu/heading has begun')
            if not ready:
                awaited = calibration
            elif not was_ready and awaited.done:  # ~calibrate may have begun another one since
                self.on_ready(awaited)
            if calibration is not None and calibration.persistent:
                if calibration.restarts > restarts and not ready:
                    rospy.logwarn(
                        'the calibration of the gyroscope started over: %s. Keep the chair still.', calibration.reason
                    )
                restarts = calibration.restarts
            self.warn_of_faults(counters)
            self.diagnostics.publish(status.level, text, status.values)

    def on_ready(self, calibration: GyroCalibration) -> None:
        """The offset was measured at start."""
        rospy.loginfo('the gyroscope is calibrated: offset %.4f, %.4f, %.4f deg/s', *calibration.offset)
        if self.save_at_start:
            try:
                self.save_offset(calibration)
                rospy.loginfo('saved in %s', self.file)
            except CalibrationFileError as error:
                rospy.logerr('the offset is in use, but not saved: %s', error)

    def warn_of_faults(self, counters: Mapping[str, int]) -> None:
        """Once per kind, and again when it was well for a while."""
        now = time.monotonic()
        for kind in self.reader.kinds.keys() & counters.keys():
            if counters[kind] == self.known.get(kind):
                continue
            if now - self.noticed.get(kind, -math.inf) > WELL:
                rospy.logwarn('%s: %d so far; counted in /diagnostics', self.reader.kinds[kind], counters[kind])
            self.noticed[kind], self.known[kind] = now, counters[kind]


def main() -> None:
    """Run the node."""
    start_node('read')
    ReadNode().run()
    rospy.spin()  # until rospy has ended its own shutdown, so that the master forgets the node
