"""An SRF02 ultrasonic ranger as its bus master meets it (maker's technical documentation, I2C mode).

Six registers. Writing a command to register 0 starts a ranging that takes about 66 ms, in which the chip does not talk:
whoever reads sees the bus's pull-ups, 0xFF. Registers 2 and 3 then hold the range, 0 for no echo; 4 and 5 the least
range it can measure, which the chip finds by itself in the first rangings after power-up: from 28 cm down to where its
transducer has stopped ringing, here 16 cm. An object nearer than that echoes into the ringing; it is reported as the
ringing's end, 15 cm, one step below what can be measured.
"""

from __future__ import annotations

from collections.abc import Callable

COMMAND, RESULT, MINIMUM = 0, 2, 4
REVISION, UNUSED = 6, 0x80
RANGE_INCHES, RANGE_CM, RANGE_US = 0x50, 0x51, 0x52
BURST, AUTOTUNE = 0x5C, 0x60
RANGING_S = 0.066
DEAD_CM, NEAR_CM = 16, 15
FARTHEST_CM = 600
UNTUNED_CM, TUNING_STEPS = 28, 6
BUSY = 0xFF
# 65 us per cm there and back and 148 us per inch, as the maker converts.
_FROM_CM = {RANGE_INCHES: 1.0 / 2.54, RANGE_CM: 1.0, RANGE_US: 58.0}


class Srf02:
    """One sensor. `silent`: it does not acknowledge. `stuck_cm`: every result, when not None (faults). `minimum_cm`:
    the least range it measures now.
    """

    def __init__(self, echo: Callable[[], float], clock: Callable[[], float]):
        """`echo`: sends a burst now and gives the distance it comes back from (m), inf without an echo. `clock`: s."""
        self._echo, self._clock = echo, clock
        self.silent = False
        self.stuck_cm: int | None = None
        self.rangings = 0
        self.power_up()

    def power_up(self) -> None:
        """Forget everything, as when its supply comes back."""
        self._busy_until = 0.0
        self._tune(0)
        self._unit = RANGE_CM
        self._cm: float = 0.0

    def _tune(self, steps: int) -> None:
        self._tuned = min(steps, TUNING_STEPS)
        self.minimum_cm = UNTUNED_CM - round((UNTUNED_CM - DEAD_CM) * self._tuned / TUNING_STEPS)

    def read(self, register: int, length: int) -> list[int]:
        """Bytes from `register` on; 0xFF each while it is ranging and behind the last register."""
        if self._clock() < self._busy_until - 1e-9:
            return [BUSY] * length
        factor = _FROM_CM[self._unit]
        result, least = round(self._cm * factor), round(self.minimum_cm * factor)
        registers = (REVISION, UNUSED, result >> 8, result & 0xFF, least >> 8, least & 0xFF)
        return [registers[index] if index < 6 else BUSY for index in range(register, register + length)]

    def write(self, register: int, values: list[int]) -> None:
        """Only register 0 can be written; a command while it is ranging is not heard."""
        now = self._clock()
        if register != COMMAND or now < self._busy_until - 1e-9:
            return
        command = values[0] if values else None
        if command in _FROM_CM:
            self._unit = command
            self._busy_until = now + RANGING_S
            self._cm = self._measure()
            if self._tuned < TUNING_STEPS:
                self._tune(self._tuned + 1)
            self.rangings += 1
        elif command == AUTOTUNE:
            self._tune(0)

    def _measure(self) -> float:
        distance = self._echo()
        if self.stuck_cm is not None:
            return self.stuck_cm
        if distance == float('inf'):
            return 0
        cm = round(100.0 * distance)
        if cm > FARTHEST_CM:  # it has stopped listening by then
            return 0
        least = self.minimum_cm
        return cm if cm >= least else least - (DEAD_CM - NEAR_CM)
