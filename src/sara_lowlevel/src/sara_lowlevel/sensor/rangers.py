"""The SRF02s of the sensor node: ranged in turns, each with its own luck.

A ranger that does not answer must not look like free space, nor like an old distance. It shares its frame with three
others, so
leaving the frame out would blind those: its 16 bits then hold `SILENT` (655.35 m), which no SRF02 measures and which
readers of the bus drop as implausible.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from sara_lowlevel.hardware import I2cBus
from sara_lowlevel.sensor.srf02 import Srf02

SILENT = 0xFFFF


class Rangers:
    """`cm`: the last turn's answer of each sensor, whole cm, 0 no echo, SILENT where there was none. `counts`: silences
    by name.
    """

    def __init__(self, i2c: I2cBus, addresses: Mapping[str, int]) -> None:
        """`addresses`: {name: 7 bits}."""
        self.cm = dict.fromkeys(addresses, SILENT)
        self.counts: Counter = Counter()
        self._rangers = {name: Srf02(i2c, address) for name, address in addresses.items()}
        self._waiting: set[str] = set()

    def trigger(self, names: Iterable[str], t: float) -> None:
        """Start a ranging of each at `t` (s)."""
        for name in names:
            try:
                self._rangers[name].trigger(t)
                self._waiting.add(name)
            except OSError:
                self._silence(name)

    def read(self, names: Iterable[str], t: float, last: bool) -> None:
        """Take the answers that are there at `t` (s). `last`: who has none by now is silent."""
        for name in names:
            if name not in self._waiting:
                continue
            try:
                distance = self._rangers[name].read(t)
            except OSError:
                distance = None  # as a ranger that is still ranging: it does not acknowledge then
            if distance is not None:
                self.cm[name] = distance
                self._waiting.discard(name)
            elif last:
                self._silence(name)

    def revisions(self) -> dict[str, int | None]:
        """Software revision of each sensor, None where it has not answered yet."""
        return {name: ranger.revision for name, ranger in self._rangers.items()}

    def _silence(self, name: str) -> None:
        self._waiting.discard(name)
        self.cm[name] = SILENT
        self.counts[name] += 1
