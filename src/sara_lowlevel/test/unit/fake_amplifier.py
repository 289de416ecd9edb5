"""An AX3500 at byte level for the tests: two first-order motors with encoders behind the protocol of its manual.
Independent of the driver.
"""

import math
import re

from sara_common.platforms import chosen

STEPS_PER_TURN, FULL_SPEED = chosen().wheels.steps_per_turn, chosen().motor_node['full_speed']


class FakeAmplifier:
    """`speeds`: rad/s (channel 1, 2). `alive`, `echo`: talk at all. `blocked`: neither wheel turns. `encoder_sign`: per
    channel.
    """

    def __init__(self, full_speed=FULL_SPEED, lag=0.1, latency=0.012, watchdog=True):
        self.full_speed, self.lag, self.latency, self.watchdog = full_speed, lag, latency, watchdog
        self.power, self.speeds, self.angles = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.encoder_sign, self.motor_sign = [1, 1], [1, 1]
        self.alive, self.blocked, self.load = True, False, 0.0
        self.now, self._heard_at, self._line, self._out = 0.0, 0.0, b'', []
        self.commands = []

    def counts(self, channel):
        steps = round(self.encoder_sign[channel] * self.angles[channel] * STEPS_PER_TURN / (2 * math.pi)) % 2**32
        return steps - 2**32 if steps >= 2**31 else steps

    def advance(self, t):
        """Let time pass."""
        dt, self.now = t - self.now, t
        if self.watchdog and t - self._heard_at > 1.0:
            self.power = [0.0, 0.0]
        for k in range(2):
            target = 0.0 if self.blocked else self.motor_sign[k] * self.full_speed * self.power[k] - self.load
            decay = math.exp(-dt / self.lag)
            self.angles[k] += target * dt + (self.speeds[k] - target) * self.lag * (1 - decay)
            self.speeds[k] = target + (self.speeds[k] - target) * decay
            if self.blocked:
                self.speeds[k] = 0.0

    def write(self, data):
        for byte in data:
            self._heard_at = self.now
            if byte != 13:
                self._line += bytes([byte])
                continue
            line, self._line = self._line.decode(), b''
            if line and self.alive:
                self._out.append((self.now + self.latency, (line + '\r' + self._answer(line)).encode()))

    def read(self):
        due = [text for when, text in self._out if when <= self.now + 1e-9]
        self._out = [(when, text) for when, text in self._out if when > self.now + 1e-9]
        return b''.join(due)

    def _answer(self, line):
        if match := re.fullmatch('!([ABab])([0-7][0-9A-F])', line):
            letter, value = match.groups()
            channel = 'AB'.index(letter.upper())
            self.power[channel] = int(value, 16) / 127 * (1 if letter.isupper() else -1)
            self.commands.append((self.now, line))
            return '+\r'
        if match := re.fullmatch('[?]Q([01])', line):
            return abbreviate(self.counts(int(match[1]))) + '\r'
        return '73\r78\r' if line == '?E' else '-\r'


def abbreviate(value):
    """The encoder module's short hex: table 33 of the manual."""
    text = f'{value & 0xFFFFFFFF:08X}'
    fill = 'F' if value < 0 else '0'
    short = text.lstrip(fill)
    negative = short[:1] in '89ABCDEF' and short != ''
    return short if short and negative == (value < 0) else fill + short
