"""The sensor node: an MPU6050 and nine SRF02s on I2C in, frames 0x201 to 0x206 out (thesis 2.5, 2.6).

`update` is called every 10 ms and never waits. Every call samples the IMU and feeds both filters; the cycle of `schedule` says when
sonars are triggered and read and which frame goes out. The IMU part is a state machine:

    starting     resets, waits, wake-up, configuration
    settling     10 s that count for nothing, while the chip warms up
    calibrating  20 s at rest, averaged into the offset registers; started over if the chair moves
    running      samples and frames
    fault        the chip does not answer, or not as it should; tried again every second

After an error on I2C, or a chip found asleep, the configuration is read back: whole, and the node goes on where it was; else the chip is
started anew and, with the offsets it had, runs again without another calibration. In no state but `running` an IMU frame goes out,
and none holds a sample older than its turn. Ranges go out in every state.
"""

from __future__ import annotations

from collections import Counter, deque
from functools import partial
from math import radians

from canserial.frame import Frame

from sara_lowlevel.calibration import StillAverage
from sara_lowlevel.complementary import ComplementaryFilter
from sara_lowlevel.config import SensorConfig
from sara_lowlevel.madgwick import MadgwickFilter
from sara_lowlevel.mpu6050 import ACCEL_COUNTS_PER_G, GYRO_COUNTS_PER_DPS, ChipError, Mpu6050, calibrated
from sara_lowlevel.rangers import Rangers
from sara_lowlevel.schedule import READ_SLOTS, READ_TRIES, SENSORS, SLOT_S, SLOTS, TIME_TOLERANCE_S, TRIGGER_SLOTS, TURN_1, TURN_2, Cycle, frame_slots

__all__ = ['SENSORS', 'TURN_1', 'TURN_2', 'SensorNode']

STARTING, SETTLING, CALIBRATING, RUNNING, FAULT = 'starting', 'settling', 'calibrating', 'running', 'fault'
_ANGLE_SPAN_DEG, _ANGLE_LIMIT_DEG = 65.536, 32.767
_DPS, _RPS = 1.0 / GYRO_COUNTS_PER_DPS, radians(1.0 / GYRO_COUNTS_PER_DPS)
# A longer silence than this is not bridged by the last rate: the filters take their tilt from gravity anew.
_LONGEST_STEP_S = 0.1


