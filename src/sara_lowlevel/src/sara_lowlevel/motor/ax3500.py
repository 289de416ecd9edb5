"""Roboteq AX3500 over RS-232: what to write, what its answers mean. Bytes in and out, no port.

Protocol: AX3500 user's manual 1.9b, "Serial (RS-232) Controls and Operation" and "RS232 Encoder Command Set". 9600
baud, 7 data bits, even parity. A line ends with CR and is echoed. `!Ann` / `!ann` drive channel 1 forward / reverse
with nn = 00..7F, `!B` / `!b` channel 2, answered by `+`, or `-` when refused. `?Q0`, `?Q1` read the encoder counters:
signed 32 bits in hex, leading digits that only repeat the sign left out (a first digit of 8 or more means a negative
number). `?E` reads the battery and internal voltages, one line each; battery = 55 n / 256 V. With its watchdog on it
stops the motors after 1 s without a character and sends `W`. Ten CRs bring it from R/C to RS-232 mode.

One question is on the line at a time, and an answer counts only after its own echo: a late answer to an earlier
question can not be taken for another wheel's. A round (two commands, two counters) takes about 60 ms.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

from sara_lowlevel.config import AmplifierConfig
from sara_lowlevel.schedule import TIME_TOLERANCE_S, Every

ENTER_RS232 = b'\r' * 10
STOP = b'\r!A00\r!B00\r'
_HEX = re.compile(r'[0-9A-Fa-f]{1,8}')
_LINE_LIMIT = 64


def command(channel: int, output: float) -> str:
    """The line that drives `channel` (1, 2) with `output` (-1..1, forward positive; beyond is cut)."""
    steps = round(min(max(output, -1.0), 1.0) * 0x7F)
    letter = 'AB'[channel - 1]
    return f'!{letter if steps >= 0 else letter.lower()}{abs(steps):02X}'


def counter(text: str) -> int:
    """A counter as the encoder module abbreviates it. Raises ValueError for what is no such number."""
    if not _HEX.fullmatch(text):
        raise ValueError(f'{text!r} is no counter')
    value = int(text, 16)
    return value - (1 << 4 * len(text)) if int(text[0], 16) >= 8 else value


def battery(text: str) -> float:
    """V, of the first line of the answer to `?E`. Raises ValueError."""
    if not _HEX.fullmatch(text) or len(text) > 2:
        raise ValueError(f'{text!r} is no voltage')
    return 55.0 * int(text, 16) / 256.0


@dataclass(frozen=True)
class Count:
    """A wheel's encoder: `steps` forward positive (any integer, modulo 2^32), read at `t` (s)."""

    steps: int
    t: float


class Ax3500:
    """The conversation with one controller.

    `right`, `left`: the last Count of each wheel, None before the first. `voltage`: V, None before the first. `counts`:
    what went wrong.
    """

    def __init__(self, config: AmplifierConfig = AmplifierConfig()) -> None:
        self.config = config
        self.right: Count | None = None
        self.left: Count | None = None
        self.voltage: float | None = None
        self.counts: Counter = Counter()
        self._outputs = (0.0, 0.0)
        self._asked: str | None = None
        self._asked_at = 0.0
        self._echoed = False
        self._answers: list[str] = []
        self._line = bytearray()
        self._turn = 0
        self._battery_due = Every(config.battery_period)
        self._started = False

    def drive(self, right: float, left: float) -> None:
        """What to command from now on, -1..1, forward positive."""
        self._outputs = (right, left)

    def fresh(self, t: float) -> bool:
        """Whether both counters were read within `stale_after`."""
        if self.right is None or self.left is None:
            return False
        return t - min(self.right.t, self.left.t) <= self.config.stale_after

    def poll(self, t: float) -> bytes:
        """What to write to the port now (`t`: s); empty while an answer is awaited."""
        if not self._started:
            self._started = True
            return ENTER_RS232
        if self._asked is not None:
            if t - self._asked_at < self.config.reply_timeout - TIME_TOLERANCE_S:
                return b''
            self.counts['no reply'] += 1
        self._asked, self._asked_at, self._echoed, self._answers = self._next(t), t, False, []
        return self._asked.encode('ascii') + b'\r'

    def feed(self, data: bytes, t: float) -> None:
        """Bytes that came from the port, at `t` (s). Never raises; what makes no sense is counted."""
        for byte in data:
            if byte in (0x0D, 0x0A):
                line = self._line.decode('latin-1').strip()
                self._line.clear()
                if line:
                    self._on_line(line, t)
            elif len(self._line) < _LINE_LIMIT:
                self._line.append(byte)

    def _next(self, t: float) -> str:
        self._turn = (self._turn + 1) % 4
        config = self.config
        if self._turn == 1:
            if self._battery_due.due(t):
                self._turn = 0
                return '?E'
            return command(config.right_channel, -self._outputs[0] if config.right_reversed else self._outputs[0])
        if self._turn == 2:
            return command(3 - config.right_channel, -self._outputs[1] if config.left_reversed else self._outputs[1])
        return '?Q0' if self._turn == 3 else '?Q1'

    def _on_line(self, line: str, t: float) -> None:
        if line == 'W':
            self.counts['watchdog'] += 1
        elif self._asked is None:
            self.counts['unasked'] += 1
        elif line == self._asked:
            self._echoed, self._answers = True, []
        elif not self._echoed:
            self.counts['unasked'] += 1
        elif line == '-':
            self.counts['refused'] += 1
            self._asked = None
        else:
            self._answers.append(line)
            if len(self._answers) == (2 if self._asked == '?E' else 1):
                asked, self._asked = self._asked, None
                self._on_answer(asked, self._answers, t)

    def _on_answer(self, asked: str, answers: list[str], t: float) -> None:
        try:
            if asked[0] == '!':
                if answers[0] != '+':
                    raise ValueError(answers[0])
            elif asked == '?E':
                self.voltage = battery(answers[0])
            else:
                self._on_counter(int(asked[2]) + 1, counter(answers[0]), t)
        except ValueError:
            self.counts['garbled'] += 1

    def _on_counter(self, channel: int, value: int, t: float) -> None:
        config = self.config
        if channel == config.right_channel:
            self.right = Count(-value if config.right_encoder_reversed else value, t)
        else:
            self.left = Count(-value if config.left_encoder_reversed else value, t)
