"""The sensor node's I2C bus with simulated chips on it, behind the methods of `smbus2.SMBus`.

Whoever drives the chips on a Raspberry Pi drives these, with the same calls and the same error: OSError where nobody
acknowledges.
"""

from __future__ import annotations

import errno
from collections import Counter

BLOCK_MAX = 32


class SimulatedI2c:
    """`chips`: {7-bit address: chip with `read(register, length)`, `write(register, values)`, `silent`}. `counts`:
    transfers and errors.
    """

    def __init__(self, chips: dict):
        self.chips = dict(chips)
        self.counts: Counter = Counter()

    def __enter__(self) -> SimulatedI2c:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """As a real bus: nothing answers afterwards."""
        self.chips = {}

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int, force: bool | None = None) -> list[int]:
        """`length` (1..32) bytes from `register` on. Raises OSError."""
        if not 0 < length <= BLOCK_MAX:
            raise ValueError(f'length is {length}, allowed is 1 to {BLOCK_MAX}')
        chip = self.chips.get(i2c_addr)
        return (self._chip(i2c_addr) if chip is None or chip.silent else chip).read(register, length)

    def read_byte_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        """One byte. Raises OSError."""
        return self._chip(i2c_addr).read(register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        """One byte. Raises OSError."""
        if not 0 <= value <= 0xFF:
            raise ValueError(f'value is {value}, allowed is a byte')
        self._chip(i2c_addr).write(register, [value])

    def write_i2c_block_data(self, i2c_addr: int, register: int, data: list[int], force: bool | None = None) -> None:
        """At most 32 bytes from `register` on. Raises OSError."""
        if not 0 < len(data) <= BLOCK_MAX or min(data) < 0 or max(data) > 0xFF:
            raise ValueError(f'data are {list(data)}, allowed is 1 to {BLOCK_MAX} bytes')
        self._chip(i2c_addr).write(register, list(data))

    def _chip(self, address: int):
        chip = self.chips.get(address)
        if chip is None or chip.silent:
            self.counts['no acknowledge'] += 1
            raise OSError(errno.EREMOTEIO, f'nobody acknowledges at 0x{address:02X}')
        return chip