class SensorNode:
    """Chips in, frames out. Call `update` every 10 ms.

    `state`: see above. `reason`: why it is at fault, else ''. `counts`: what went wrong, by kind. `filter`, `madgwick`: the two filters.
    `offsets`: the registers ((ax, ay, az), (gx, gy, gz)) the calibration found, None without one.
    """

    def __init__(self, bus, i2c, config: SensorConfig = SensorConfig()):
        """`bus`: canserial.bus.BusDescription. `i2c`: has smbus2's methods; OSError where nobody acknowledges."""
        self.config = config
        self.state, self.reason = STARTING, ''
        self.counts: Counter = Counter()
        self.offsets: tuple | None = None
        self.filter = ComplementaryFilter(config.complementary_weight, SLOT_S)
        self.madgwick = MadgwickFilter(config.madgwick_beta) if config.madgwick else None
        self.imu = Mpu6050(i2c, config.imu_address, config.motion_threshold, config.motion_duration)
        self.rangers = Rangers(i2c, config.sonar_addresses)
        self._bus = bus
        self._limits = {name: bus.resolution(*name) * 32767 for name in (('RANGE_ACCEL', 'ax'), ('IMPACT_GYRO', 'gx'))}
        self._mps2 = config.gravity / ACCEL_COUNTS_PER_G
        self._period_slots = round(config.imu_period / SLOT_S)
        self._cycle = Cycle(self._duties())
        self._outbox: deque[Frame] = deque()
        self._ranged = False
        self._resume: str | None = None
        self._wanted = config.calibrate
        self._deadline: float | None = None
        self._average: StillAverage | None = None
        self._sampled: float | None = None
        self._accel = (0, 0, 0)
        self._impact = False
        self._forget()

    def update(self, t: float) -> list[Frame]:
        """One slot; `t`: s. Returns the frame to send now, or nothing. A second call within a slot does nothing."""
        due = self._cycle.advance(t)
        if due is None:
            return []
        try:
            if self.state == RUNNING:
                self._sample(t)
            else:
                self._prepare(t)
        except OSError as error:
            self._on_error(t, error)
        for duty in due:
            frame = duty(t)
            if frame is not None:
                self._outbox.append(frame)
        if not self._outbox:
            return []
        # One frame in a slot, even when a late call has several due; what cannot catch up within a cycle is dropped.
        while len(self._outbox) > 6:
            self._outbox.popleft()
            self.counts['frames dropped'] += 1
        return [self._outbox.popleft()]

    def recalibrate(self) -> None:
        """The push-button: settle, measure and write the offsets anew; until then no IMU frame goes out."""
        self.offsets, self._wanted = None, True
        if self._resume is not None:
            self._resume = SETTLING
        elif self.state in (RUNNING, CALIBRATING):
            self._settle()

    @property
    def missed(self) -> int:
        """Slots that were not called in time."""
        return self._cycle.missed

    # --- the cycle ---------------------------------------------------------------------------------------------------

    def _duties(self) -> dict[int, list]:
        duties: dict[int, list] = {slot: [] for slot in range(SLOTS)}
        for slot, names in TRIGGER_SLOTS.items():
            duties[slot].append(partial(self._trigger, names))
        for slot, names in READ_SLOTS.items():
            for k in range(READ_TRIES):
                duties[slot + k].append(partial(self._read, names, k == READ_TRIES - 1))
        senders = {'RANGES_1': self._ranges_1, 'RANGES_2': self._ranges_2, 'MADGWICK': self._angles_madgwick,
                   'COMPLEMENTARY': self._angles_complementary, 'RANGE_ACCEL': self._range_accel, 'IMPACT_GYRO': self._impact_gyro}
        for slot, name in frame_slots(self.config.imu_period, self.config.madgwick).items():
            duties[slot].append(senders[name])
        return duties

    def _trigger(self, names, t: float) -> None:
        self.rangers.trigger(names, t)

    def _read(self, names, last: bool, t: float) -> None:
        self.rangers.read(names, t, last)
        self._ranged = self._ranged or last and names is TURN_2

    def _ranges_1(self, t: float) -> Frame:
        return self._range_frame('RANGES_1', ('STD', 'SDI', 'SLIT', 'SLDD'))

    def _ranges_2(self, t: float) -> Frame | None:
        return self._range_frame('RANGES_2', ('SDD', 'SLID', 'STI', 'SLDT')) if self._ranged else None

    def _range_frame(self, message: str, names: tuple[str, ...]) -> Frame:
        cm = self.rangers.cm
        return self._bus.encode(message, **{name: cm[name] / 100 for name in names})

    # --- frames of the IMU -------------------------------------------------------------------------------------------

    def _may_send(self, t: float) -> bool:
        """Running, a whole period of samples behind it, and a chip that is still awake."""
        if self.state != RUNNING or not self._whole:
            return False
        try:
            self.imu.check_awake()
        except OSError as error:
            self._on_error(t, error)
            return False
        return True

    def _angles_madgwick(self, t: float) -> Frame | None:
        if not self._may_send(t):
            return None
        angles = self.madgwick
        return self._bus.encode('MADGWICK', roll=_tilt(angles.roll), pitch=_tilt(angles.pitch), yaw=_round_yaw(angles.yaw))

    def _angles_complementary(self, t: float) -> Frame | None:
        if not self._may_send(t):
            return None
        angles = self.filter
        return self._bus.encode('COMPLEMENTARY', rx=_tilt(angles.roll), ry=_tilt(angles.pitch), rz=_round_yaw(angles.yaw))

    def _range_accel(self, t: float) -> Frame | None:
        if not self._may_send(t):
            return None
        limit, factor = self._limits['RANGE_ACCEL', 'ax'], self._mps2
        ax, ay, az = (min(max(count * factor, -limit), limit) for count in self._accel)
        return self._bus.encode('RANGE_ACCEL', SJO=self.rangers.cm['SJO'] / 100, az=az, ay=ay, ax=ax)

    def _impact_gyro(self, t: float) -> Frame | None:
        """Closes the IMU period: the mean of its rates, and whether there was an impact in it."""
        sums, count, whole = self._sums, self._count, self._whole
        if self.state != RUNNING:
            return None
        if whole and 2 * count < self._period_slots:
            self.counts['short turns'] += 1
        elif whole and self._may_send(t):
            try:
                self._impact = self.imu.impact() or self._impact
            except OSError as error:
                self._on_error(t, error)
                return None
            limit = self._limits['IMPACT_GYRO', 'gx']
            gx, gy, gz = (min(max(total * _DPS / count, -limit), limit) for total in sums)
            impact, self._impact = self._impact, False
            self._sums, self._count = (0, 0, 0), 0
            return self._bus.encode('IMPACT_GYRO', alarma=int(impact), gz=gz, gy=gy, gx=gx)
        if self.state == RUNNING:
            self._sums, self._count, self._whole = (0, 0, 0), 0, True
        return None

    # --- the IMU -----------------------------------------------------------------------------------------------------

    def _sample(self, t: float) -> None:
        ax, ay, az, gx, gy, gz = self.imu.sample()
        sx, sy, sz = self._sums
        self._sums = (sx + gx, sy + gy, sz + gz)
        self._count += 1
        self._accel = accel = (ax, ay, az)
        dt = SLOT_S if self._sampled is None else t - self._sampled
        self._sampled = t
        if dt > _LONGEST_STEP_S:
            self._restart_filters()
        self.filter.update(accel, (gx * _DPS, gy * _DPS, gz * _DPS), dt)
        if self.madgwick is not None:
            self.madgwick.update(gx * _RPS, gy * _RPS, gz * _RPS, ax, ay, az, dt)

    def _prepare(self, t: float) -> None:
        """Any state but running. Raises OSError, ChipError."""
        if self.state == FAULT:
            if t < self._deadline - TIME_TOLERANCE_S:
                return
            self.state = STARTING
        if self.state == STARTING:
            self._start(t)
        elif self.state == SETTLING:
            self.imu.sample()
            if self._deadline is None:
                self._deadline = t + self.config.settle_time
            if t >= self._deadline - TIME_TOLERANCE_S:
                self._calibrate()
        else:
            self._measure(self.imu.sample())

    def _start(self, t: float) -> None:
        if self._resume is not None:
            # An error on the bus need not mean a chip that lost its settings.
            resume, self._resume = self._resume, None
            try:
                self.imu.check()
                if self.offsets is None or self.imu.offsets() == self.offsets:
                    self._go_on(resume)
                    return
            except ChipError:
                pass
            self.imu.restart()
        if self.imu.advance(t):
            self.counts['chip starts'] += 1
            if self.offsets is not None:
                self.imu.set_offsets(*self.offsets)
            self._go_on(RUNNING if self.offsets is not None or not self._wanted else SETTLING)

    def _go_on(self, state: str) -> None:
        self.reason = ''
        if state == SETTLING:
            self._settle()
        elif state == CALIBRATING:
            self._calibrate()
        else:
            self.imu.impact()
            self.state = RUNNING
            self._forget()

    def _settle(self) -> None:
        self.state, self._deadline = SETTLING, None

    def _calibrate(self) -> None:
        config = self.config
        self.state = CALIBRATING
        self._average = StillAverage(round(config.calibration_time / SLOT_S), config.still_accel / self._mps2,
                                     config.still_rate * GYRO_COUNTS_PER_DPS)

    def _measure(self, sample) -> None:
        average, config = self._average, self.config
        average.add(sample)
        if average.moved:
            self.counts['not still'] += 1
            self._calibrate()
        elif average.done:
            self.imu.check_awake()
            ax, ay, az = average.accel
            bias = max(abs(ax), abs(ay), abs(az - ACCEL_COUNTS_PER_G)) * self._mps2
            rate = max(map(abs, average.gyro)) * _DPS
            if bias > config.max_accel_bias or rate > config.max_rate_bias:
                self.counts['implausible calibration'] += 1
                self.reason = f'calibration refused: the IMU is {bias:.2f} m/s2 and {rate:.2f} deg/s from level and rest'
                self._calibrate()
                return
            offsets = calibrated(*self.imu.offsets(), average.accel, average.gyro)
            self.imu.set_offsets(*offsets)
            self.offsets = offsets
            self._go_on(RUNNING)

    def _on_error(self, t: float, error: OSError) -> None:
        """Count it; look at the chip in the next slot, and every second when that fails too."""
        self.counts[type(error).__name__ if isinstance(error, ChipError) else 'I2C errors'] += 1
        self.reason = str(error)
        if self.state == STARTING:
            self.state, self._deadline = FAULT, t + self.config.retry_period
            self.imu.restart()
        else:
            self._resume, self.state = self.state, STARTING
        self._forget()

    def _forget(self) -> None:
        """No sample of before may reach a frame of after."""
        self._sums, self._count, self._whole = (0, 0, 0), 0, False
        self._sampled = None
        self._restart_filters()

    def _restart_filters(self) -> None:
        self.filter.restart()
        if self.madgwick is not None:
            self.madgwick.restart()


def _tilt(angle: float) -> float:
    """Degrees, kept inside what the frame's 16 bits hold."""
    return min(max(angle, -_ANGLE_LIMIT_DEG), _ANGLE_LIMIT_DEG)


def _round_yaw(angle: float) -> float:
    """Degrees modulo 65.536, in the frame's 16 bits."""
    return _tilt((angle + _ANGLE_SPAN_DEG / 2) % _ANGLE_SPAN_DEG - _ANGLE_SPAN_DEG / 2)
