"""Frames of SARA's bus to readings: the whole of read.py without ROS (thesis 3.3, with its defects mended)."""

import math
from collections import Counter

from canserial.bus import BadLength, UnknownFrame
from canserial.calibration import GyroCalibration
from canserial.config import AUTO, DEFAULT_GAIN
from canserial.imu import YawIntegrator
from canserial.plausibility import EncoderGuard, GravityWatch, StuckValue
from canserial.ranges import RangeFilter
from canserial.readings import (LEFT, RIGHT, AnglesReading, BatteryReading, EncoderReading, ImpactReading, ImuReading,
                                JoystickReading, ModeReading, RangeReading)

JOYSTICK_CENTRE = 512
JOYSTICK_DEAD_BAND = 40
JOYSTICK_MAX = 1023
MODES = frozenset((0, 1, 3))
ANGLE_LIMIT = 90.0      # deg; both filters take roll and pitch from atan2(a, hypot(b, c))
NORMAL_PERIOD = 0.2     # s between IMU frames, until 'auto' knows better
SLOT = 0.01             # s; the sensor node's timer, of which its periods are multiples
LEAST_PERIOD = 0.03     # s
PERIOD_SAMPLES = 9      # intervals whose median is the period
STILL_TIME = 1.0        # s without motion after which the chair stands
ALONE_TIME = 8.0        # s of ranges without IMU frames: the sensor node did not lose frames, it calibrated itself
RANGES_PERIOD = 0.2     # s
LAST_STAMP = 2.0 ** 32  # s; what a ROS time can hold


