"""Driver of the MPU6050 (the thesis's SarIMU.c): power-up, configuration, offset registers, burst reads, impact.

Method: InvenSense's register map and product specification of the MPU-6000/6050; the offset registers, MOT_THR, MOT_DUR
and MOT_DETECT_CTRL are known from its earlier revisions. The thesis's own listing sets DEVICE_RESET and never wakes the
chip, which comes out of a reset asleep; here the resets are waited for, the chip is woken, and every register is read
back. Nothing sleeps:
`advance` is called with the time until it says that the chip is ready.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence

from sara_lowlevel.hardware import I2cBus

XA_OFFS, XG_OFFS = 0x06, 0x13
GYRO_CONFIG, ACCEL_CONFIG, MOT_THR, MOT_DUR = 0x1B, 0x1C, 0x1F, 0x20
INT_PIN_CFG, INT_ENABLE, INT_STATUS = 0x37, 0x38, 0x3A
ACCEL_XOUT = 0x3B  # from here on x, y, z of the accelerometer, the temperature, x, y, z of the gyroscope
SIGNAL_PATH_RESET, MOT_DETECT_CTRL, PWR_MGMT_1, WHO_AM_I = 0x68, 0x69, 0x6B, 0x75

DEVICE_RESET, AWAKE_PLL_GYRO_X, MOTION_BIT, IDENTITY = 0x80, 0x01, 0x40, 0x68
RESET_WAIT_S = 0.1
ACCEL_COUNTS_PER_G, GYRO_COUNTS_PER_DPS = 16384.0, 131.0
# Sample counts to a count of the offset registers (eq. 2.1, 2.2): 2 g against 16 g, 250 against 1000 deg/s.
ACCEL_COUNTS_PER_STEP, GYRO_COUNTS_PER_STEP = 8, 4
REST = (0.0, 0.0, ACCEL_COUNTS_PER_G)

# What configMPU6050() of the thesis writes, in its order and without a wait: it leaves the chip asleep.
THESIS_LISTING = (
    (PWR_MGMT_1, 0x80),
    (SIGNAL_PATH_RESET, 0x07),
    (INT_PIN_CFG, 0x20),
    (ACCEL_CONFIG, 0x01),
    (MOT_THR, 20),
    (MOT_DUR, 40),
    (MOT_DETECT_CTRL, 0x15),
    (INT_ENABLE, 0x40),
)

_unpack, _unpack_sample = struct.Struct('>6h').unpack, struct.Struct('>3h2x3h').unpack
_TOLERANCE_S = 1e-6


class ChipError(OSError):
    """The chip answers, but not as an MPU6050 that is configured would."""


def write_sequence(i2c: I2cBus, address: int, sequence: Iterable[tuple[int, int]]) -> None:
    """Write (register, value) pairs one after the other. Raises OSError."""
    for register, value in sequence:
        i2c.write_byte_data(address, register, value)


def calibrated(
    accel_offsets: Sequence[int],
    gyro_offsets: Sequence[int],
    accel_mean: Sequence[float],
    gyro_mean: Sequence[float],
    rest: Sequence[float] = REST,
) -> tuple[tuple, tuple]:
    """Eq. 2.1, 2.2: new offset registers from the present ones and the mean counts (3 + 3) at rest; `rest`: the
    accelerometer's ideal counts.

    Rounded to the nearest step that can be written: bit 0 of the accelerometer's registers is the chip's own and kept,
    so a step there is two counts. What remains is at most half a step: 8 sample counts (0.5 mg), and 2 (0.0153 deg/s).
    """
    accel = tuple(
        _within(old + 2 * round((ideal - mean) / (2 * ACCEL_COUNTS_PER_STEP)), -32768 + (old & 1), 32766 + (old & 1))
        for old, mean, ideal in zip(accel_offsets, accel_mean, rest)
    )
    gyro = tuple(
        _within(old + round(-mean / GYRO_COUNTS_PER_STEP), -32768, 32767) for old, mean in zip(gyro_offsets, gyro_mean)
    )
    return accel, gyro


def _within(value: int, low: int, high: int) -> int:
    return min(max(value, low), high)


class Mpu6050:
    """One chip. `ready`: configured and awake, since `advance` said so."""

    def __init__(self, i2c: I2cBus, address: int = 0x68, motion_threshold: int = 20, motion_duration: int = 40) -> None:
        """`i2c`: has smbus2's methods. `motion_threshold`: 2 mg each; `motion_duration`: ms."""
        self.address = address
        self.ready = False
        self.configuration = (
            (INT_PIN_CFG, 0x20),
            (GYRO_CONFIG, 0x00),
            (ACCEL_CONFIG, 0x01),
            (MOT_THR, motion_threshold),
            (MOT_DUR, motion_duration),
            (MOT_DETECT_CTRL, 0x15),
            (INT_ENABLE, 0x40),
        )
        self._i2c = i2c
        self._block = i2c.read_i2c_block_data
        self._stage, self._not_before = 0, 0.0

    def restart(self) -> None:
        """Begin the power-up sequence anew with the next `advance`."""
        self.ready, self._stage = False, 0

    def advance(self, t: float) -> bool:
        """Take the next step of the power-up sequence that is due at `t` (s). True once the chip is ready. Raises
        OSError, ChipError.
        """
        if self.ready or (self._stage and t < self._not_before - _TOLERANCE_S):
            return self.ready
        if self._stage == 0:
            self._check_identity()
            self._write(PWR_MGMT_1, DEVICE_RESET)
        elif self._stage == 1:
            self._write(PWR_MGMT_1, AWAKE_PLL_GYRO_X)
            self._verify(PWR_MGMT_1, AWAKE_PLL_GYRO_X)
            self._write(SIGNAL_PATH_RESET, 0x07)
        else:
            write_sequence(self._i2c, self.address, self.configuration)
            self.check()
            self.impact()  # waking up moves the motion detector's filter
            self.ready = True
        self._stage, self._not_before = self._stage + 1, t + RESET_WAIT_S
        return self.ready

    def check(self) -> None:
        """Read back that the chip is awake and configured as it was left. Raises ChipError where it is not, OSError."""
        self.check_awake()
        for register, value in self.configuration:
            self._verify(register, value)

    def check_awake(self) -> None:
        """Whether the chip lost its supply, by one register: it comes up asleep. Raises ChipError, OSError."""
        self._verify(PWR_MGMT_1, AWAKE_PLL_GYRO_X)

    def sample(self) -> tuple[int, int, int, int, int, int]:
        """Counts ax, ay, az, gx, gy, gz (eq. 2.3 to 2.9), in one burst: so all are of the same instant. Raises OSError,
        ChipError for a short answer.
        """
        try:
            return _unpack_sample(bytes(self._block(self.address, ACCEL_XOUT, 14)))
        except struct.error as error:
            raise ChipError(f'the chip at 0x{self.address:02x} sent a short answer') from error

    def impact(self) -> bool:
        """Whether the motion interrupt fired since the last call: it is latched, and cleared by reading. Raises
        OSError.
        """
        return bool(self._i2c.read_byte_data(self.address, INT_STATUS) & MOTION_BIT)

    def offsets(self) -> tuple[tuple, tuple]:
        """The offset registers (accelerometer x, y, z), (gyroscope x, y, z): the factory's after a reset. Raises
        OSError.
        """
        raw = bytes(self._block(self.address, XA_OFFS, 6)) + bytes(self._block(self.address, XG_OFFS, 6))
        if len(raw) != 12:
            raise ChipError(f'the chip at 0x{self.address:02x} sent a short answer')
        values = _unpack(raw)
        return values[:3], values[3:]

    def set_offsets(self, accel: Sequence[int], gyro: Sequence[int]) -> None:
        """Write the offset registers and read them back. Raises OSError, ChipError."""
        for first, values in ((XA_OFFS, accel), (XG_OFFS, gyro)):
            for axis, value in enumerate(values):
                self._i2c.write_i2c_block_data(self.address, first + 2 * axis, list(struct.pack('>h', value)))
        kept = self.offsets()
        if kept != (tuple(accel), tuple(gyro)):
            raise ChipError(f'the offset registers hold {kept}, written were {(tuple(accel), tuple(gyro))}')

    def _check_identity(self) -> None:
        identity = self._i2c.read_byte_data(self.address, WHO_AM_I)
        if identity != IDENTITY:
            raise ChipError(
                f'the chip at 0x{self.address:02x} answers WHO_AM_I with 0x{identity:02x}, '
                f'an MPU6050 says 0x{IDENTITY:02x}'
            )

    def _write(self, register: int, value: int) -> None:
        self._i2c.write_byte_data(self.address, register, value)

    def _verify(self, register: int, value: int) -> None:
        held = self._i2c.read_byte_data(self.address, register)
        if held != value:
            raise ChipError(
                f'register 0x{register:02x} of the chip at 0x{self.address:02x} holds 0x{held:02x}, '
                f'written was 0x{value:02x}'
            )
