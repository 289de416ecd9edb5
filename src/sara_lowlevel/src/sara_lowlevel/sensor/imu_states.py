"""What the sensor node's IMU is doing: a state machine around the driver that never waits and never raises.

    starting     resets, waits, wake-up, configuration
    settling     10 s that count for nothing, while the chip warms up
    calibrating  20 s at rest, averaged into the offset registers; started over if the chair moves
    running      samples
    fault        the chip does not answer, or not as it should; tried again every second

After an error on I2C, or a chip found asleep, the configuration is read back: whole, and it goes on where it was; else
the chip is started anew and, with the offsets it had, runs again without another calibration.
"""

from __future__ import annotations

from collections import Counter

from sara_lowlevel.config import SensorConfig
from sara_lowlevel.schedule import SLOT_S, TIME_TOLERANCE_S
from sara_lowlevel.sensor.calibration import StillAverage
from sara_lowlevel.sensor.mpu6050 import ACCEL_COUNTS_PER_G, GYRO_COUNTS_PER_DPS, ChipError, Mpu6050, calibrated

STARTING, SETTLING, CALIBRATING, RUNNING, FAULT = 'starting', 'settling', 'calibrating', 'running', 'fault'


class ImuStates:
    """`state`, `reason` (why it is at fault, else ''), `counts` (what went wrong, by kind), `offsets` (the registers
    the calibration found, ((ax, ay, az), (gx, gy, gz)), None without one).
    """

    def __init__(self, imu: Mpu6050, config: SensorConfig) -> None:
        self.imu, self.config = imu, config
        self.state, self.reason = STARTING, ''
        self.counts: Counter = Counter()
        self.offsets: tuple | None = None
        self._mps2 = config.gravity / ACCEL_COUNTS_PER_G
        self._resume: str | None = None
        self._wanted = config.calibrate
        self._deadline: float | None = None
        self._average: StillAverage | None = None

    def update(self, t: float) -> tuple[int, int, int, int, int, int] | None:
        """One slot at `t` (s): a sample (counts ax, ay, az, gx, gy, gz) while running, else None."""
        try:
            if self.state == RUNNING:
                return self.imu.sample()
            self._prepare(t)
        except OSError as error:
            self._on_error(t, error)
        return None

    def awake(self, t: float) -> bool:
        """Running, and the chip says so: what was sampled is true. Asked before a frame goes out."""
        if self.state != RUNNING:
            return False
        try:
            self.imu.check_awake()
        except OSError as error:
            self._on_error(t, error)
            return False
        return True

    def impact(self, t: float) -> bool | None:
        """The motion interrupt since the last call; None after an error."""
        try:
            return self.imu.impact()
        except OSError as error:
            self._on_error(t, error)
            return None

    def recalibrate(self) -> None:
        """Settle, measure and write the offsets anew."""
        self.offsets, self._wanted = None, True
        if self._resume is not None:
            self._resume = SETTLING
        elif self.state in (RUNNING, CALIBRATING):
            self._settle()

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
                    if resume == RUNNING:  # what the chip latched meanwhile is still to be told
                        self.state, self.reason = RUNNING, ''
                    else:
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

    def _settle(self) -> None:
        self.state, self._deadline = SETTLING, None

    def _calibrate(self) -> None:
        config = self.config
        self.state = CALIBRATING
        self._average = StillAverage(
            round(config.calibration_time / SLOT_S),
            config.still_accel / self._mps2,
            config.still_rate * GYRO_COUNTS_PER_DPS,
        )

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
            rate = max(map(abs, average.gyro)) / GYRO_COUNTS_PER_DPS
            if bias > config.max_accel_bias or rate > config.max_rate_bias:
                self.counts['implausible calibration'] += 1
                self.reason = (
                    f'calibration refused: the IMU is {bias:.2f} m/s2 and {rate:.2f} deg/s from level and rest'
                )
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
