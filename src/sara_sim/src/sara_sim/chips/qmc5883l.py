"""A QMC5883L as its bus master meets it: a file of 14 registers (QST, data sheet 1.0).

After a loss of supply it stands by. In continuous measurement a new field is there once in a period of the data rate;
an axis beyond 16 bits is limited and sets OVL. A soft reset gives all registers the values they come up with.

Not modelled: oversampling (the noise is that of the field it is given), the temperature (0), DOR, the interrupt pin.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from sara_sim.chips.measuring_registers import MeasuringRegisters

ADDRESS = 0x0D
DATA, STATUS, CONTROL_1, CONTROL_2, SET_RESET, IDENTIFICATION = 0x00, 0x06, 0x09, 0x0A, 0x0B, 0x0D
REGISTERS = 14
POWER_UP = bytes(IDENTIFICATION) + b'\xff'
WRITABLE = (CONTROL_1, CONTROL_2, SET_RESET)
CONTINUOUS, READY_BIT, OVERFLOW_BIT, SOFT_RESET = 0x01, 0x01, 0x02, 0x80
HERTZ = (10.0, 50.0, 100.0, 200.0)
PER_MICROTESLA = (120.0, 30.0, 120.0, 120.0)
"""At 2 and 8 gauss; the other two values are reserved."""
HIGHEST = 32767


class Qmc5883l(MeasuringRegisters):
    """One chip."""

    POWER_UP = POWER_UP

    def read(self, register: int, length: int) -> list[int]:
        """`length` bytes from `register` on. Reading a data register clears READY."""
        self._measure()
        answer = [self._registers[address % REGISTERS] for address in range(register, register + length)]
        if register < STATUS:
            self._registers[STATUS] &= ~READY_BIT
        return answer

    def write(self, register: int, values: Sequence[int]) -> None:
        """Bytes from `register` on; what cannot be written stays."""
        for address, value in enumerate(values, register):
            if address == CONTROL_2 and value & SOFT_RESET:
                self.power_up()
            elif address in WRITABLE:
                self._registers[address] = value
                self._configured()

    @property
    def _period(self) -> float:
        return 1.0 / HERTZ[self._registers[CONTROL_1] >> 2 & 3]

    def _measure(self) -> None:
        control = self._registers[CONTROL_1]
        if control & 3 != CONTINUOUS or not self._is_due():
            return
        if self.stuck:
            return
        scale = PER_MICROTESLA[control >> 4 & 3]
        counts = [round(value * scale) for value in self._field()]
        limited = [min(max(count, -HIGHEST - 1), HIGHEST) for count in counts]
        struct.pack_into('<3h', self._registers, DATA, *limited)
        self._registers[STATUS] = READY_BIT | (OVERFLOW_BIT if limited != counts else 0)
