"""Frames of the bus to readings: the whole of read.py without ROS (thesis 3.3, with its defects mended)."""

from __future__ import annotations

import math
from collections import Counter

from canserial.calibration.calibration import GyroCalibration
from canserial.calibration.calibration_file import Calibration
from canserial.dbc.bus import BadLength, BadValue, BusDescription, UnknownFrame
from canserial.dbc.modes import modes_of
from canserial.frame import Frame
from canserial.reader.compass import Compass
from canserial.reader.compass_config import CompassConfig
from canserial.reader.config import ReaderConfig
from canserial.reader.faults import kinds_of
from canserial.reader.imu_reader import ImuReader
from canserial.reader.plausibility import EncoderGuard, StuckValue
from canserial.reader.ranges import SILENT, RangeFilter, rep117
from canserial.reader.readings import (
    LEFT,
    RIGHT,
    AnglesReading,
    BatteryReading,
    EncoderReading,
    ImuReading,
    JoystickReading,
    ModeReading,
    RangeReading,
)

JOYSTICK_CENTRE = 512
JOYSTICK_DEAD_BAND = 40
JOYSTICK_MAX = 1023
ANGLE_LIMIT = 90.0  # deg; both filters take roll and pitch from atan2(a, hypot(b, c))
LAST_STAMP = 2.0**32  # s; what a ROS time can hold
STRONGEST_FIELD = 320.0  # uT along an axis; a frame holds 327


