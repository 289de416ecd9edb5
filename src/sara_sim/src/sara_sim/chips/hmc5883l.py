"""An HMC5883L as its bus master meets it: a file of 13 registers (Honeywell, form 900405).

After a loss of supply it measures once and idles. In continuous measurement a new field is there once in a period of
the data rate; beyond 12 bits it says -4096 on that axis. Reading goes on from register 8 to 3 and from 12 to 0.

Not modelled: averaging (the noise is that of the field it is given), the self-test bias, the lock while the data
registers are half read, high-speed I2C.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from sara_sim.chips.measuring_registers import MeasuringRegisters

ADDRESS = 0x1E
CONFIG_A, CONFIG_B, MODE, DATA, STATUS, IDENTIFICATION = 0x00, 0x01, 0x02, 0x03, 0x09, 0x0A
REGISTERS = 13
POWER_UP = bytes((0x10, 0x20, 0x01)) + bytes(7) + b'H43'
CONTINUOUS, SINGLE, IDLE = 0, 1, 2
READY_BIT = 0x01
HERTZ = (0.75, 1.5, 3.0, 7.5, 15.0, 30.0, 75.0, 75.0)
PER_MICROTESLA = tuple(gain / 100.0 for gain in (1370, 1090, 820, 660, 440, 390, 330, 230))
OVERFLOW = -4096
LOWEST, HIGHEST = -2048, 2047


class Hmc5883l(MeasuringRegisters):
    """One chip."""

    POWER_UP = POWER_UP

    def read(self, register: int, length: int) -> list[int]:
        """`length` bytes from `register` on."""
        self._measure()
        answer = []
        for _ in range(length):
            answer.append(self._registers[register] if register < REGISTERS else 0)
            register = DATA if register == STATUS - 1 else (register + 1) % REGISTERS
        return answer

    def write(self, register: int, values: Sequence[int]) -> None:
        """Bytes from `register` on; only the first three registers take them."""
        for address, value in enumerate(values, register):
            if address <= MODE:
                self._registers[address] = value
                self._configured()

    @property
    def _period(self) -> float:
        return 1.0 / HERTZ[self._registers[CONFIG_A] >> 2 & 7]

    def _measure(self) -> None:
        mode = self._registers[MODE] & 3
        if mode >= IDLE or not self._is_due():
            return
        if mode == SINGLE:
            self._registers[MODE] |= IDLE
        if self.stuck:
            return
        scale = PER_MICROTESLA[self._registers[CONFIG_B] >> 5]
        x, y, z = (round(value * scale) for value in self._field())
        counts = (count if LOWEST <= count <= HIGHEST else OVERFLOW for count in (x, z, y))
        struct.pack_into('>3h', self._registers, DATA, *counts)
        self._registers[STATUS] = READY_BIT
