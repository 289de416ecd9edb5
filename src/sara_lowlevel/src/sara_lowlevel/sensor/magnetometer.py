"""The sensor node's magnetometer: finds out which of the two chips is on the bus, and starts it anew when it fails."""

from __future__ import annotations

from collections import Counter

from sara_lowlevel.hardware import I2cBus
from sara_lowlevel.schedule import Every
from sara_lowlevel.sensor.hmc5883l import Hmc5883l
from sara_lowlevel.sensor.qmc5883l import Qmc5883l

LIMIT = 327.67
"""uT that a frame can hold."""


class Magnetometer:
    """`chip`: the name of the one that answers, '' while none does. `reason`: why none does, else ''. `counts`: what
    went wrong, by kind.
    """

    def __init__(self, i2c: I2cBus, retry_period: float) -> None:
        """`i2c`: has smbus2's methods. `retry_period`: s between attempts to start a chip."""
        self.chip, self.reason = '', ''
        self.counts: Counter = Counter()
        self._kinds = (Hmc5883l(i2c), Qmc5883l(i2c))
        self._driver: Hmc5883l | Qmc5883l | None = None
        self._attempt = Every(retry_period)

    def read(self, t: float) -> tuple[float, float, float] | None:
        """The newest field along x, y, z, uT, at `t` (s); None where there is none. Never raises."""
        if self._driver is None and self._attempt.due(t):
            self._start()
        elif self._driver is not None:
            try:
                field = self._driver.read()
            except OSError as error:
                self._lose(error)
                return None
            if field is not None and max(map(abs, field)) <= LIMIT:
                return field
            self.counts['fields beyond the range'] += 1
        return None

    def _start(self) -> None:
        """What is read comes with the next call: the chip has to measure first."""
        errors = []
        for driver in self._kinds:
            try:
                driver.start()
            except OSError as error:
                errors.append(f'{driver.name}: {error}')
                continue
            self._driver, self.chip, self.reason = driver, driver.name, ''
            return
        self.reason = '; '.join(errors)

    def _lose(self, error: OSError) -> None:
        self.counts['magnetometer failures'] += 1
        self._driver, self.chip, self.reason = None, '', str(error)
