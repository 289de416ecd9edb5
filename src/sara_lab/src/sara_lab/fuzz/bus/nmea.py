"""Nonsense at a GPS receiver's port: sentences of any fields, damaged ones, noise, in pieces of any size, under a clock
that jumps. What comes out must be a place on the earth with a variance, or no fix.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from nmea_navsat_driver.config import DriverConfig
from nmea_navsat_driver.receiver import NO_FIX, Fix, Message, Receiver, TimeReference
from nmea_navsat_driver.sentences import Lines, framed
from sara_lab.fuzz.blocks import Report

KINDS = ('GGA', 'GST', 'RMC', 'GSV', 'ZZZ', '')
WORDS = ('', '0', '1', '9', 'A', 'V', 'N', 'S', 'E', 'W', '-1', '1e9', 'nan', 'inf', '.', '4030.6', '00321.0', '9960.0')
GOOD = 'GPGGA,120000.40,4030.600000,N,00321.000000,W,1,09,1.2,588.0,M,51.5,M,,'


class _Port:
    """A driver's parser and what it said of the last bytes."""

    def __init__(self, rng: np.random.Generator):
        self._rng, self._lines, self._clock = rng, Lines(), 1000.0
        self.said: list[str] = []
        self.receiver = Receiver(DriverConfig(), self.said.append)
        self.messages: list[Message] = []

    def sentence(self) -> None:
        """Any fields, in the order of their kind or not, with a right checksum."""
        count = int(self._rng.integers(0, 18))
        words = [self._word() for _ in range(count)]
        self._send(framed(','.join([f'GP{KINDS[self._rng.integers(len(KINDS))]}', *words])))

    def damaged(self) -> None:
        """A good sentence with some bytes changed, lost or doubled."""
        data = bytearray(framed(GOOD))
        for _ in range(int(self._rng.integers(1, 4))):
            at = int(self._rng.integers(len(data)))
            what = self._rng.integers(3)
            data[at : at + 1] = (b'', bytes(data[at : at + 1]) * 2, bytes([int(self._rng.integers(256))]))[what]
        self._send(bytes(data))

    def noise(self) -> None:
        """Any bytes, as of a wrong baud rate."""
        self._send(self._rng.bytes(int(self._rng.integers(1, 400))))

    def clock_jumps(self) -> None:
        """The clock is set, a good sentence follows."""
        self._clock = float(self._rng.choice((0.0, 1e9, 1000.0, self._clock - 10.0)))
        self._send(b'\r\n' + framed(GOOD))

    def _word(self):
        if self._rng.random() < 0.3:
            return f'{self._rng.normal(0.0, 10.0 ** self._rng.integers(0, 6)):.4f}'
        return WORDS[self._rng.integers(len(WORDS))]

    def _send(self, data):
        self._clock += 0.1
        self.messages = []
        while data:
            count = int(self._rng.integers(1, len(data) + 1))
            for line in self._lines.feed(data[:count]):
                self.messages += self.receiver.on_line(line, self._clock)
            data = data[count:]

    def wrong(self) -> Iterable[str]:
        """A sentence for each message that cannot be."""
        for message in self.messages:
            if isinstance(message, Fix) and message.status != NO_FIX:
                if not (abs(message.latitude) <= 90.0 and abs(message.longitude) <= 180.0):
                    yield f'a place that is not on the earth: {message}'
                if not all(0.0 < variance < math.inf for variance in message.variances):
                    yield f'a variance that is none: {message}'
            elif isinstance(message, TimeReference):
                if not math.isfinite(message.utc):
                    yield f'a time that is none: {message}'
            elif not isinstance(message, Fix) and not all(map(math.isfinite, message)):
                yield f'a velocity that is none: {message}'


def fuzz_nmea(count: int, seed: int) -> Report:
    """count: pieces of nonsense at one port."""
    rng, report = np.random.default_rng(seed), Report()
    port = _Port(rng)
    acts = (0.5, port.sentence), (0.3, port.damaged), (0.15, port.noise), (0.05, port.clock_jumps)
    report.attack(rng, count, acts, port.wrong, lambda: port.messages)
    damage = [sentence for sentence in port.said if 'counted only' in sentence]
    report.check_said(damage, 4)
    return report
