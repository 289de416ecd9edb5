"""The IMU's part of the reader: accelerations, angles and rates of the bus to one reading (thesis 3.3, with its defects
mended).

It keeps the gyroscope's offset and gain, integrates the yaw, and knows whether the chair stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from canserial.calibration.calibration import GyroCalibration
from canserial.calibration.calibration_file import Calibration
from canserial.reader.config import AUTO, ReaderConfig
from canserial.reader.imu import YawIntegrator
from canserial.reader.plausibility import FrozenImu, GravityWatch, StuckValue
from canserial.reader.readings import ImpactReading, ImuReading

NORMAL_PERIOD = 0.2  # s between IMU frames, until 'auto' knows better
LEAST_PERIOD = 0.03  # s
PERIOD_SAMPLES = 9  # intervals whose median is the period
SLOT = 0.01  # s; the sensor node's timer, of which its periods are multiples
STILL_TIME = 1.0  # s without motion after which the chair stands
ALONE_TIME = 8.0  # s of ranges without IMU frames: the sensor node did not lose frames, it calibrated itself
RANGES_PERIOD = 0.2  # s
ANY_YAW = math.pi**2 / 3.0  # rad2, of a yaw that may be any


class ImuReader:
    """See Reader, which passes the values of the frames on.

    config: ReaderConfig. stored: calibration_file.Calibration or None. drop: called with (kind, stamp) for what is
    dropped.
    `offset`: three deg/s, None until known. `calibration`: the measurement under way or the last one, None if there was
    none.
    `period`: s between IMU frames. `stamp`: of the last ImuReading, None before the first. `yaw`: YawIntegrator.
    `yaw_doubtful`: whether the chair may have turned unseen. `yaw_variance`: rad2, for what it may have turned while
    the IMU was silent or frozen.
    """

    def __init__(self, config: ReaderConfig, stored: Calibration | None, drop: Callable[[str, float], None]) -> None:
        if config.calibration == 'saved' and (stored is None or stored.gyro_offset is None):
            raise ValueError("calibration is 'saved', but no saved offset was given")
        self.config = config
        self.offset = tuple(stored.gyro_offset) if config.calibration == 'saved' else None
        self.calibration = None if self.offset else self._new_calibration(persistent=True)
        self.period = NORMAL_PERIOD if config.imu_period == AUTO else config.imu_period
        self.stamp = None
        self.yaw_doubtful, self.yaw_variance, self._unseen = False, 0.0, 0.0
        stored_gain = None if stored is None else stored.gain
        gain = (
            config.gain if config.gain is not None else stored_gain if stored_gain is not None else config.default_gain
        )
        self.yaw = YawIntegrator(self.period, config.max_gap, config.initial_yaw, gain)
        self._drop = drop
        self._intervals = [] if config.imu_period == AUTO else None
        self._gyro_stamp = None
        self._alone = 0
        self._acceleration = (-math.inf, None)
        self._tilt = (-math.inf, None)
        self._steps = {}
        self._wheel_moved = self._gyro_moved = -math.inf
        self._gravity = GravityWatch(config.gravity_tolerance)
        self._frozen, self._unseen_since = FrozenImu(config.frozen_frames), None
        self._fresh = self._last = None  # accelerations since the last rates, whatever they say; the last ImuReading
        self._acceleration_stuck, self._gyro_stuck = StuckValue(config.stuck_time), StuckValue(config.stuck_time)

    @property
    def calibrating(self) -> bool:
        """Whether the offset is being measured."""
        return self.calibration is not None and not self.calibration.ended

    @property
    def frozen(self) -> bool:
        """Whether the IMU's registers stand still."""
        return self._frozen.frozen

    def set_yaw(self, yaw: float, stamp: float) -> None:
        """See Reader.set_yaw."""
        self.yaw.set(yaw, stamp)
        self.yaw_doubtful, self.yaw_variance = False, 0.0
        if self._unseen_since is not None:
            self._unseen_since = max(self._unseen_since, stamp)

    def motion(self, now: float) -> str:
        """Why the chair does not stand still at `now` (s), '' if it does."""
        if abs(now - self._wheel_moved) < STILL_TIME:  # a clock that went back is a new beginning
            return 'a wheel turns'
        return 'the gyroscope moves' if abs(now - self._gyro_moved) < STILL_TIME else ''

    def calibrate(self, now: float) -> str:
        """Measure the offset again; returns '' if it has begun, else why not. See Reader.calibrate."""
        if self.calibrating:
            return (
                f'the gyroscope is being calibrated: {self.calibration.elapsed:.0f} of {self.calibration.duration:g} s'
            )
        if self._gyro_stamp is None or not abs(now - self._gyro_stamp) <= self.config.max_gap:
            return 'no rates (IMPACT_GYRO) come'
        moving = self.motion(now)
        if moving:
            return f'the chair moves: {moving}'
        self.calibration = self._new_calibration(persistent=False)
        return ''

    def on_steps(self, stamp: float, wheel: int, steps: int, restarted: bool) -> None:
        """A wheel's counter that is believed; restarted: it has begun anew."""
        base = steps if restarted else self._steps.get(wheel, steps)
        moved = (steps - base + 2**31) % 2**32 - 2**31
        if abs(moved) > self.config.still_steps:
            base = steps
            self._wheel_moved = stamp
            self._disturb('a wheel turned')
        self._steps[wheel] = base

    def on_ranges(self) -> None:
        """The sensor node lives: once in RANGES_PERIOD."""
        self._alone += 1

    def on_acceleration(self, stamp: float, acceleration: tuple[float, float, float]) -> None:
        """Three x m/s2."""
        self._fresh = acceleration
        if max(map(abs, acceleration)) > self.config.acceleration_limit:
            self._drop('acceleration_implausible', stamp)
        elif self._acceleration_stuck.add(stamp, acceleration):
            self._drop('acceleration_stuck', stamp)
        elif not self._gravity.add(stamp, acceleration, not self.motion(stamp)):
            self._drop('acceleration_not_gravity', stamp)
        else:
            self._acceleration = (stamp, acceleration)

    def on_tilt(self, stamp: float, roll: float, pitch: float) -> None:
        """Angles that are believed, rad."""
        self._tilt = (stamp, (roll, pitch))

    def on_gyro(self, stamp: float, gyro: tuple[float, float, float], alarm: float) -> list:
        """Three rates (deg/s) and the impact's flag: the readings they give."""
        if self._gyro_stamp is not None:
            self._watch_interval(stamp)
        self._gyro_stamp = stamp
        if max(map(abs, gyro)) > self.config.rate_limit or alarm not in (0, 1):
            return self._drop('gyro_implausible', stamp)
        readings = [ImpactReading(stamp, alarm == 1)]
        acceleration, self._fresh = self._fresh, None
        if self._frozen.add(stamp, gyro, acceleration, self.period):
            return [*readings, *self._stands(stamp)]
        if self._gyro_stuck.add(stamp, gyro):
            self._drop('gyro_stuck', stamp)
            self._disturb('the gyroscope is stuck')
            return readings
        imu = self._imu(stamp, gyro)
        if imu is None:
            return readings
        self.stamp, self._last = stamp, imu
        return [*readings, imu]

    def _stands(self, stamp):
        """The registers stand still: what the chair turns is unseen from then on."""
        self._drop('imu_frozen', stamp)
        self._disturb('the IMU is frozen')
        if self._last is None:
            return []
        self.yaw_doubtful = True
        if self._unseen_since is None:
            self._unseen_since = self._frozen.since
        return [self._last._replace(stamp=stamp, frozen=True, unseen=0.0)]

    def _new_calibration(self, persistent):
        config = self.config
        return GyroCalibration(
            config.calibration_time, config.still_step, config.still_drift, config.max_gap, persistent
        )

    def _disturb(self, reason):
        if self.calibrating:
            restarts = self.calibration.restarts
            self.calibration.start_over(reason)
            self.yaw_doubtful |= self.calibration.restarts > restarts

    def _watch_interval(self, stamp):
        """Learn the period of the frames, and notice an IMU that was away while its node was alive."""
        alone, self._alone = self._alone * RANGES_PERIOD, 0
        if alone > ALONE_TIME:
            # Its offsets are others now. A saved calibration is taken at its word.
            self._drop('imu_restarts', stamp)
            if self.config.calibration == 'measure':
                self.offset = None
                self.calibration = self._new_calibration(persistent=True)
        interval = stamp - self._gyro_stamp
        if self._intervals is None or interval < LEAST_PERIOD:  # less: a frame that was repeated or held back
            return
        self._intervals.append(interval)
        if len(self._intervals) == PERIOD_SAMPLES:
            median = sorted(self._intervals)[PERIOD_SAMPLES // 2]
            self.period = self.yaw.period = min(round(median / SLOT) * SLOT, self.config.max_gap)
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
        rates = x, y, self.yaw.gain * z
        unseen, self._unseen = self._unseen, 0.0
        return ImuReading(
            stamp, roll, pitch, self.yaw.yaw, rates, self._acceleration[1], self.yaw_variance, unseen=unseen
        )

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
        yaw = self.yaw
        gaps, long_gaps, newest = yaw.gaps, yaw.long_gaps, yaw.stamp
        if not yaw.add(stamp, rate):
            self._drop('imu_before_set_pose' if yaw.pending else 'imu_stale', stamp)
            return False
        if yaw.gaps > gaps:
            self._drop('imu_gaps', stamp)
        if yaw.long_gaps > long_gaps:
            self._drop('imu_long_gaps', stamp)
            self.yaw_doubtful = True
            if self._unseen_since is None:
                self._unseen_since = newest
        if self._unseen_since is not None:
            unseen, self._unseen_since = max(stamp - self._unseen_since, 0.0), None
            self._unseen = min(self._unseen + (self.config.unseen_rate * unseen) ** 2, ANY_YAW)
            self.yaw_variance = min(self.yaw_variance + self._unseen, ANY_YAW)
        return True
