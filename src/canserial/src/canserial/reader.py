"""Frames of SARA's bus to readings: the whole of read.py without ROS (thesis 3.3, with its defects mended)."""

import math
from collections import Counter

from canserial.bus import BadLength, UnknownFrame
from canserial.calibration import GyroCalibration
from canserial.imu import YawIntegrator
from canserial.ranges import RangeFilter
from canserial.readings import (LEFT, RIGHT, BatteryReading, EncoderReading, ImpactReading, ImuReading, JoystickReading,
                                ModeReading, RangeReading)

JOYSTICK_CENTRE = 512
JOYSTICK_DEAD_BAND = 40
JOYSTICK_MAX = 1023


class Reader:
    """Takes frames in the order of their reception and returns what they say.

    `counters` counts what was taken and what was dropped, by kind; `calibration` tells how far the gyro's offset is.
    """

    def __init__(self, config, bus):
        self.config = config
        self.bus = bus
        self.counters = Counter()
        self.calibration = GyroCalibration(config.calibration_frames, config.still_step, config.still_drift)
        self._yaw = YawIntegrator(config.imu_period, config.max_gap, config.initial_yaw)
        self._ranges = RangeFilter(config.range_min, config.range_max, config.max_gap)
        self._acceleration = (-math.inf, None)
        self._tilt = (-math.inf, None)
        self._steps = {}
        self._handlers = {
            'ENCODER_RIGHT': lambda t, v: self._encoder(t, RIGHT, v),
            'ENCODER_LEFT': lambda t, v: self._encoder(t, LEFT, v),
            'JOYSTICK': self._joystick,
            'MODO_PC': lambda t, v: [ModeReading(t, v['modoPC'])],
            'RANGES_1': self._distances,
            'RANGES_2': self._distances,
            'RANGE_ACCEL': self._range_acceleration,
            'IMPACT_GYRO': self._impact_gyro,
            'COMPLEMENTARY': self._complementary,
            'BATTERY': lambda t, v: [BatteryReading(t, v['voltage'])],
        }

    @property
    def ready(self):
        """Whether the gyro's offset is known, so that ImuReadings come."""
        return self.calibration.done

    @property
    def yaw(self):
        """The yaw now, rad."""
        return self._yaw.yaw

    def set_yaw(self, yaw, stamp):
        """The yaw was `yaw` (rad) at `stamp` (s). Frames received before it do not change it back.

        A value that is not finite is dropped and counted.
        """
        if not (math.isfinite(yaw) and math.isfinite(stamp)):
            self.counters['set_pose_not_finite'] += 1
            return
        self._yaw.set(yaw, stamp)

    def on_frame(self, frame):
        """Readings (a list, possibly empty) of one Frame; what cannot be read is counted and dropped."""
        if not math.isfinite(frame.time):
            self.counters['stamp_not_finite'] += 1
            return []
        try:
            name, values = self.bus.decode(frame)
        except UnknownFrame:
            self.counters['unknown_id'] += 1
            return []
        except BadLength:
            self.counters['bad_length'] += 1
            return []
        self.counters['frames'] += 1
        handler = self._handlers.get(name)
        return handler(frame.time, values) if handler else []

    def _encoder(self, stamp, wheel, values):
        steps = values['steps']
        if not self.ready:
            moved = (steps - self._steps.setdefault(wheel, steps) + 2 ** 31) % 2 ** 32 - 2 ** 31
            if abs(moved) > self.config.still_steps:
                self._steps[wheel] = steps
                self.calibration.start_over('a wheel turned')
        return [EncoderReading(stamp, wheel, steps, values['time'])]

    def _joystick(self, stamp, values):
        if max(values['joyx'], values['joyy']) > JOYSTICK_MAX:
            self.counters['joystick_implausible'] += 1
            return []
        return [JoystickReading(stamp, -_axis(values['joyx']), _axis(values['joyy']), values['modo'],
                                values['velD'], values['velI'])]

    def _distances(self, stamp, values):
        readings = ((name, self._ranges.add(name, stamp, distance)) for name, distance in values.items())
        return [RangeReading(stamp, name, distance) for name, distance in readings if distance is not None]

    def _range_acceleration(self, stamp, values):
        self._acceleration = (stamp, (values['ax'], values['ay'], values['az']))
        return self._distances(stamp, {'SJO': values['SJO']})

    def _complementary(self, stamp, values):
        self._tilt = (stamp, (math.radians(values['rx']), math.radians(values['ry'])))
        return []

    def _impact_gyro(self, stamp, values):
        readings = [ImpactReading(stamp, bool(values['alarma']))]
        imu = self._imu(stamp, (values['gx'], values['gy'], values['gz']))
        return readings if imu is None else [*readings, imu]

    def _imu(self, stamp, gyro):
        if not self.ready:
            self.calibration.add(gyro)
            self._yaw.add(stamp, 0.0)  # at rest; what turns from the next frame on is counted in full
            return None
        x, y, z = (math.radians(rate - offset) for rate, offset in zip(gyro, self.calibration.offset))
        z *= self.config.gain
        if not self._yaw.add(stamp, z):
            self.counters['imu_stale'] += 1
            return None
        if self._yaw.gaps:
            self.counters['imu_gaps'] = self._yaw.gaps
        for name, (measured, _) in (('acceleration', self._acceleration), ('angles', self._tilt)):
            if not abs(stamp - measured) <= self.config.max_gap:
                self.counters[f'imu_without_{name}'] += 1
                return None
        roll, pitch = self._tilt[1]
        return ImuReading(stamp, roll, pitch, self._yaw.yaw, (x, y, z), self._acceleration[1])


def _axis(raw):
    """-1..1 from 0..1023, 0 inside the dead band."""
    offset = raw - JOYSTICK_CENTRE
    return 0.0 if abs(offset) <= JOYSTICK_DEAD_BAND else max(-1.0, offset / (JOYSTICK_MAX - JOYSTICK_CENTRE))
