"""What register files of sensors that measure by a clock of their own share."""

from __future__ import annotations

from collections.abc import Callable, Sequence

EARLY_S = 1e-9  # times are sums of binary fractions


class MeasuringRegisters:
    """`silent`: it does not acknowledge; `stuck`: its data registers do not change (faults).

    A derived class gives `POWER_UP`, what the registers hold when the supply comes back, and `_period`, s.
    """

    POWER_UP = b''

    def __init__(self, field: Callable[[], Sequence[float]], clock: Callable[[], float]) -> None:
        """`field`: what reaches the sensing elements now, along x, y, z, uT. `clock`: s."""
        self._field, self._clock = field, clock
        self.silent = self.stuck = False
        self.power_up()

    def power_up(self) -> None:
        """As when its supply comes back."""
        self._registers = bytearray(self.POWER_UP)
        self._due = self._clock()

    @property
    def _period(self) -> float:
        """s between two measurements."""
        raise NotImplementedError

    def _configured(self) -> None:
        """A register was written: the next measurement is a period away."""
        self._due = self._clock() + self._period

    def _is_due(self) -> bool:
        """Whether a measurement is; the next one is a period later then."""
        now = self._clock()
        due = now >= self._due - EARLY_S
        if due:
            self._due = now + self._period
        return due
