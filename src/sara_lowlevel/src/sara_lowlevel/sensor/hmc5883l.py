"""Driver of the HMC5883L magnetometer (Honeywell, 3-Axis Digital Compass IC, form 900405): continuous measurement.

The chip comes up measuring once and then idles. Configured as here it measures 75 times a second, each time the mean of
8 samples, within +-250 uT. Its output registers hold x, z, y, in this order, the high byte first; -4096 is an overflow.
Nothing sleeps.
"""

from __future__ import annotations

import struct

from sara_lowlevel.hardware import I2cBus
from sara_lowlevel.sensor.mpu6050 import ChipError

ADDRESS = 0x1E
CONFIG_A, DATA, IDENTIFICATION = 0x00, 0x03, 0x0A
CONFIGURATION = (0x78, 0x60, 0x00)
"""Registers 0 to 2: 8 samples averaged at 75 Hz, no self-test bias; 660 LSB/gauss; continuous measurement."""
IDENTITY = b'H43'
MICROTESLA = 100.0 / 660.0
OVERFLOW = -4096
_unpack = struct.Struct('>3h').unpack


class Hmc5883l:
    """One chip, whose axes are parallel to the IMU's."""

    name = 'HMC5883L'

    def __init__(self, i2c: I2cBus) -> None:
        self._i2c = i2c

    def start(self) -> None:
        """Check the identity and configure. Raises OSError where no chip acknowledges, ChipError for another one."""
        identity = bytes(self._i2c.read_i2c_block_data(ADDRESS, IDENTIFICATION, 3))
        if identity != IDENTITY:
            raise ChipError(f'the chip at 0x{ADDRESS:02x} identifies itself by {identity!r}, an HMC5883L by {IDENTITY}')
        for register, value in enumerate(CONFIGURATION, CONFIG_A):
            self._i2c.write_byte_data(ADDRESS, register, value)

    def read(self) -> tuple[float, float, float] | None:
        """The newest field along x, y, z, uT; None beyond the range. Raises OSError, ChipError for a chip that has lost
        its configuration, as after a loss of supply.
        """
        answer = bytes(self._i2c.read_i2c_block_data(ADDRESS, CONFIG_A, 9))  # no further: the address goes back to 3
        if len(answer) != 9 or answer[:DATA] != bytes(CONFIGURATION):
            raise ChipError(f'the HMC5883L at 0x{ADDRESS:02x} is not configured')
        x, z, y = _unpack(answer[DATA:])
        if OVERFLOW in (x, y, z):
            return None
        return x * MICROTESLA, y * MICROTESLA, z * MICROTESLA