class Reader:
    """Takes frames in the order of their reception and returns what they say.

    config: ReaderConfig. bus: BusDescription. stored: the calibration_file.Calibration of this chair, or None; it must hold an
    offset where config.calibration is 'saved' (else ValueError).
    `frames` counts what was taken, `counters` what was dropped by kind (faults.KINDS), `last_fault` holds each kind's latest
    stamp, `seen` the latest stamp of each frame by name. `offset`: the gyroscope's, three deg/s, None until known.
    `calibration`: the measurement under way or the last one (GyroCalibration), None if there was none. `yaw_doubtful`: whether
    the chair may have turned unseen since the last set_yaw(). `battery`: V, `imu_stamp`: of the last ImuReading, both None
    before the first.
    """

    def __init__(self, config, bus, stored=None):
        if config.calibration == 'saved' and (stored is None or stored.gyro_offset is None):
            raise ValueError("calibration is 'saved', but no saved offset was given")
        self.config = config
        self.bus = bus
        self.frames = 0
        self.counters = Counter()
        self.last_fault = {}
        self.seen = {}
        self.first_stamp = None
        self.offset = tuple(stored.gyro_offset) if config.calibration == 'saved' else None
        self.calibration = None if self.offset else self._new_calibration(persistent=True)
        self.period = NORMAL_PERIOD if config.imu_period == AUTO else config.imu_period
        self.battery = self.imu_stamp = None
        self.yaw_doubtful = False
        stored_gain = None if stored is None else stored.gain
        gain = config.gain if config.gain is not None else stored_gain if stored_gain is not None else DEFAULT_GAIN
        self._yaw = YawIntegrator(self.period, config.max_gap, config.initial_yaw, gain)
        self._intervals = [] if config.imu_period == AUTO else None
        self._imu_stamp = None
        self._alone = 0
        self._ranges = RangeFilter(config.range_min, config.range_max, config.max_gap)
        self._acceleration = (-math.inf, None)
        self._tilt = (-math.inf, None)
        fastest = config.max_wheel_speed / math.tau * config.encoder_steps_per_turn
        self._guards = {wheel: EncoderGuard(fastest, config.still_steps) for wheel in (RIGHT, LEFT)}
        self._steps = {}
        self._wheel_moved = self._gyro_moved = -math.inf
        self._gravity = GravityWatch(config.gravity_tolerance)
        self._stuck = {name: StuckValue(config.stuck_time) for name in ('acceleration', 'angles', 'madgwick', 'gyro')}
        self._handlers = {
            'ENCODER_RIGHT': lambda t, v: self._encoder(t, RIGHT, v),
            'ENCODER_LEFT': lambda t, v: self._encoder(t, LEFT, v),
            'JOYSTICK': self._joystick,
            'MODO_PC': self._mode,
            'RANGES_1': self._ranges_1,
            'RANGES_2': self._distances,
            'RANGE_ACCEL': self._range_acceleration,
            'IMPACT_GYRO': self._impact_gyro,
            'COMPLEMENTARY': self._complementary,
            'MADGWICK': self._madgwick,
            'BATTERY': self._battery,
        }

    @property
    def ready(self):
        """Whether the gyro's offset is known, so that ImuReadings come."""
        return self.offset is not None

    @property
    def yaw(self):
        """The yaw now, rad."""
        return self._yaw.yaw

    @property
    def turned(self):
        """The angle turned since the start, rad, without the gain and not wrapped: what the gain procedure compares."""
        return self._yaw.turned

    @property
    def gain(self):
        """The factor on the yaw rate."""
        return self._yaw.gain

    @gain.setter
    def gain(self, gain):
        """From the next frame on; what was turned before keeps its own."""
        self._yaw.gain = gain

    @property
    def calibrating(self):
        """Whether the offset is being measured."""
        return self.calibration is not None and not self.calibration.ended

    def motion(self, now):
        """Why the chair does not stand still at `now` (s), '' if it does."""
        if now - self._wheel_moved < STILL_TIME:
            return 'a wheel turns'
        return 'the gyroscope moves' if now - self._gyro_moved < STILL_TIME else ''

    def set_yaw(self, yaw, stamp):
        """The yaw was `yaw` (rad) at `stamp` (s). Frames received before it do not change it back.

        A yaw that is not finite or a stamp that ROS could not hold is dropped and counted.
        """
        if not (math.isfinite(yaw) and 0.0 <= stamp < LAST_STAMP):
            self.counters['set_pose_implausible'] += 1
            return
        self._yaw.set(yaw, stamp)
        self.yaw_doubtful = False

    def calibrate(self, now):
        """Measure the gyro's offset again, at rest; meanwhile the old one serves, and if the chair moves it stays.

        Returns '' if the measurement has begun, else why not. See `calibrating` and `calibration` for how it goes.
        """
        if self.calibrating:
            return f'the gyroscope is being calibrated: {self.calibration.elapsed:.0f} of {self.calibration.duration:g} s'
        last = self.seen.get('IMPACT_GYRO', -math.inf)
        if not abs(now - last) <= self.config.max_gap:
            return 'no rates (0x204) come'
        moving = self.motion(now)
        if moving:
            return f'the chair moves: {moving}'
        self.calibration = self._new_calibration(persistent=False)
        return ''

    def on_frame(self, frame):
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
        if not self.frames:
            self.first_stamp = stamp
        self.frames += 1
        self.seen[name] = stamp
        handler = self._handlers.get(name)
        return handler(stamp, values) if handler else []

    def _drop(self, kind, stamp):
        self.counters[kind] += 1
        self.last_fault[kind] = stamp
        return []

    def _new_calibration(self, persistent):
        config = self.config
        return GyroCalibration(config.calibration_time, config.still_step, config.still_drift, config.max_gap, persistent)

    def _disturb(self, reason):
        if self.calibrating:
            restarts = self.calibration.restarts
            self.calibration.start_over(reason)
            self.yaw_doubtful |= self.calibration.restarts > restarts

    def _encoder(self, stamp, wheel, values):
        steps, clock = values['steps'], values['time']
        guard = self._guards[wheel]
        restarts = guard.restarts
        fault = guard.check(stamp, steps, clock)
        if fault is not None:
            return self._drop(fault, stamp)
        if guard.restarts > restarts:
            self._drop('encoder_restarts', stamp)
            self._steps[wheel] = steps
        moved = (steps - self._steps.setdefault(wheel, steps) + 2 ** 31) % 2 ** 32 - 2 ** 31
        if abs(moved) > self.config.still_steps:
            self._steps[wheel] = steps
            self._wheel_moved = stamp
            self._disturb('a wheel turned')
        return [EncoderReading(stamp, wheel, steps, clock)]

    def _joystick(self, stamp, values):
        mode = values['modo']
        if max(values['joyx'], values['joyy']) > JOYSTICK_MAX or mode not in MODES:
            return self._drop('joystick_implausible', stamp)
        return [JoystickReading(stamp, -_axis(values['joyx']), _axis(values['joyy']), mode, values['velD'], values['velI'])]

    def _mode(self, stamp, values):
        mode = values['modoPC']
        return [ModeReading(stamp, mode)] if mode in MODES else self._drop('mode_implausible', stamp)

    def _battery(self, stamp, values):
        voltage = values['voltage']
        if not 0.0 <= voltage <= self.config.battery_max:
            return self._drop('battery_implausible', stamp)
        self.battery = voltage
        return [BatteryReading(stamp, voltage)]

    def _ranges_1(self, stamp, values):
        self._alone += 1
        return self._distances(stamp, values)

    def _distances(self, stamp, values):
        readings = []
        for name, distance in values.items():
            if not 0.0 <= distance <= self.config.range_limit:
                self._drop(f'range_implausible_{name}', stamp)
                continue
            distance = self._ranges.add(name, stamp, distance)
            if distance is not None:
                readings.append(RangeReading(stamp, name, distance))
        return readings

    def _range_acceleration(self, stamp, values):
        readings = self._distances(stamp, {'SJO': values['SJO']})
        acceleration = (values['ax'], values['ay'], values['az'])
        if max(map(abs, acceleration)) > self.config.acceleration_limit:
            self._drop('acceleration_implausible', stamp)
        elif self._stuck['acceleration'].add(stamp, acceleration):
            self._drop('acceleration_stuck', stamp)
        elif not self._gravity.add(stamp, acceleration, not self.motion(stamp)):
            self._drop('acceleration_not_gravity', stamp)
        else:
            self._acceleration = (stamp, acceleration)
        return readings

    def _angles(self, stamp, source, roll, pitch, yaw):
        if max(abs(roll), abs(pitch)) > ANGLE_LIMIT:
            return self._drop(f'{source}_implausible', stamp)
        if self._stuck[source].add(stamp, (roll, pitch, yaw)):
            return self._drop(f'{source}_stuck', stamp)
        return math.radians(roll), math.radians(pitch), math.radians(yaw)

    def _complementary(self, stamp, values):
        angles = self._angles(stamp, 'angles', values['rx'], values['ry'], values['rz'])
        if not angles:
            return angles
        self._tilt = (stamp, angles[:2])
        return [AnglesReading(stamp, 'complementary', *angles)]

    def _madgwick(self, stamp, values):
        angles = self._angles(stamp, 'madgwick', values['roll'], values['pitch'], values['yaw'])
        return [AnglesReading(stamp, 'madgwick', *angles)] if angles else angles

    def _impact_gyro(self, stamp, values):
        if self._imu_stamp is not None:
            self._watch_interval(stamp)
        self._imu_stamp = stamp
        gyro, alarm = (values['gx'], values['gy'], values['gz']), values['alarma']
        if max(map(abs, gyro)) > self.config.rate_limit or alarm not in (0, 1):
            return self._drop('gyro_implausible', stamp)
        readings = [ImpactReading(stamp, alarm == 1)]
        if self._stuck['gyro'].add(stamp, gyro):
            self._drop('gyro_stuck', stamp)
            self._disturb('the gyroscope is stuck')
            return readings
        imu = self._imu(stamp, gyro)
        if imu is None:
            return readings
        self.imu_stamp = stamp
        return [*readings, imu]

    def _watch_interval(self, stamp):
        """Learn the period of the frames, and notice an IMU that was away while its node was alive."""
        alone, self._alone = self._alone * RANGES_PERIOD, 0
        if alone > ALONE_TIME:
            # Its offsets are others now. A saved calibration is taken at its word.
            self._drop('imu_restarts', stamp)
            if self.config.calibration == 'measure':
                self.offset = None
                self.calibration = self._new_calibration(persistent=True)
        interval = stamp - self._imu_stamp
        if self._intervals is None or interval < LEAST_PERIOD:  # less: a frame that was repeated or held back
            return
        self._intervals.append(interval)
        if len(self._intervals) == PERIOD_SAMPLES:
            median = sorted(self._intervals)[PERIOD_SAMPLES // 2]
            self.period = self._yaw.period = min(round(median / SLOT) * SLOT, self.config.max_gap)
            self._intervals.clear()

    def _imu(self, stamp, gyro):
        if self.calibrating:
            self._calibrate(stamp, gyro)
            if self.offset is None or self.calibration.done:
                # At rest, or unknown; what turns from the next frame on is counted in full.
                self._integrate(stamp, 0.0 if self.offset is None else self._rates(gyro)[2])
                if self.calibration.done:
                    self.offset = self.calibration.offset
                return None
        x, y, z = rates = self._rates(gyro)
        # Twice the limit of a mean: a single frame of the fast mode is noisier.
        if max(map(abs, rates)) > math.radians(2.0 * self.config.still_step):
            self._gyro_moved = stamp
        if not self._integrate(stamp, z):
            return None
        for name, (measured, _) in (('acceleration', self._acceleration), ('angles', self._tilt)):
            if not abs(stamp - measured) <= self.config.max_gap:
                self._drop(f'imu_without_{name}', stamp)
                return None
        roll, pitch = self._tilt[1]
        return ImuReading(stamp, roll, pitch, self._yaw.yaw, (x, y, self._yaw.gain * z), self._acceleration[1])

    def _rates(self, gyro):
        (x, y, z), (offset_x, offset_y, offset_z) = gyro, self.offset
        return math.radians(x - offset_x), math.radians(y - offset_y), math.radians(z - offset_z)

    def _calibrate(self, stamp, gyro):
        calibration = self.calibration
        restarts = calibration.restarts
        calibration.add(stamp, gyro)
        if calibration.restarts > restarts:
            self._gyro_moved = stamp
            self.yaw_doubtful = True

    def _integrate(self, stamp, rate):
        """Whether the yaw is new; what was lost or came late is counted."""
        yaw = self._yaw
        gaps, long_gaps = yaw.gaps, yaw.long_gaps
        if not yaw.add(stamp, rate):
            if yaw.pending:
                self.counters['imu_before_set_pose'] += 1  # as it should be
            else:
                self._drop('imu_stale', stamp)
            return False
        if yaw.gaps > gaps:
            self._drop('imu_gaps', stamp)
        if yaw.long_gaps > long_gaps:
            self._drop('imu_long_gaps', stamp)
            self.yaw_doubtful = True
        return True


def _axis(raw):
    """-1..1 from 0..1023, 0 inside the dead band."""
    offset = raw - JOYSTICK_CENTRE
    return 0.0 if abs(offset) <= JOYSTICK_DEAD_BAND else max(-1.0, offset / (JOYSTICK_MAX - JOYSTICK_CENTRE))
