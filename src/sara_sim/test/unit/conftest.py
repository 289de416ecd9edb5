"""Helpers of several test files."""

import numpy as np
import pytest
from hypothesis import settings

from canserial.dbc.bus import BusDescription, BusError

# How fast the machine is must not decide whether a test passes.
settings.register_profile('any machine', deadline=None)
settings.load_profile('any machine')

BUS = BusDescription.default()


class Pilot:
    """Drives a chair over its bus as the PC does, at 50 Hz, and keeps what it hears: [(time, name, signals)], `raw` the
    frames.
    """

    def __init__(self, chair):
        self.chair, self.heard, self.raw = chair, [], []
        self._mode, self._tick = 1, 0

    def drive(self, right, left, seconds):
        for _ in range(round(seconds * 100)):
            if self._tick % 2 == 0:
                go = self._mode == 3
                self.chair.receive(
                    BUS.encode(
                        'WHEEL_COMMAND',
                        right=right if go else 0.0,
                        left=left if go else 0.0,
                        mode=ord('C' if go else 'A'),
                    )
                )
            self._tick += 1
            for frame in self.chair.step():
                self.raw.append(frame)
                try:
                    name, signals = BUS.decode(frame)
                except BusError:
                    continue
                if name == 'MODO_PC':
                    self._mode = signals['modoPC']
                self.heard.append((frame.time, name, signals))
        return self

    def values(self, name, signal, since=0.0):
        return np.array([signals[signal] for time, message, signals in self.heard if message == name and time >= since])

    def times(self, name, since=0.0):
        return np.array([time for time, message, _ in self.heard if message == name and time >= since])


@pytest.fixture
def pilot():
    return Pilot
