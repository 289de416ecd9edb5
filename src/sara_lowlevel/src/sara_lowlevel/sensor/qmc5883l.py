"""Driver of the QMC5883L magnetometer (QST, data sheet 1.0), which most boards sold as HMC5883L carry: continuous
measurement.

Its register map is not that of the HMC5883L: x, y, z from register 0 on, the low byte first; bit 1 of the status says
that an axis is beyond the range. Configured as here it measures 100 times a second within +-800 uT. Nothing sleeps.
"""

from __future__ import annotations

import struct

from sara_lowlevel.hardware import I2cBus
from sara_lowlevel.sensor.mpu6050 import ChipError

ADDRESS = 0x0D
DATA, STATUS, CONTROL_1, CONTROL_2, SET_RESET, IDENTIFICATION = 0x00, 0x06, 0x09, 0x0A, 0x0B, 0x0D
SOFT_RESET, OVERFLOW_BIT = 0x80, 0x02
CONFIGURATION = ((SET_RESET, 0x01), (CONTROL_2, 0x01), (CONTROL_1, 0x19))
"""In the order they are written: the set/reset period that the maker recommends; no interrupt pin; oversampling 512,
8 gauss, 100 Hz, continuous measurement."""
IDENTITY = 0xFF
MICROTESLA = 100.0 / 3000.0
_unpack = struct.Struct('<3h').unpack


class Qmc5883l:
    """One chip, whose axes are parallel to the IMU's."""

    name = 'QMC5883L'

    def __init__(self, i2c: I2cBus) -> None:
        self._i2c = i2c

    def start(self) -> None:
        """Check the identity, reset and configure. Raises OSError where no chip acknowledges, ChipError for another."""
        identity = self._i2c.read_byte_data(ADDRESS, IDENTIFICATION)
        if identity != IDENTITY:
            raise ChipError(f'the chip at 0x{ADDRESS:02x} identifies itself by 0x{identity:02x}, a QMC5883L by 0xff')
        self._i2c.write_byte_data(ADDRESS, CONTROL_2, SOFT_RESET)
        for register, value in CONFIGURATION:
            self._i2c.write_byte_data(ADDRESS, register, value)

    def read(self) -> tuple[float, float, float] | None:
        """The newest field along x, y, z, uT; None beyond the range. Raises OSError, ChipError for a chip that has lost
        its configuration, as after a loss of supply.
        """
        answer = bytes(self._i2c.read_i2c_block_data(ADDRESS, DATA, SET_RESET + 1))
        if len(answer) != SET_RESET + 1 or any(answer[register] != value for register, value in CONFIGURATION):
            raise ChipError(f'the QMC5883L at 0x{ADDRESS:02x} is not configured')
        if answer[STATUS] & OVERFLOW_BIT:
            return None
        x, y, z = _unpack(answer[DATA:STATUS])
        return x * MICROTESLA, y * MICROTESLA, z * MICROTESLA