class Reader:
    """Takes frames in the order of their reception and returns what they say.

    config: ReaderConfig. bus: BusDescription. stored: the calibration_file.Calibration of this chair, or None; it must
    hold an offset where config.calibration is 'saved' (else ValueError). compass: CompassConfig. `frames` counts what
    was taken, `counters` what was dropped by kind (`kinds`: in words), `last_fault` holds each kind's latest stamp,
    `seen` the latest stamp of each frame by name. `battery`: V, None until known. `compass`: Compass, None on a bus
    without its frame.
    """

    def __init__(
        self,
        config: ReaderConfig,
        bus: BusDescription,
        stored: Calibration | None = None,
        compass: CompassConfig = CompassConfig(),
    ) -> None:
        self.config = config
        self.bus = bus
        self.frames = 0
        self.counters = Counter()
        self.last_fault = {}
        self.seen = {}
        self.first_stamp = None
        self.battery = None
        self._imu = ImuReader(config, stored, self._drop)
        sensors = bus.ranges
        self._ranges = RangeFilter(sum(sensors.values(), ()), (config.range_min, config.range_max), config.max_gap)
        self.kinds = kinds_of(sum(sensors.values(), ()))
        self._beside = sensors.get('RANGE_ACCEL', ())  # the sensors whose ranges come with the acceleration
        fastest = config.max_wheel_speed / math.tau * config.encoder_steps_per_turn
        self._guards = {wheel: EncoderGuard(fastest, config.still_steps) for wheel in (RIGHT, LEFT)}
        self._stuck = {source: StuckValue(config.stuck_time) for source in ('angles', 'madgwick', 'compass')}
        self.compass = None
        if 'COMPASS' in bus.names:
            iron = None if stored is None else stored.iron
            self.compass = Compass(compass, iron, self.gain, math.tau / config.encoder_steps_per_turn, self._drop)
        self._modes = modes_of(bus)
        self._handlers = {
            'ENCODER_RIGHT': lambda t, v: self._encoder(t, RIGHT, v),
            'ENCODER_LEFT': lambda t, v: self._encoder(t, LEFT, v),
            'JOYSTICK': self._joystick,
            'MODO_PC': self._mode,
            'RANGES_1': self._ranges_1,
            'RANGES_2': self._distances,
            'RANGE_ACCEL': self._range_acceleration,
            'IMPACT_GYRO': self._impact_gyro,
            'COMPASS': self._field,
            'COMPLEMENTARY': self._complementary,
            'MADGWICK': self._madgwick,
            'BATTERY': self._battery,
        }

    @property
    def ready(self) -> bool:
        """Whether the gyro's offset is known, so that ImuReadings come."""
        return self._imu.offset is not None

    @property
    def offset(self) -> tuple[float, float, float] | None:
        """The gyroscope's offset, three deg/s, None until known."""
        return self._imu.offset

    @property
    def calibration(self) -> GyroCalibration | None:
        """The measurement of the offset under way or the last one (GyroCalibration), None if there was none."""
        return self._imu.calibration

    @property
    def calibrating(self) -> bool:
        """Whether the offset is being measured."""
        return self._imu.calibrating

    @property
    def period(self) -> float:
        """Seconds between IMU frames."""
        return self._imu.period

    @property
    def imu_stamp(self) -> float | None:
        """Stamp of the last ImuReading, None before the first."""
        return self._imu.stamp

    @property
    def yaw(self) -> float:
        """The yaw now, rad."""
        return self._imu.yaw.yaw

    @property
    def yaw_doubtful(self) -> bool:
        """Whether the chair may have turned unseen since the last set_yaw()."""
        return self._imu.yaw_doubtful

    @property
    def imu_frozen(self) -> bool:
        """Whether the IMU's registers stand still."""
        return self._imu.frozen

    @property
    def turned(self) -> float:
        """The angle turned since the start, rad, without the gain and not wrapped: what the gain procedure compares."""
        return self._imu.yaw.turned

    @property
    def gain(self) -> float:
        """The factor on the yaw rate."""
        return self._imu.yaw.gain

    @gain.setter
    def gain(self, gain: float) -> None:
        """From the next frame on; what was turned before keeps its own."""
        self._imu.yaw.gain = gain
        if self.compass is not None:
            self.compass.set_gain(gain)

    def motion(self, now: float) -> str:
        """Why the chair does not stand still at `now` (s), '' if it does."""
        return self._imu.motion(now)

    def set_yaw(self, yaw: float, stamp: float) -> None:
        """The yaw was `yaw` (rad) at `stamp` (s). Frames received before it do not change it back.

        A yaw that is not finite or a stamp that ROS could not hold is dropped and counted.
        """
        if not (math.isfinite(yaw) and 0.0 <= stamp < LAST_STAMP):
            self.counters['set_pose_implausible'] += 1
            return
        self._imu.set_yaw(yaw, stamp)

    def calibrate(self, now: float) -> str:
        """Measure the gyro's offset again, at rest; meanwhile the old one serves, and if the chair moves it stays.

        now: s, the clock of the frames. Returns '' if the measurement has begun, else why not. See `calibrating` and
        `calibration` for how it goes.
        """
        return self._imu.calibrate(now)

    def on_frame(self, frame: Frame) -> list:
        """Readings (a list, possibly empty) of one Frame; what cannot be read or believed is counted and dropped."""
        stamp = frame.time
        if not 0.0 <= stamp < LAST_STAMP:
            self.counters['stamp_implausible'] += 1
            return []
        try:
            name, values = self.bus.decode(frame)
        except UnknownFrame:
            return self._drop('unknown_id', stamp)
        except BadLength:
            return self._drop('bad_length', stamp)
        except BadValue:
            return self._drop('bad_value', stamp)
        if not self.frames:
            self.first_stamp = stamp
        self.frames += 1
        self.seen[name] = stamp
        handler = self._handlers.get(name)
        return handler(stamp, values) if handler else []

    def _drop(self, kind, stamp):
        self.counters[kind] += 1
        if kind in self.kinds:
            self.last_fault[kind] = stamp
        return []

    def _encoder(self, stamp, wheel, values):
        steps, clock = values['steps'], values['time']
        guard = self._guards[wheel]
        restarts = guard.restarts
        fault = guard.check(stamp, steps, clock)
        if fault is not None:
            return self._drop(fault, stamp)
        restarted = guard.restarts > restarts
        if restarted:
            self._drop('encoder_restarts', stamp)
        self._imu.on_steps(stamp, wheel, steps, restarted)
        if self.compass is not None:
            self.compass.on_wheel(stamp, wheel, steps, restarted)
        return [EncoderReading(stamp, wheel, steps, clock)]

    def _joystick(self, stamp, values):
        mode = values['modo']
        if max(values['joyx'], values['joyy']) > JOYSTICK_MAX or mode not in self._modes:
            return self._drop('joystick_implausible', stamp)
        return [
            JoystickReading(stamp, -_axis(values['joyx']), _axis(values['joyy']), mode, values['velD'], values['velI'])
        ]

    def _mode(self, stamp, values):
        mode = values['modoPC']
        return [ModeReading(stamp, mode)] if mode in self._modes else self._drop('mode_implausible', stamp)

    def _battery(self, stamp, values):
        voltage = values['voltage']
        if not 0.0 <= voltage <= self.config.battery_max:
            return self._drop('battery_implausible', stamp)
        self.battery = voltage
        return [BatteryReading(stamp, voltage)]

    def _ranges_1(self, stamp, values):
        self._imu.on_ranges()
        return self._distances(stamp, values)

    def _distances(self, stamp, values):
        readings = []
        for name, distance in values.items():
            if not 0.0 <= distance <= self.config.range_limit:
                self._drop(f'range_{"silent" if distance > SILENT else "implausible"}_{name}', stamp)
                continue
            raw = rep117(distance, self.config.range_min, self.config.range_max)
            distance = self._ranges.add(name, stamp, distance)
            if distance is not None:
                readings.append(RangeReading(stamp, name, distance, raw))
        return readings

    def _range_acceleration(self, stamp, values):
        self._imu.on_acceleration(stamp, (values['ax'], values['ay'], values['az']))
        ranges = {name: values[name] for name in self._beside if not self._ranges.is_repeat(name, stamp, values[name])}
        return self._distances(stamp, ranges)

    def _impact_gyro(self, stamp, values):
        readings = self._imu.on_gyro(stamp, (values['gx'], values['gy'], values['gz']), values['alarma'])
        if self.compass is None or not readings or not isinstance(readings[-1], ImuReading):
            return readings
        heading = self.compass.on_imu(readings[-1], not self.motion(stamp))
        return readings if heading is None else [*readings, heading]

    def _field(self, stamp, values):
        field = values['mx'], values['my'], values['mz']
        if max(map(abs, field)) > STRONGEST_FIELD:
            return self._drop('compass_implausible', stamp)
        if self._stuck['compass'].add(stamp, field):
            return self._drop('compass_stuck', stamp)
        return [self.compass.on_field(stamp, field)]

    def _angles(self, stamp, source, roll, pitch, yaw):
        """Three rad, or [] if they are not believed."""
        if max(abs(roll), abs(pitch)) > ANGLE_LIMIT:
            return self._drop(f'{source}_implausible', stamp)
        if self._stuck[source].add(stamp, (roll, pitch, yaw)):
            return self._drop(f'{source}_stuck', stamp)
        return math.radians(roll), math.radians(pitch), math.radians(yaw)

    def _complementary(self, stamp, values):
        angles = self._angles(stamp, 'angles', values['rx'], values['ry'], values['rz'])
        if not angles:
            return []
        self._imu.on_tilt(stamp, *angles[:2])
        return [AnglesReading(stamp, 'complementary', *angles)]

    def _madgwick(self, stamp, values):
        angles = self._angles(stamp, 'madgwick', values['roll'], values['pitch'], values['yaw'])
        return [AnglesReading(stamp, 'madgwick', *angles)] if angles else []


def _axis(raw):
    """-1..1 from 0..1023, 0 inside the dead band."""
    offset = raw - JOYSTICK_CENTRE
    return 0.0 if abs(offset) <= JOYSTICK_DEAD_BAND else max(-1.0, offset / (JOYSTICK_MAX - JOYSTICK_CENTRE))
