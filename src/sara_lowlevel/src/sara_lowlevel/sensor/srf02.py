"""Driver of an SRF02 ultrasonic ranger on I2C. Never waits: start a ranging, come back 66 ms later.

Method: Devantech's SRF02 technical specification, I2C mode. Register 0 written starts a ranging (0x51: result in cm),
read it is the software revision; registers 2, 3 hold the result, high byte first. While ranging (65 ms at most) the
ranger does not answer, which a master sees as a missing acknowledgement or as 0xFF. 0 is no echo. It sees nothing
nearer than 15 to 18 cm; what stands there gives the least range or a multiple echo, so a short reading is handed on as
it is.
"""

from __future__ import annotations

from sara_lowlevel.hardware import I2cBus

RANGE_IN_CM = 0x51
RANGING_S = 0.066
MAX_CM = 600
_RANGING = 0xFF
# Times are sums of binary fractions: 70 ms must not count as less than 66 for a rounding error, nor 66 itself.
_TOLERANCE_S = 1e-6


class RangerError(OSError):
    """The ranger answered with what an SRF02 cannot have measured."""


class Srf02:
    """One ranger. `revision`: its software revision once it has answered."""

    def __init__(self, i2c: I2cBus, address: int) -> None:
        """`i2c`: has smbus2's methods. `address`: 7 bits (0x70 as shipped)."""
        self.address = address
        self.revision: int | None = None
        self._i2c = i2c
        self._triggered: float | None = None

    def trigger(self, t: float) -> None:
        """Start a ranging at `t` (s). Raises OSError where no chip acknowledges."""
        self._triggered = None
        self._i2c.write_byte_data(self.address, 0, RANGE_IN_CM)
        self._triggered = t

    def read(self, t: float) -> int | None:
        """The range in whole cm, 0 without an echo; None while it is ranging, or when nothing was triggered.

        Raises OSError where no chip acknowledges, RangerError beyond 600 cm or for a short answer.
        """
        if self._triggered is None or t < self._triggered + RANGING_S - _TOLERANCE_S:
            return None
        answer = self._i2c.read_i2c_block_data(self.address, 0, 4)
        if len(answer) != 4:
            raise RangerError(f'the ranger at 0x{self.address:02x} sent {len(answer)} bytes, 4 were asked for')
        if answer[0] == _RANGING:
            return None
        self.revision = answer[0]
        self._triggered = None
        distance = answer[2] << 8 | answer[3]
        if distance > MAX_CM:
            raise RangerError(
                f'the ranger at 0x{self.address:02x} says {distance} cm, {MAX_CM} is the most an SRF02 measures'
            )
        return distance
